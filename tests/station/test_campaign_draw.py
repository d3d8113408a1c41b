"""Flight i is the same whoever flies it, in whatever order, and however many others there are."""

import math
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.campaign.draw import FlightTasks, drawn_values
from station.campaign.factor import Choice, Listed, Normal, Uniform
from station.campaign.flight_task import FlightTask
from station.campaign.polar import without_polar
from station.campaign.spec import CampaignSpec

GUST, NOISE, GUIDANCE = "simulator.wind.gust_mps", "camera.simulated.optics.noise_level", "commander.guidance"
DRAWN = {GUST: Uniform(uniform=(0.0, 2.0)), NOISE: Normal(normal=(4.0, 3.0), within=(1.0, 6.0))}
LISTED = {GUIDANCE: Listed(values=("glide", "reposition")), "camera.rate_hz": Listed(values=(10.0, 20.0, 30.0))}


def spec(**changed: object) -> CampaignSpec:
    return CampaignSpec.model_validate({"name": "test", "seed": 5, "flights": 50, "factors": DRAWN, **changed})


def tasks(campaign: CampaignSpec) -> list[FlightTask]:
    return list(FlightTasks(campaign, Path("spec.toml")).values())


@given(index=st.integers(0, 49), flights=st.integers(50, 2000))
def test_a_flight_does_not_depend_on_the_others(index: int, flights: int) -> None:
    assert drawn_values(spec(flights=flights), index) == drawn_values(spec(), index)


def test_flights_differ_from_each_other_and_from_those_of_another_seed() -> None:
    values = [drawn_values(spec(), index) for index in range(50)]
    for key in (GUST, NOISE, "seed"):
        assert len({value[key] for value in values}) == 50
    assert drawn_values(spec(seed=6), 3) != drawn_values(spec(), 3)


def test_another_factor_leaves_the_draws_of_the_others_as_they_were() -> None:
    more = spec(factors={"camera.simulated.delay_s": Uniform(uniform=(0.0, 0.1)), **DRAWN})
    assert all(drawn_values(more, index)[GUST] == drawn_values(spec(), index)[GUST] for index in range(50))


def test_every_combination_is_flown_as_often_and_also_in_any_part() -> None:
    campaign = spec(factors=LISTED | DRAWN, flights=4)
    flown = [tuple(drawn_values(campaign, index)[key] for key in LISTED) for index in range(campaign.total)]
    assert set(Counter(flown).values()) == {4}
    assert len(set(flown[7:13])) == 6


def test_paired_combinations_share_their_draws_and_others_do_not() -> None:
    paired, other = (spec(factors=LISTED | DRAWN, paired=paired) for paired in (True, False))
    shared = [(drawn_values(paired, index)["seed"], drawn_values(paired, index)[GUST]) for index in range(12)]
    assert len(set(shared[:6])) == len(set(shared[6:])) == 1
    assert shared[0] != shared[6]
    assert len({drawn_values(other, index)[GUST] for index in range(12)}) == 12


def test_distributions_are_what_they_are_called() -> None:
    factors = {
        "uniform": Uniform(uniform=(2.0, 4.0)),
        "normal": Normal(normal=(5.0, 2.0)),
        "cut": Normal(normal=(5.0, 2.0), within=(6.0, 7.0)),
        "whole": Uniform(uniform=(1, 3), integer=True),
        "choice": Choice(choice=("often", "seldom", "never"), weights=(9.0, 1.0, 0.0)),
    }
    drawn = [drawn_values(spec(factors=factors), index) for index in range(2000)]
    uniform, normal = ([value[key] for value in drawn] for key in ("uniform", "normal"))
    assert 2.0 <= min(uniform) < 2.01
    assert 3.99 < max(uniform) <= 4.0
    mean = sum(normal) / 2000
    assert abs(mean - 5.0) < 4 * 2.0 / math.sqrt(2000)
    assert abs(math.sqrt(sum((value - mean) ** 2 for value in normal) / 2000) - 2.0) < 4 * 2.0 / math.sqrt(4000)
    assert all(6.0 <= value["cut"] <= 7.0 for value in drawn)
    assert Counter(value["whole"] for value in drawn).keys() == {1, 2, 3}
    counts = Counter(value["choice"] for value in drawn)
    assert counts.keys() == {"often", "seldom"}
    assert abs(counts["seldom"] - 200) < 4 * math.sqrt(2000 * 0.1 * 0.9)


@pytest.mark.parametrize(
    ("from_deg", "north_mps", "east_mps"), [(0.0, -3.0, 0.0), (90.0, 0.0, -3.0), (270.0, 0.0, 3.0)]
)
def test_wind_comes_from_where_it_is_said_to(from_deg: float, north_mps: float, east_mps: float) -> None:
    wind = without_polar({"wind.speed_mps": 3.0, "wind.from_deg": from_deg})
    assert wind["simulator.wind.north_mps"] == pytest.approx(north_mps, abs=1e-12)
    assert wind["simulator.wind.east_mps"] == pytest.approx(east_mps, abs=1e-12)


def test_the_start_lies_in_the_direction_that_is_said_from_the_pad() -> None:
    factors = {
        "start.distance_m": Listed(values=(8.0,)),
        "start.azimuth_deg": Listed(values=(90.0,)),
        "start.height_m": Listed(values=(12.0,)),
        "simulator.pad.north_m": Listed(values=(100.0,)),
        "simulator.pad.height_above_home_m": Listed(values=(3.0,)),
    }
    [in_the_air] = tasks(spec(factors=factors, flights=1))
    airborne = in_the_air.settings.simulator.airborne
    assert airborne is not None
    assert (airborne.north_m, airborne.east_m, airborne.down_m) == pytest.approx((0.0, 8.0, -12.0))
    [from_the_ground] = tasks(spec(factors=factors, flights=1, begin="ground"))
    assert from_the_ground.settings.simulator.airborne is None
    assert from_the_ground.start_ned_m == pytest.approx((100.0, 3.0 + 8.0, -12.0 - 3.0), abs=3.0)


def test_settings_of_all_flights_and_the_preset_stand_below_the_factors() -> None:
    campaign = spec(preset="paper", settings={"camera": {"rate_hz": 20.0}}, flights=2)
    for task in tasks(campaign):
        assert task.settings.camera.rate_hz == 20.0
        assert task.settings.geolocator.correction.method == "cylindrical"
        assert task.settings.simulator.wind.gust_mps == task.drawn[GUST]
        assert task.settings.seed == task.drawn["seed"]


def test_a_seed_that_is_set_is_not_drawn() -> None:
    assert [task.settings.seed for task in tasks(spec(settings={"seed": 3}, flights=2))] == [3, 3]
    assert [task.settings.seed for task in tasks(spec(factors={"seed": Listed(values=(7, 8))}, flights=1))] == [7, 8]
