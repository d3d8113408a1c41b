"""Where the pad is by now: what carries an estimate on, how unsure it becomes, and what carries nothing."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.local import ned_between
from schemas.estimate import PadEstimate
from schemas.message import GlobalPosition
from schemas.settings.commander import CarrySettings
from services.commander.carried_pad import CarriedPad, carried

THEN = 1_767_225_600_000_000_000
PLACE = GlobalPosition(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=500.0, ellipsoidal_height_m=547.0)
SETTINGS = CarrySettings()


def estimate(**changes: object) -> PadEstimate:
    """Known to 2 cm, drifting north at 5 cm/s, known to 1 cm/s."""
    told: dict[str, object] = {
        "captured_at_ns": THEN,
        "position": PLACE,
        "pad_ned_m": (0.0, 0.0, 1.0),
        "azimuth_rad": 0.3,
        "covariance_ned_m2": diagonal(0.02**2),
        "azimuth_variance_rad2": 0.01,
        "method": "kalman",
        "fixes_used": 9,
        "velocity_ned_mps": (0.05, 0.0, 0.0),
        "velocity_covariance_ned": diagonal(0.01**2),
    }
    return PadEstimate.model_validate({**told, **changes})


def diagonal(variance: float) -> tuple[float, ...]:
    return (variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance)


def after(age_s: float, told: PadEstimate) -> CarriedPad:
    return carried(told, SETTINGS, THEN + round(age_s * 1e9))


def moved_m(pad: CarriedPad) -> tuple[float, ...]:
    return tuple(ned_between(PLACE, pad.position).tolist())


def test_it_goes_on_with_the_drift_and_grows_less_certain() -> None:
    pad = after(2.0, estimate())
    assert moved_m(pad) == pytest.approx((0.1, 0.0, 0.0), abs=1e-6)
    assert pad.sigma_m == pytest.approx(0.02 + 2.0 * 0.01)


def test_it_goes_on_from_the_time_that_the_place_speaks_of() -> None:
    """The filter has carried it that far already."""
    assert moved_m(after(2.0, estimate(position_at_ns=THEN + 500_000_000))) == pytest.approx((0.075, 0, 0), abs=1e-6)


@pytest.mark.parametrize("at_ns", [0, THEN - 10**12])
def test_a_place_does_not_speak_of_a_time_before_the_picture(at_ns: int) -> None:
    assert moved_m(after(2.0, estimate(position_at_ns=at_ns))) == pytest.approx((0.1, 0.0, 0.0), abs=1e-6)


def test_a_place_that_speaks_of_the_future_stands() -> None:
    assert moved_m(after(2.0, estimate(position_at_ns=THEN + 10**12))) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


def test_an_old_estimate_stands_where_it_was_carried_to_and_grows_ever_less_certain() -> None:
    limit, later = after(SETTINGS.for_s, estimate()), after(SETTINGS.for_s + 60.0, estimate())
    assert moved_m(later) == pytest.approx(moved_m(limit), abs=1e-6)
    assert later.sigma_m == pytest.approx(limit.sigma_m + 60.0 * 0.01)


@pytest.mark.parametrize(
    "nonsense",
    [
        {"velocity_ned_mps": (80.0, 0.0, 0.0)},
        {"velocity_ned_mps": (0.0, 0.0, -0.5)},
        {"velocity_covariance_ned": diagonal(25.0)},
        {"velocity_covariance_ned": diagonal(-1.0)},
        {"velocity_covariance_ned": None},
        {"velocity_ned_mps": None},
    ],
    ids=["too fast", "too fast upwards", "not known", "no covariance", "not said how sure", "none told"],
)
def test_a_drift_that_makes_no_sense_carries_nothing_and_the_place_ages_as_an_unknown_one(
    nonsense: dict[str, object],
) -> None:
    pad = after(2.0, estimate(**nonsense))
    assert moved_m(pad) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert pad.sigma_m == pytest.approx(0.02 + 2.0 * SETTINGS.unknown_drift_mps)


any_speed = st.floats(allow_nan=False, allow_infinity=False)


@given(st.tuples(any_speed, any_speed, any_speed), st.floats(0.0, 1e6), st.floats(-10.0, 1e5))
def test_whatever_is_told_it_is_never_carried_far(drift: tuple[float, ...], variance: float, age_s: float) -> None:
    pad = after(age_s, estimate(velocity_ned_mps=drift, velocity_covariance_ned=diagonal(variance)))
    north, east, down = moved_m(pad)
    farthest_m = SETTINGS.max_drift_mps * SETTINGS.for_s + 1e-6
    assert math.hypot(north, east) <= farthest_m
    assert abs(down) <= farthest_m
    assert pad.sigma_m >= 0.02


def test_the_standard_deviation_is_that_of_the_longer_axis() -> None:
    stretched = estimate(covariance_ned_m2=(1.0, 0.9, 0, 0.9, 1.0, 0, 0, 0, 1.0))
    assert after(0.0, stretched).sigma_m == pytest.approx(1.9**0.5)
