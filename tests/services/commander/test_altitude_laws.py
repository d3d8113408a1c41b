"""Eq. 17-20."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.commander.altitude_laws import exponential_altitude_m, linear_altitude_m

heights = st.floats(1.01, 500.0)
switching = st.floats(0.1, 2.0)
pads = st.floats(-400.0, 5000.0)


def test_the_papers_own_setting() -> None:
    """Pad at altitude 0, h0 = 2 m, from 20 m: 20 (1 - 0.1 exp(-1 / 19))."""
    assert exponential_altitude_m(20.0, 20.0, 2.0) == pytest.approx(20.0 * (1 - 0.1 * math.exp(-1 / 19)))


@given(heights, switching, pads)
def test_the_exponential_law_goes_down_and_never_below_nine_tenths_of_the_height(
    h: float, h0: float, pad: float
) -> None:
    altitude = pad + h
    target = exponential_altitude_m(altitude, h, h0)
    assert 0.9 * h - 1e-6 <= target - pad <= h + 1e-6


@given(heights, switching, pads)
def test_the_altitude_of_the_pad_does_not_matter(h: float, h0: float, pad: float) -> None:
    assert exponential_altitude_m(pad + h, h, h0) - pad == pytest.approx(exponential_altitude_m(h, h, h0), abs=1e-6)


@given(st.floats(1.5, 400.0), st.floats(0.01, 100.0), switching)
def test_the_step_grows_with_the_height(h: float, more: float, h0: float) -> None:
    low, high = h - exponential_altitude_m(h, h, h0), h + more - exponential_altitude_m(h + more, h + more, h0)
    assert high >= low


def test_repeated_steps_come_to_the_switching_height() -> None:
    h, steps = 20.0, 0
    while h > 2.0:
        h = exponential_altitude_m(h, h, 2.0)
        steps += 1
        assert steps < 100
    assert steps > 20


@given(st.floats(-10.0, 1.0), st.just(2.0))
def test_at_and_below_the_shifted_switching_height_it_refuses(h: float, h0: float) -> None:
    with pytest.raises(ValueError, match="beta0 h0"):
        exponential_altitude_m(h, h, h0)


@given(pads, st.floats(0.1, 3.0), st.floats(0.1, 5.0))
def test_the_linear_law_keeps_its_speed(altitude: float, alpha: float, period: float) -> None:
    step = altitude - linear_altitude_m(altitude, alpha, period)
    assert step / period == pytest.approx(alpha, rel=1e-6)
