"""Where the error model's hovers are."""

import pytest

from alight.runtime.settings_file import SettingsError
from station.experiment.hover_plan import HoverPlace, hover_settings, other_places, paper_places


def test_twenty_records_at_seventeen_positions():
    places = paper_places()
    assert len(places) == 20
    assert len(set(places)) == 17
    assert {place.height_m for place in places} == {10.0}


def test_what_is_tested_is_not_in_the_fit():
    assert not set(paper_places()) & set(other_places())
    assert {place.height_m for place in other_places()} == {3.0, 5.0, 10.0, 15.0, 20.0}


def test_heights_are_above_the_ground_at_home_and_not_above_the_pad():
    settings = hover_settings(HoverPlace(5.0, 90.0), 3, {})
    start = settings.simulator.airborne
    assert settings.simulator.pad.height_above_home_m == -0.233
    assert start.down_m == pytest.approx(-10.233)
    assert (start.north_m, start.east_m) == (pytest.approx(0.0, abs=1e-12), pytest.approx(5.0))
    assert settings.geolocator.correction.method == "none"


def test_a_start_of_ones_own_is_refused():
    with pytest.raises(SettingsError, match=r"simulator\.airborne"):
        hover_settings(HoverPlace(0.0, 0.0), 1, {}, ["simulator.airborne={north_m = 1.0}"])
