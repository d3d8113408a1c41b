"""Means and medians of directions do not care where the circle is cut."""

import math
import statistics

import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.circular import circular_mean, circular_median

angles = st.floats(-math.pi, math.pi)
narrow = st.lists(st.floats(-0.7, 0.7), min_size=1, max_size=15)


def apart(a, b):
    return abs(math.remainder(a - b, math.tau))


@pytest.mark.parametrize("average", [circular_mean, circular_median])
@given(spread=narrow, turn=st.floats(-20.0, 20.0))
def test_turning_all_turns_the_average(average, spread, turn):
    assert apart(average([a + turn for a in spread]), average(spread) + turn) < 1e-6


@given(narrow, angles)
def test_median_is_the_ordinary_one_wherever_the_circle_is_cut(spread, turn):
    if len(spread) % 2:
        assert apart(circular_median([a + turn for a in spread]), statistics.median(spread) + turn) < 1e-9


def test_even_number_has_its_median_between_the_middle_two():
    assert circular_median([0.1, 0.2, 0.4, 3.0]) == pytest.approx(0.3)


def test_across_the_cut():
    assert apart(circular_mean([math.pi - 0.1, -math.pi + 0.3]), -math.pi + 0.1) < 1e-9
    assert apart(circular_median([math.pi - 0.1, math.pi - 0.2, -math.pi + 0.3]), math.pi - 0.1) < 1e-9


def test_median_ignores_one_that_looks_elsewhere():
    assert circular_median([0.10, 0.11, 0.12, -3.0, 0.13]) == pytest.approx(0.11, abs=0.011)


@given(st.lists(angles, min_size=1, max_size=12))
def test_no_direction_has_a_smaller_sum_of_arcs_than_the_median(spread):
    def total(direction):
        return sum(apart(direction, a) for a in spread)

    # Points that balance each other all round have several medians; what they share is the smallest sum.
    best = min(total(a) for a in spread)
    median = circular_median(spread)
    assert -math.pi < median <= math.pi
    if max(apart(a, spread[0]) for a in spread) < math.pi / 2:
        assert total(median) <= best + 1e-6


def test_opposite_directions_have_no_mean_so_the_last_counts():
    assert circular_mean([0.0, math.pi / 2, math.pi, -math.pi / 2]) == pytest.approx(-math.pi / 2)


def test_nothing_has_no_average():
    with pytest.raises(ValueError, match="no angles"):
        circular_mean([])
    with pytest.raises(ValueError, match="no angles"):
        circular_median([])
