"""Two messages compared field by field."""

import math

from hypothesis import given
from hypothesis import strategies as st

from schemas.message import GlobalPosition
from schemas.vehicle import VehicleState
from station.replay.comparison import FieldDifference, differences
from station.replay.tolerance import EXACT, LOSSY, ROUNDING

NUMBERS = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e300, max_value=1e300)


def state(latitude_deg: float = 47.0, north_mps: float = 1.0) -> VehicleState:
    position = GlobalPosition(
        latitude_deg=latitude_deg, longitude_deg=8.0, altitude_amsl_m=500.0, ellipsoidal_height_m=548.0
    )
    return VehicleState(
        at_ns=1,
        position=position,
        velocity_ned_mps=(north_mps, 0.0, 0.0),
        q_ned_body=(1.0, 0.0, 0.0, 0.0),
        angular_velocity_body_rps=(0.0, 0.0, 0.0),
    )


def test_the_smallest_change_of_a_number_is_found_and_named() -> None:
    (found,) = differences(state(), state(latitude_deg=math.nextafter(47.0, 48.0)), EXACT)
    assert found.path == "position.latitude_deg"
    assert found.ulps == 1
    assert not found.within
    assert "47.0" in found.text() and "1 ulp" in found.text() and "has to be the same" in found.text()


def test_parts_of_a_vector_are_told_apart() -> None:
    assert [d.path for d in differences(state(), state(north_mps=2.0), EXACT)] == ["velocity_ned_mps[0]"]
    assert differences(state(), state(north_mps=1.0), EXACT) == ()


@given(NUMBERS)
def test_ulps_count_the_steps_between_two_numbers(value: float) -> None:
    after = math.nextafter(math.nextafter(value, math.inf), math.inf)
    assert FieldDifference("x", value, after, 0.0).ulps == 2
    assert FieldDifference("x", after, value, 0.0).ulps == 2


def test_zero_has_no_sign() -> None:
    assert differences(state(north_mps=0.0), state(north_mps=-0.0), EXACT) == ()


def test_tolerances_are_by_the_kind_of_a_field_and_what_is_no_number_is_never_tolerated() -> None:
    assert ROUNDING.of("corrected.position.latitude_deg") == 1e-11
    assert ROUNDING.of("corrected.pad_ned_m[2]") == 1e-6
    assert ROUNDING.of("markers[0].corners_px[3][1]") == 1e-3
    assert ROUNDING.of("captured_at_ns") == 0.0
    assert LOSSY.of("covariance_ned_m2[4]") == math.inf
    assert FieldDifference("verdict", "accepted", "no_marker", 1.0).within is False
    assert FieldDifference("raw", None, 1.0, 10.0).within is False
