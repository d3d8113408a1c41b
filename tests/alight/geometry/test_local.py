"""Moving on the earth in local coordinates and measuring what one moved."""

import numpy as np
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.local import moved_by_ned, ned_between
from schemas.message import GlobalPosition

steps = st.tuples(*[st.floats(-2000.0, 2000.0)] * 3)


@st.composite
def places(draw):
    height = draw(st.floats(-100.0, 5000.0))
    return GlobalPosition(
        latitude_deg=draw(st.floats(-90.0, 90.0)),
        longitude_deg=draw(st.floats(-180.0, 180.0)),
        altitude_amsl_m=height - draw(st.floats(-100.0, 80.0)),
        ellipsoidal_height_m=height,
    )


@given(places(), steps)
def test_going_there_and_looking_back_gives_the_step(origin, step):
    np.testing.assert_allclose(ned_between(origin, moved_by_ned(origin, step)), step, atol=1e-6)


@given(places(), steps)
def test_geoid_separation_is_carried_along(origin, step):
    moved = moved_by_ned(origin, step)
    separation = origin.ellipsoidal_height_m - origin.altitude_amsl_m
    assert moved.ellipsoidal_height_m - moved.altitude_amsl_m == pytest.approx(separation, abs=1e-6)


@given(places(), places())
def test_ned_between_agrees_with_pymap3d(origin, point):
    theirs = pymap3d.geodetic2ned(
        point.latitude_deg, point.longitude_deg, point.ellipsoidal_height_m,
        origin.latitude_deg, origin.longitude_deg, origin.ellipsoidal_height_m,
    )  # fmt: skip
    np.testing.assert_allclose(ned_between(origin, point), theirs, rtol=0, atol=1e-6)


def test_across_the_antimeridian_is_a_short_way():
    west = GlobalPosition(latitude_deg=0, longitude_deg=179.99999, altitude_amsl_m=0, ellipsoidal_height_m=0)
    east = GlobalPosition(latitude_deg=0, longitude_deg=-179.99999, altitude_amsl_m=0, ellipsoidal_height_m=0)
    assert ned_between(west, east)[1] == pytest.approx(2.226, abs=1e-3)


@pytest.mark.parametrize("step", [(float("nan"), 0.0, 0.0), (0.0, 0.0, 1e6), (float("inf"), 0.0, 0.0)])
def test_steps_that_lead_nowhere_are_refused(step):
    origin = GlobalPosition(latitude_deg=40, longitude_deg=-3, altitude_amsl_m=600, ellipsoidal_height_m=650)
    with pytest.raises(ValueError):
        moved_by_ned(origin, step)
