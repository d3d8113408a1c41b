"""What a campaign's file may say, and what is said of one that cannot be flown."""

import re
from pathlib import Path

import pytest

from station.campaign.draw import FlightTasks
from station.campaign.row import MEASURED
from station.campaign.spec import CampaignSpec, SpecError, read_spec

PAGE = Path(__file__).parents[2] / "docs" / "campaigns.md"
EXAMPLES = sorted((Path(__file__).parents[2] / "station" / "campaign" / "examples").glob("*.toml"))


def spec_of(tmp_path: Path, text: str) -> CampaignSpec:
    path = tmp_path / "spec.toml"
    path.write_text(text)
    return read_spec(path)


def complaint(tmp_path: Path, text: str) -> str:
    """What is said before the first flight."""
    path = tmp_path / "spec.toml"
    path.write_text(text)
    with pytest.raises(SpecError) as caught:
        FlightTasks(read_spec(path), path)
    assert str(caught.value).startswith(str(path)), "the file is named"
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(str(path))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_can_be_flown(path: Path) -> None:
    spec = read_spec(path)
    assert len(FlightTasks(spec, path)) == spec.total


def test_the_page_on_campaigns_shows_a_spec_that_can_be_flown_and_every_column(tmp_path: Path) -> None:
    page = PAGE.read_text()
    [text] = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    assert len(FlightTasks(spec_of(tmp_path, text), tmp_path / "spec.toml")) == 2 * 50
    assert [column for column in MEASURED if f"`{column}`" not in page] == []


def test_lists_are_combined_and_each_combination_flown_as_often(tmp_path: Path) -> None:
    text = 'flights = 5\n[factors]\ncommander.guidance = ["glide", "reposition"]\ncamera.rate_hz = [10.0, 20.0, 30.0]'
    spec = spec_of(tmp_path, text)
    assert (spec.combinations, spec.total) == (6, 30)


def test_dotted_keys_and_sections_mean_the_same(tmp_path: Path) -> None:
    dotted = spec_of(tmp_path, "[factors]\nsimulator.wind.gust_mps = {uniform = [0, 1]}")
    section = spec_of(tmp_path, "[factors.simulator.wind]\ngust_mps = {uniform = [0, 1]}")
    quoted = spec_of(tmp_path, '[factors]\n"simulator.wind.gust_mps" = {uniform = [0, 1]}')
    assert dotted == section == quoted


def test_a_missing_name_is_the_files(tmp_path: Path) -> None:
    assert spec_of(tmp_path, "").name == "spec"


def test_more_flights_or_recordings_are_the_same_campaign_another_factor_is_not(tmp_path: Path) -> None:
    text = "flights = 3\n[factors]\nsimulator.wind.gust_mps = {uniform = [0, 1]}"
    digest = spec_of(tmp_path, text).digest
    assert spec_of(tmp_path, text.replace("flights = 3", "flights = 9\nkeep.worst = 1")).digest == digest
    assert spec_of(tmp_path, text.replace("[0, 1]", "[0, 2]")).digest != digest
    assert spec_of(tmp_path, text + "\ncamera.rate_hz = [10.0]").digest != digest


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("flights = 0", "flights: Input should be greater than or equal to 1"),
        ("flihgts = 3", "flihgts is no key here; did you mean flights?"),
        ("flights = ", "not valid TOML"),
        ('preset = "papr"', "preset: there is no `papr`; there are paper"),
        ("[settings]\ncamera.rate = 3", "[settings]: camera.rate is no setting; did you mean camera.rate_hz?"),
        ("[settings]\ncamera.rate_hz = 1e6", "[settings]: camera.rate_hz: Input should be less than"),
        ("[factors]\ncamera.rate_hz = 3.0", "factors.camera.rate_hz: 3.0 is neither a list nor a distribution"),
        ("[factors]\ncamera.rate_hz = []", "factors.camera.rate_hz: values: Tuple should have at least 1 item"),
        ("[factors]\ncamera.rate_hz = {uniform = [3, 2]}", "holds nothing: write the smaller number first"),
        ("[factors]\ncamera.rate_hz = {uniform = [3]}", "factors.camera.rate_hz: uniform.1: Field required"),
        ("[factors]\nx = {normal = [0, 1], wihtin = [1, 2]}", "factors.x: wihtin is no key here; did you mean within?"),
        ("[factors]\nx = {normal = [0, -1]}", "the standard deviation -1 is negative"),
        ("[factors]\nx = {normal = [0, 1], within = [9, 10]}", "holds less than 0.1 % of this distribution: widen it"),
        ("[factors]\nx = {choice = [1, 2], weights = [1]}", "weights must be 2 numbers"),
        ("[factors]\nx = {uniform = [0.5, 2], integer = true}", "both ends must be whole numbers"),
        ("[factors]\nsimulator.wnd.gust_mps = [1]", "[factors], flight 0: simulator.wnd is no setting; did you mean simulator.wind?"),
        ("flights = 99\n[factors]\nsimulator.wind.gust_mps = {normal = [8, 1]}", "Input should be less than or equal to 10"),
        ("[factors]\nwind.from_deg = [0]", "wind.from_deg: a direction without a speed; add wind.speed_mps"),
        ("[factors]\nwind.speed = [0]", "wind.speed is no key; there are wind.speed_mps"),
        ('[factors]\nwind.speed_mps = ["3"]', "wind.speed_mps: a number is needed (got '3')"),
        ("[factors]\nwind.speed_mps = [1]\nsimulator.wind.east_mps = [1]", "say the same twice: leave one out"),
        ("factors = 3", "factors: a table is needed"),
    ],
)  # fmt: skip
def test_what_cannot_be_flown_is_refused_with_file_key_and_remedy(tmp_path: Path, text: str, said: str) -> None:
    assert said in complaint(tmp_path, text)


def test_the_flight_that_drew_an_impossible_value_is_named(tmp_path: Path) -> None:
    said = complaint(tmp_path, "flights = 99\n[factors]\nsimulator.wind.gust_mps = {normal = [8, 1]}")
    assert "[factors], flight " in said
    assert "simulator.wind.gust_mps" in said


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"nowhere.toml: cannot be read \(No such file or directory\)"):
        read_spec(tmp_path / "nowhere.toml")
