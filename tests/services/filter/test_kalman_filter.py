"""The Kalman filter: what it knows of a pad whose coordinates wander, what it refuses, and how sure it says it is."""

import math

import numpy as np
import pytest
from fix_stream import feed, filter_node, fix, ned_of
from hypothesis import given, settings
from hypothesis import strategies as st
from kalman_stage import OFF, at_ns, called, estimates_of, matrix, seen, state, tell, verdicts_of

from schemas.fix import FixVerdict
from schemas.fusion import FusionVerdict

HOVER = (2.0, -1.0, -10.0)
RATE_S = 0.1


def kalman(**settings_of_kalman):
    return filter_node(method="kalman", kalman=settings_of_kalman)


def hovering(count, start_s=0.0, **others):
    return [seen(start_s + i * RATE_S, HOVER, **others) for i in range(count)]


def test_estimates_come_with_every_fix_once_three_agree():
    estimates = estimates_of(kalman(), hovering(10))
    assert len(estimates) == 8
    assert [estimate.fixes_used for estimate in estimates] == list(range(3, 11))
    np.testing.assert_allclose(estimates[-1].pad_ned_m, (-2.0, 1.0, 10.0), atol=1e-6)
    np.testing.assert_allclose(called(estimates[-1]), OFF, atol=1e-6)


def test_pad_is_followed_in_a_solution_that_drifts():
    """GNSS drifts, the pad does not: its coordinates must drift along, without lagging behind, and the drift be known."""
    node, drift = kalman(), np.array((0.03, -0.02, 0.01))
    fixes = [seen(i * RATE_S, HOVER, navigation_m=drift * i * RATE_S) for i in range(300)]
    last = estimates_of(node, fixes)[-1]
    np.testing.assert_allclose(called(last), drift * 299 * RATE_S, atol=0.002)
    np.testing.assert_allclose(last.pad_ned_m, np.negative(HOVER), atol=0.002)
    np.testing.assert_allclose(last.velocity_ned_mps, drift, atol=0.002)
    sigma_mps = np.sqrt(np.reshape(last.velocity_covariance_ned, (3, 3)).diagonal())
    assert (sigma_mps < 0.015).all()
    assert (np.abs(np.subtract(last.velocity_ned_mps, drift)) < 3 * sigma_mps).all()


def test_position_is_that_of_the_newest_vehicle_state_and_the_vector_that_of_the_capture():
    node, drift = kalman(), np.array((0.03, 0.0, 0.0))
    for i in range(200):
        navigation = drift * i * RATE_S
        tell(node, state(i * RATE_S + 0.08, np.add(HOVER, navigation + drift * 0.08)), 0.0)
        made, _ = tell(node, seen(i * RATE_S, HOVER, navigation_m=navigation), 0.081)
    np.testing.assert_allclose(called(made[-1]), drift * (199 * RATE_S + 0.08), atol=0.002)
    assert made[-1].position_at_ns == at_ns(199 * RATE_S + 0.08)
    np.testing.assert_allclose(made[-1].pad_ned_m, np.negative(HOVER), atol=0.002)


def test_noise_averages_out_and_what_lasts_does_not():
    """A camera that is turned by half a degree is so in every fix: 9 cm at 10 m, however many fixes there are."""
    turned = math.radians(0.5)
    noise = np.random.default_rng(1).normal(0.0, 0.05, (200, 3))
    fixes = [seen(i * RATE_S, HOVER, tilt_rad=turned, sigma_m=0.05, noise_m=noise[i]) for i in range(200)]
    last = estimates_of(kalman(attitude_time_s=1e5), fixes)[-1]
    north_m, east_m, down_m = np.sqrt(np.diag(matrix(last)))
    assert 0.95 * turned * 10.0 < min(north_m, east_m) and max(north_m, east_m) < 1.2 * turned * 10.0
    assert down_m < 0.03


