"""The filter: windows with memory, their covariance, their gate and their ends."""

import math

import numpy as np
import pytest
from fix_stream import HOPS, PAD, T0_NS, VEHICLE_NED_M, feed, filter_node, fix, ned_of
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from alight.geometry.local import ned_between
from schemas.estimate import PadEstimate
from schemas.fix import FixVerdict
from schemas.settings.filter import FilterSettings

OPEN = {"sigma": 0.0}
"""No gate."""
offsets = st.tuples(*[st.floats(-5.0, 5.0)] * 3)
methods = st.sampled_from(["none", "mean", "median"])


def every(period_s, values, **others):
    return [fix(i * period_s, value, **others) for i, value in enumerate(values)]


@given(methods, st.integers(2, 8), offsets, st.floats(-math.pi, math.pi))
def test_constant_input_comes_out_unchanged(method, length, ned_m, azimuth_rad):
    node = filter_node(method=method, window_length=length)
    estimates = feed(node, *every(0.03, [ned_m] * 25, azimuth_rad=azimuth_rad))
    assert estimates
    for estimate in estimates:
        np.testing.assert_allclose(ned_of(estimate), ned_m, atol=1e-6)
        assert math.remainder(estimate.azimuth_rad - azimuth_rad, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_mean_of_a_window_and_its_weight_in_the_next():
    node = filter_node(method="mean", window_length=4, gate=OPEN)
    first, second = feed(
        node, *every(0.03, [(1, 0, 0), (2, 0, 0), (3, 0, 0), (6, 0, 0), (0, 8, 0), (0, 8, 0), (0, 8, 0)])
    )
    np.testing.assert_allclose(ned_of(first), (3.0, 0.0, 0.0), atol=1e-6)
    np.testing.assert_allclose(ned_of(second), (3.0 / 4, 24.0 / 4, 0.0), atol=1e-6)
    assert (first.fixes_used, second.fixes_used) == (4, 4)


@given(st.integers(2, 9))
def test_the_past_fades_by_the_window_length_each_time(length):
    node = filter_node(method="mean", window_length=length, gate=OPEN)
    estimates = feed(node, *every(0.03, [(1.0, 0.0, 0.0)] * length + [(0.0, 0.0, 0.0)] * (3 * (length - 1))))
    norths = [ned_of(estimate)[0] for estimate in estimates]
    assert norths == pytest.approx([1.0, 1 / length, 1 / length**2, 1 / length**3], abs=1e-6)


def test_median_is_not_moved_by_one_wild_fix():
    node = filter_node(method="median", window_length=5, gate=OPEN)
    (estimate,) = feed(node, *every(0.03, [(0.1, 0, 0), (0.2, 0, 1), (50, -50, 50), (0.3, 0, 2), (0.2, 0, 3)]))
    np.testing.assert_allclose(ned_of(estimate), (0.2, 0.0, 2.0), atol=1e-6)


def test_azimuths_are_averaged_across_the_cut():
    fixes = [fix(i * 0.03, azimuth_rad=a) for i, a in enumerate((math.pi - 0.02, -math.pi + 0.04, math.pi - 0.05))]
    (mean,) = feed(filter_node(method="mean", window_length=3), *fixes)
    (median,) = feed(filter_node(method="median", window_length=3), *fixes)
    # The mean direction of a narrow spread is the arithmetic mean but for terms of third order.
    assert mean.azimuth_rad == pytest.approx(math.pi - 0.01, abs=1e-4)
    assert median.azimuth_rad == pytest.approx(math.pi - 0.02)


@given(methods)
def test_estimate_carries_time_hops_and_the_way_from_the_newest_vehicle(method):
    node = filter_node(method=method, window_length=3, gate=OPEN)
    moving = [fix(i * 0.03, (0.0, 0.0, 0.0), vehicle=(3.0 - i, -4.0, -12.0 + i)) for i in range(3)]
    estimate = feed(node, *moving)[-1]
    assert estimate.captured_at_ns == moving[-1].captured_at_ns
    assert estimate.hops == HOPS
    assert estimate.method == method
    np.testing.assert_allclose(estimate.pad_ned_m, ned_between(moving[-1].vehicle_position, PAD), atol=1e-6)
    assert estimate.position.ellipsoidal_height_m - estimate.position.altitude_amsl_m == pytest.approx(56.0)


def test_only_accepted_and_whole_fixes_count():
    node = filter_node(method="none")
    assert not feed(
        node,
        fix(0.0, verdict=FixVerdict.NOT_LEVEL),
        fix(0.1, corrected=None),
        fix(0.2, vehicle_position=None),
        fix(0.3, covariance_ned_m2=None),
        fix(0.4, covariance_ned_m2=(0.0,) * 9),
        fix(0.5, covariance_ned_m2=(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0)),
    )
    assert node.counters() == {"fix_not_accepted": 1, "fix_incomplete": 5}


def test_time_does_not_run_backwards():
    node = filter_node(method="none")
    assert len(feed(node, fix(1.0), fix(1.0), fix(0.5), fix(1.1))) == 2
    assert node.counters()["fix_out_of_order"] == 2


def test_window_is_thrown_away_after_silence():
    node = filter_node(method="mean", window_length=3, reset_after_s=2.0)
    assert not feed(node, fix(0.0, (9, 0, 0)), fix(0.1, (9, 0, 0)))
    estimates = feed(node, *[fix(2.2 + 0.1 * i, (1, 0, 0)) for i in range(3)])
    np.testing.assert_allclose(ned_of(estimates[0]), (1.0, 0.0, 0.0), atol=1e-6)
    assert node.counters()["reset_after_silence"] == 1


def test_silence_within_the_limit_keeps_the_window():
    node = filter_node(method="mean", window_length=3, gate=OPEN)
    (estimate,) = feed(node, fix(0.0, (0, 0, 0)), fix(1.9, (0, 0, 0)), fix(3.8, (3, 0, 0)))
    assert ned_of(estimate)[0] == pytest.approx(1.0)


def test_rate_of_release_is_limited_as_in_algorithm_1():
    node = filter_node(method="mean", window_length=40, rate_hz=1.0, min_entries=10)
    estimates = feed(node, *every(0.04, [(0.0, 0.0, 0.0)] * 101))
    times_s = [(estimate.captured_at_ns - T0_NS) * 1e-9 for estimate in estimates]
    assert times_s == pytest.approx([0.36, 1.36, 2.36, 3.36])
    assert [estimate.fixes_used for estimate in estimates] == [10, 26, 26, 26]


def test_full_window_that_waits_for_its_time_keeps_the_newest_and_the_memory():
    node = filter_node(method="mean", window_length=3, rate_hz=1.0, gate=OPEN)
    first, second = feed(node, *every(0.1, [(6, 0, 0)] * 3 + [(99, 0, 0)] * 8 + [(0, 0, 0), (3, 0, 0)]))
    assert ned_of(first)[0] == pytest.approx(6.0)
    assert ned_of(second)[0] == pytest.approx((6 + 0 + 3) / 3)


def test_rate_limits_unfiltered_estimates_too():
    node = filter_node(method="none", rate_hz=5.0)
    assert len(feed(node, *every(0.05, [(0, 0, 0)] * 21))) == 6


def test_single_outlier_is_left_out():
    node = filter_node(method="mean", window_length=4)
    estimates = feed(node, *every(0.03, [(0, 0, 0)] * 4 + [(8, 0, 0)] + [(0, 0, 0)] * 3))
    np.testing.assert_allclose(ned_of(estimates[-1]), 0.0, atol=1e-6)
    assert node.counters()["fix_outlier"] == 1


def test_outlier_in_the_very_first_window_is_left_out():
    node = filter_node(method="mean", window_length=5)
    estimates = feed(node, *every(0.03, [(0, 0, 0), (8, 0, 0)] + [(0, 0, 0)] * 4))
    np.testing.assert_allclose(ned_of(estimates[0]), 0.0, atol=1e-6)


def test_fix_turned_a_quarter_is_an_outlier():
    node = filter_node(method="mean", window_length=4)
    feed(node, *every(0.03, [(0, 0, 0)] * 4), fix(0.2, azimuth_rad=0.5 + math.pi / 2))
    assert node.counters()["fix_outlier"] == 1


@given(methods)
def test_majority_that_disagrees_for_long_prevails(method):
    node = filter_node(method=method, window_length=5)
    estimates = feed(node, *every(0.03, [(0, 0, 0)] * 20 + [(5, 0, 0)] * 30))
    np.testing.assert_allclose(ned_of(estimates[-1]), (5.0, 0.0, 0.0), atol=1e-6)
    assert all(min(abs(ned_of(e)[0]), abs(ned_of(e)[0] - 5.0)) < 1e-6 for e in estimates)
    assert node.counters()["fix_outlier"] <= 12


def noisy(generator, count, sigma_m, start_s):
    return [fix(start_s + i * 0.03, tuple(generator.normal(0.0, sigma_m, 3)), sigma_m=sigma_m) for i in range(count)]


@pytest.mark.parametrize(("method", "length"), [("mean", 5), ("mean", 20), ("median", 5), ("median", 20)])
def test_covariance_of_the_estimate_fits_its_errors(method, length):
    generator = np.random.default_rng(5)
    scores = []
    for run in range(500):
        none = {"systematic_angle_deg": 0.0, "systematic_position_m": 0.0, "systematic_azimuth_deg": 0.0}
        node = filter_node(method=method, window_length=length, gate=OPEN, **none)
        estimate = feed(node, *noisy(generator, length, 0.1, run))[-1]
        error = ned_of(estimate)
        scores.append(error @ np.linalg.solve(np.reshape(estimate.covariance_ned_m2, (3, 3)), error))
    # Mean of 500 chi-square numbers of 3 degrees of freedom: 3 +- 3.29 * sqrt(6 / 500) at 99.9 %. A median of few entries is
    # a little better than the pi / 2 that holds for many.
    assert (2.64 if method == "mean" else 2.4) < np.mean(scores) < 3.36


def test_what_does_not_average_out_stays_in_the_covariance():
    node = filter_node(
        method="mean", window_length=100, systematic_angle_deg=1.0, systematic_position_m=0.05, gate=OPEN
    )
    estimate = feed(node, *every(0.01, [(0, 0, 0)] * 700, sigma_m=0.01))[-1]
    range_m = math.hypot(*VEHICLE_NED_M)
    across = np.cross(VEHICLE_NED_M, (0.0, 0.0, 1.0))
    across /= np.linalg.norm(across)
    covariance = np.reshape(estimate.covariance_ned_m2, (3, 3))
    assert across @ covariance @ across == pytest.approx((math.radians(1.0) * range_m) ** 2 + 0.05**2, rel=0.01)
    along = np.array(VEHICLE_NED_M) / range_m
    assert along @ covariance @ along == pytest.approx(0.05**2, rel=0.01)
    assert estimate.azimuth_variance_rad2 >= math.radians(1.0) ** 2


@given(st.lists(st.tuples(offsets, st.floats(-4, 4), st.floats(1e-6, 1e3)), min_size=1, max_size=30), methods)
def test_whatever_fixes_come_estimates_are_whole(values, method):
    node = filter_node(method=method, window_length=3)
    fixes = [fix(0.03 * i, ned, azimuth_rad=a, sigma_m=s) for i, (ned, a, s) in enumerate(values)]
    for estimate in feed(node, *fixes):
        PadEstimate.model_validate_json(estimate.model_dump_json())
        assert np.linalg.eigvalsh(np.reshape(estimate.covariance_ned_m2, (3, 3))).min() > 0.0


def test_window_must_be_able_to_hold_what_is_waited_for():
    with pytest.raises(ValidationError, match="exceeds window_length"):
        FilterSettings(window_length=5, min_entries=10)
