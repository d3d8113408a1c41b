"""Claimed uncertainty against error, with and without truth, and the services' health over time."""

import numpy as np
import pytest
from synthetic_flight import NAVIGATION_ERROR_NED_M, PAD, Flight

from alight.geometry.local import moved_by_ned, ned_between
from schemas import topics
from schemas.health import Health, InputHealth, OutputHealth
from station.metrics.health_history import health_history
from station.metrics.incidents import incidents
from station.metrics.smoothed_pad import FEWEST_FIXES, smoothed_pad
from station.metrics.summary import summarise
from station.metrics.uncertainty import NINETY_FIVE, claim, share_within, uncertainty


def test_an_error_in_sigmas_of_its_own_direction():
    covariance = (4.0, 0, 0, 0, 1.0, 0, 0, 0, 9.0)
    north, east = (claim(0, np.array(error), covariance) for error in ((2.0, 0, 5), (0, 2.0, 5)))
    assert (north.error_m, north.sigma_m, north.normalised) == pytest.approx((2.0, 2.0, 1.0))
    assert (east.error_m, east.sigma_m, east.normalised) == pytest.approx((2.0, 2.0, 2.0))


def test_honest_claims_lie_within_in_95_of_100():
    noise = np.random.default_rng(5)
    covariance = np.array([[0.04, 0.01, 0], [0.01, 0.02, 0], [0, 0, 1.0]])
    errors_m = noise.multivariate_normal(np.zeros(3), covariance, 4000)
    share = share_within([claim(0, error_m, covariance.ravel()) for error_m in errors_m])
    assert share == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / 4000))
    assert pytest.approx(2.4477, abs=1e-4) == NINETY_FIVE
    assert share_within([]) is None


def test_the_smoothed_pad_is_the_weighted_agreement_and_bears_outliers():
    fixes = [fix for fix in Flight().record().messages(topics.PAD_FIX) if fix.corrected]
    honest = ned_between(PAD, smoothed_pad(fixes))
    np.testing.assert_allclose(honest, NAVIGATION_ERROR_NED_M, atol=0.01)

    def moved(fix):
        place = fix.corrected.model_copy(update={"position": moved_by_ned(fix.corrected.position, (20.0, 0.0, 0.0))})
        return fix.model_copy(update={"corrected": place})

    spoilt = [moved(fix) if number % 20 == 0 else fix for number, fix in enumerate(fixes)]
    assert np.linalg.norm(ned_between(PAD, smoothed_pad(spoilt)) - honest) < 0.02
    assert smoothed_pad(fixes[: FEWEST_FIXES - 1]) is None


def test_without_truth_errors_are_against_the_smoothed_place():
    for with_truth in (True, False):
        record = Flight(with_truth=with_truth).record()
        claims = uncertainty(record, summarise(record).landing)
        assert claims.by_truth is with_truth
        assert len(claims.estimates) > 50
        late = [one.error_m for one in claims.fixes[-30:]]
        assert max(late) < 0.05


def test_no_comparison_where_there_is_nothing_to_compare_with():
    record = Flight(with_truth=False).record()
    part = summarise(record).landing
    empty = type(record)((topic.name, logged) for topic in (topics.MISSION_STATUS,) for logged in record.logged(topic))
    assert uncertainty(empty, part) is None


def report(at_s: int, uptime_s: float, dropped: int, refused: dict[str, int], pid: int = 1) -> Health:
    entry = InputHealth(topic="camera/frame", received=9, rate_hz=9, dropped=dropped, refused=refused, stale=at_s == 3)
    return Health(
        at_ns=at_s * 10**9, service="detector", pid=pid, uptime_s=uptime_s, inputs=(entry,),
        outputs=(OutputHealth(topic="detector/detection", published=9, rate_hz=8.0 + at_s),),
        handling_p99_ms=2.0 if at_s > 1 else None, counters={}, complaints=(),
    )  # fmt: skip


def test_counters_since_start_become_losses_a_report_even_through_a_restart():
    reports = [
        report(1, 1.0, 2, {}), report(2, 2.0, 5, {"not_finite": 1}), report(3, 0.5, 1, {"not_finite": 1}, pid=2),
    ]  # fmt: skip
    (history,) = health_history(reports, incidents(reports))
    np.testing.assert_array_equal(history.lost, [2, 4, 1])
    np.testing.assert_array_equal(history.stale, [0, 0, 1])
    np.testing.assert_array_equal(history.output_hz, [9.0, 10.0, 11.0])
    np.testing.assert_array_equal(np.isnan(history.handling_p99_ms), [True, False, False])
    assert history.restarts_at_ns == (3 * 10**9,)
    assert (history.dropped, history.refused) == (6, {"not_finite": 1})
