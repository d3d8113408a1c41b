"""Settings: who wins, and what a person reads when something is wrong."""

from pathlib import Path

import pytest

from alight.runtime.settings_file import SettingsError, load_settings
from schemas.settings import Settings


def write(folder: Path, text: str) -> Path:
    path = folder / "site.toml"
    path.write_text(text)
    return path


def test_without_anything_the_defaults_hold() -> None:
    assert load_settings() == Settings()


def test_file_then_environment_then_assignment(tmp_path: Path) -> None:
    path = write(tmp_path, "seed = 1\n[pad]\nid = 1\nside_m = 0.5\nfamily = '4x4_50'\n")
    environment = {"ALIGHT_PAD__ID": "2", "ALIGHT_PAD__SIDE_M": "0.6", "ALIGHT_SEED": "2"}
    settings = load_settings(path, environment, ["pad.id=3"])
    assert (settings.pad.id, settings.pad.side_m, settings.pad.family, settings.seed) == (3, 0.6, "4x4_50", 2)


def test_a_flights_own_record_can_be_flown_again(tmp_path: Path) -> None:
    first = load_settings(None, {}, ["pad.id=7", "simulator.wind.north_mps=2.5"])
    path = tmp_path / "settings.json"
    path.write_text(first.model_dump_json())
    assert load_settings(path) == first


def test_text_needs_no_quotes() -> None:
    assert load_settings(None, {}, ["pad.family=6x6_250"]).pad.family == "6x6_250"


def test_variables_of_others_are_left_alone() -> None:
    assert load_settings(None, {"ALIGHTER": "1", "PATH": "/", "ALIGHT_REAL_DATA": "x"}) == Settings()
    assert load_settings(None, {"ALIGHT_PX4_RUN": "x", "ALIGHT_PX4_LOGS": "x", "ALIGHT_CAMERAS": "2"}) == Settings()


@pytest.mark.parametrize(
    ("file_text", "environment", "assignments", "expected"),
    [
        ("[pad]\nsid_m = 1.0\n", {}, [], ["site.toml", "pad.sid_m", "did you mean pad.side_m?"]),
        ("[pad]\nside_m = -1.0\n", {}, [], ["site.toml", "pad.side_m", "greater than 0", "-1.0"]),
        ("[pad]\nside_m = 'wide'\n", {}, [], ["site.toml", "pad.side_m", "number", "wide"]),
        ("pad = [\n", {}, [], ["site.toml", "not valid toml"]),
        ("[pda]\nid = 5", {}, [], [".toml: pda is no setting", "did you mean pad?"]),
        ("", {"ALIGHT_PAD__ID": "-5"}, [], ["ALIGHT_PAD__ID", "pad.id"]),
        ("", {"ALIGHT_CAMERA_RATE_HZ": "20"}, [], ["variable ALIGHT_CAMERA_RATE_HZ: ", "write ALIGHT_CAMERA__RATE_HZ"]),
        ("", {"ALIGHT_CAMERA_LIVE_URL": "x"}, [], ["two underscores", "write ALIGHT_CAMERA__LIVE__URL"]),
        ("", {"ALIGHT_PAD_IDD": "5"}, [], ["two underscores", "write ALIGHT_PAD__IDD"]),
        ("", {}, ["pad.id=x"], ["--set pad.id=x", "pad.id", "integer"]),
        ("", {}, ["pad.id"], ["--set pad.id", "section.key=value"]),
        ("", {}, ["seed=nan"], ["--set seed=nan", "seed"]),
        ("", {}, ['bus.connect=["192.0.2.5:7447"]'], ["bus.connect: '192.0.2.5:7447' is no", '["tcp/192.0.2.5:7447"]']),
        ("", {}, ['bus.listen=["tcp/127.0.0.1"]'], ["bus.listen: 'tcp/127.0.0.1' is no endpoint", "tcp/HOST:PORT"]),
        ("", {}, ["bus.connect=foo"], ['bus.connect: a list is wanted, such as ["tcp/192.168.1.5:7447"]', "got 'foo'"]),
    ],
)
def test_an_error_names_source_key_and_remedy_in_one_line(
    tmp_path: Path, file_text: str, environment: dict[str, str], assignments: list[str], expected: list[str]
) -> None:
    with pytest.raises(SettingsError) as error:
        load_settings(write(tmp_path, file_text), environment, assignments)
    text = str(error.value)
    assert "\n" not in text
    for part in expected:
        assert part.lower() in text.lower()


@pytest.mark.parametrize(
    "endpoint",
    [
        "tcp/192.0.2.5:7447",
        "tcp/[::1]:7447#iface=lo",
        "udp/station.local:7447?rel=0#iface=eth0",
        "tls/192.0.2.5:7447",
        "quic/192.0.2.5:7447",
        "ws/192.0.2.5:7447",
        "serial//dev/ttyUSB0#baudrate=115200",
        "unixsock-stream//tmp/alight.sock",
        "unixpipe//tmp/alight.pipe",
        "vsock/-1:1234",
    ],
)
def test_all_that_zenoh_connects_by_is_an_endpoint(endpoint: str) -> None:
    assert load_settings(None, {}, [f'bus.connect=["{endpoint}"]']).bus.connect == (endpoint,)


@pytest.mark.parametrize("endpoint", ["tcp/", "tcp/:7447", "tcp/a:70000", "tcp//a:1", "tcp://a:1", "a:1", ""])
def test_what_zenoh_could_not_make_out_is_none(endpoint: str) -> None:
    with pytest.raises(SettingsError, match="no endpoint"):
        load_settings(None, {}, [f'bus.listen=["tcp/127.0.0.1:0", "{endpoint}"]'])


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"nowhere\.toml.*No such file"):
        load_settings(tmp_path / "nowhere.toml")