def test_a_look_from_near_corrects_looks_from_afar():
    """Going down under a constant tilt error the far fixes are wrong by decimetres: at the end that must not linger."""
    tilt, node = (0.01, -0.008, 0.0), kalman(attitude_time_s=60.0)
    heights = np.linspace(20.0, 1.0, 150)
    fixes = [
        seen(i * RATE_S, (0.0, 0.0, -height), tilt_rad=0.01, tilt_error=tilt, sigma_m=0.002 * height)
        for i, height in enumerate(heights)
    ]
    last = estimates_of(node, fixes)[-1]
    assert math.hypot(*last.pad_ned_m[:2]) < 1.2 * 0.0128
    assert math.hypot(*called(estimates_of(kalman(), fixes)[5])[:2]) > 0.2


def test_errors_have_the_size_that_is_claimed():
    """NEES of descents with drift, lasting tilt and noise: the mean of 40 chi-square numbers is 3 +- 1.27 at 99.9 %."""
    random = np.random.default_rng(7)
    scores = []
    for _ in range(40):
        node = kalman(attitude_time_s=1e5, position_noise_m=0.005, wander_m=0.0, drift_time_s=1e4)
        tilt, drift = (*random.normal(0.0, 0.005, 2), 0.0), random.normal(0.0, 0.03, 3)
        for i, height in enumerate(np.linspace(12.0, 1.0, 40)):
            sigma = 0.003 * height
            quick = random.normal(0.0, 0.005, 3)
            made, _ = tell(
                node,
                seen(
                    i * RATE_S, (0.1 * height, 0.0, -height), drift * i * RATE_S + quick, tilt_rad=0.005, tilt_error=tilt,
                    sigma_m=sigma, noise_m=random.normal(0.0, sigma, 3),
                ),
            )  # fmt: skip
        error = np.subtract(made[0].pad_ned_m, (-0.1, 0.0, 1.0))
        scores.append(error @ np.linalg.solve(matrix(made[0]), error))
    assert 1.73 < np.mean(scores) < 4.27


def test_gross_outlier_is_left_out_and_the_log_says_by_how_much():
    node = kalman()
    estimates_of(node, hovering(20))
    made, (log,) = tell(node, seen(2.0, HOVER, noise_m=(3.0, 0.0, 0.0)))
    assert made == []
    attempt = log.attempts[0]
    assert attempt.verdict is FusionVerdict.OUTLIER
    assert attempt.innovation_ned_m[0] == pytest.approx(3.0, abs=0.01) and attempt.nis > 25.0
    np.testing.assert_allclose(called(estimates_of(node, hovering(1, 2.1))[0]), OFF, atol=1e-3)


def test_refused_fixes_that_agree_take_over_and_those_that_do_not_agree_never_do():
    node = kalman(recover_fixes=6)
    estimates_of(node, hovering(20))
    random = np.random.default_rng(3)
    wild = [seen(2.0 + i * RATE_S, HOVER, noise_m=random.uniform(-20.0, 20.0, 3)) for i in range(30)]
    assert set(verdicts_of(node, wild)) == {"outlier"}
    moved = hovering(8, 5.0, pad_ned_m=(4.0, 0.0, 0.0))
    assert verdicts_of(node, moved) == ["outlier"] * 5 + ["reinitialised"] + ["fused"] * 2
    np.testing.assert_allclose(
        called(estimates_of(node, hovering(1, 5.8, pad_ned_m=(4.0, 0.0, 0.0)))[0]), (4, 0, 0), atol=1e-3
    )


def test_outlier_as_the_very_first_fix_does_not_steer():
    node = kalman()
    first = seen(0.0, HOVER, noise_m=(5.0, 0.0, 0.0))
    for estimate in estimates_of(node, [first, *hovering(8, RATE_S)]):
        assert np.linalg.norm(called(estimate)) < 0.01


def test_without_fixes_it_coasts_ever_less_certain_and_then_goes_on():
    node = kalman()
    estimates_of(node, hovering(20))
    coasted = []
    for i in range(100):
        made, logs = tell(node, state(2.0 + i * RATE_S, HOVER), 0.0)
        assert made == [], "what is not seen does not steer"
        coasted += logs
    assert len(coasted) > 20 and {log.attempts[0].verdict for log in coasted} == {FusionVerdict.COASTED}
    sigmas = [math.sqrt(log.attempts[0].estimate.covariance_ned_m2[0]) for log in coasted]
    assert sigmas == sorted(sigmas) and sigmas[-1] > 3.0 * sigmas[0]
    assert coasted[-1].fix_age_s == pytest.approx(10.0, abs=0.5)
    assert verdicts_of(node, hovering(1, 12.0)) == ["fused"]


def test_late_fix_is_fused_at_its_capture_time():
    drift = np.array((0.2, 0.0, 0.0))
    fixes = [seen(i * RATE_S, HOVER, navigation_m=drift * i * RATE_S) for i in range(40)]
    in_order, out_of_order = kalman(), kalman()
    estimates_of(in_order, fixes)
    shuffled = [*fixes[:30], fixes[31], fixes[32], fixes[30], *fixes[33:]]
    assert verdicts_of(out_of_order, shuffled) == ["started", "started", *["fused"] * 38]
    after = [seen(4.0, HOVER, navigation_m=drift * 4.0)]
    (expected,), (got,) = estimates_of(in_order, after), estimates_of(out_of_order, after)
    np.testing.assert_allclose(called(got), called(expected), atol=1e-9)
    np.testing.assert_allclose(matrix(got), matrix(expected), atol=1e-12)
    assert verdicts_of(out_of_order, [fixes[30], fixes[2]]) == ["out_of_order", "out_of_order"]


def test_jump_of_the_navigation_solution_moves_the_pad_with_it():
    """PX4's estimator resets its position by 3 m: the pad has not moved, nor has the vehicle."""
    node, jump = kalman(), np.array((3.0, -1.0, 0.0))
    for i in range(40):
        off = jump if i >= 20 else np.zeros(3)
        tell(node, state(i * RATE_S, np.add(HOVER, off)), 0.0)
        made, logs = tell(node, seen(i * RATE_S, HOVER, navigation_m=off))
        assert all(log.attempts[0].verdict is not FusionVerdict.OUTLIER for log in logs)
    np.testing.assert_allclose(called(made[-1]), jump, atol=0.02)
    assert node.counters()["navigation_jumps"] == 1


def test_moving_pad_is_followed_without_lag_where_that_is_asked_for():
    """A deck at 1 m/s, with a slow turn."""

    def pad(time_s):
        return (math.sin(0.2 * time_s) / 0.2, (1.0 - math.cos(0.2 * time_s)) / 0.2, 0.0)

    fixes = [seen(i * RATE_S, np.add(pad(i * RATE_S), HOVER), pad_ned_m=pad(i * RATE_S)) for i in range(200)]
    last = estimates_of(filter_node(method="moving"), fixes)[-1]
    assert math.dist(called(last), pad(199 * RATE_S)) < 0.03
    assert math.hypot(*last.velocity_ned_mps) == pytest.approx(1.0, abs=0.05)


def test_frame_is_anchored_anew_far_from_home_without_a_step():
    fixes = [
        seen(
            i * RATE_S,
            np.add((15.0 * i * RATE_S, 0.0, 0.0), HOVER),
            pad_ned_m=(15.0 * i * RATE_S, 0.0, 0.0),
            sigma_m=0.05,
        )
        for i in range(1500)
    ]
    estimates = estimates_of(filter_node(method="moving", kalman={"pad_mps": 15.0}), fixes)
    errors = [abs(called(one)[0] - 15.0 * (one.captured_at_ns - at_ns(0.0)) * 1e-9) for one in estimates[100:]]
    # PAD's tangent plane and the chain of frames differ by the earth's curvature: 0.2 m down and 0.1 mm along at 2 km.
    assert max(errors) < 0.05


def test_azimuth_is_followed_across_the_cut():
    fixes = [fix(i * 0.1, azimuth_rad=math.pi - 0.05 + 0.01 * (i % 11)) for i in range(60)]
    for estimate in feed(filter_node(method="kalman"), *fixes):
        assert abs(math.remainder(estimate.azimuth_rad - math.pi, math.tau)) < 0.08


def test_refused_and_incomplete_fixes_are_logged_as_such():
    node = kalman()
    verdicts = verdicts_of(
        node,
        [
            fix(0.0, verdict=FixVerdict.NOT_LEVEL, raw=None, corrected=None),
            fix(0.1, corrected=None),
            fix(0.2, covariance_ned_m2=(1.0, 2.0, 0, 2.0, 1.0, 0, 0, 0, 1.0)),
            fix(0.3),
        ],
    )
    assert verdicts == ["not_accepted", "incomplete", "incomplete", "started"]


def test_shadows_are_logged_and_change_nothing():
    shadows = [{"name": "paper", "method": "mean", "window_length": 3}, {"name": "raw", "method": "none"}]
    fixes = hovering(12)
    alone, watched = kalman(), filter_node(method="kalman", shadows=shadows)
    assert estimates_of(alone, fixes) == estimates_of(watched, fixes)
    _, (log,) = tell(watched, seen(1.2, HOVER))
    assert [attempt.name for attempt in log.attempts] == ["active", "paper", "raw"]
    assert [attempt.method for attempt in log.attempts] == ["kalman", "mean", "none"]
    np.testing.assert_allclose(log.attempts[2].estimate.pad_ned_m, np.negative(HOVER), atol=1e-4)


lengths = st.floats(-50.0, 50.0)


@settings(max_examples=40)
@given(
    st.lists(
        st.tuples(st.floats(0.001, 30.0), lengths, lengths, lengths, st.floats(1e-4, 10.0)), min_size=4, max_size=30
    ),
    st.sampled_from(["kalman", "moving"]),
)
def test_whatever_comes_estimates_are_whole(steps, method):
    node, time_s = filter_node(method=method), 0.0
    for ahead_s, north, east, down, sigma in steps:
        time_s += ahead_s
        for estimate in feed(node, fix(time_s, (north, east, down), sigma_m=sigma)):
            assert np.isfinite(ned_of(estimate)).all()
            assert np.linalg.eigvalsh(matrix(estimate)).min() > 0.0


@pytest.mark.parametrize("rate_s", [1 / 30, 0.1, 0.2])
def test_solution_that_walks_fast_is_walked_along_with(rate_s):
    """A plain receiver: 14 cm in a second at random, seven times what the settings expect in a fifth of a second."""
    steps = np.random.default_rng(3).normal(0.0, 0.14 * math.sqrt(rate_s), (round(30.0 / rate_s), 3))
    walked = np.cumsum(steps * (1.0, 1.0, 0.1), axis=0)
    fixes = [seen(i * rate_s, HOVER, navigation_m=walk) for i, walk in enumerate(walked)]
    node = kalman()
    fused = [i for i, verdict in enumerate(verdicts_of(node, fixes)) if verdict == "fused"]
    assert len(fused) > 0.9 * len(fixes)
    assert max(np.diff(fused)) * rate_s < 1.0


def test_nothing_is_learnt_from_fixes_that_are_as_expected_nor_from_a_few_that_are_not():
    noise = np.random.default_rng(4).normal(0.0, 0.02, (300, 3))
    noise[5::10] += (0.6, -0.4, 0.0)
    fixes = [seen(i * RATE_S, HOVER, sigma_m=0.02, noise_m=noise[i]) for i in range(300)]
    node = kalman()
    estimates = estimates_of(node, fixes)
    assert node.counters()["fix_outlier"] == 30
    assert "walk_learnt" not in node.counters()
    assert math.sqrt(matrix(estimates[-1])[0, 0]) < 0.02
