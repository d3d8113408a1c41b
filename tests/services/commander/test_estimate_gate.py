"""What may steer."""

import pytest

from alight.geometry.local import moved_by_ned
from alight.geometry.local_frame import LocalFrame
from schemas.estimate import PadEstimate
from schemas.message import GlobalPosition
from schemas.settings.commander import GateSettings
from services.commander.estimate_gate import EstimateGate, Verdict

START = 1_767_225_600_000_000_000
HERE = GlobalPosition(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=500.0, ellipsoidal_height_m=547.0)
VEHICLE = LocalFrame(HERE)


def estimate(
    at_s: float, ned_m: tuple[float, float, float] = (1.0, 2.0, 8.0), variance_m2: float = 0.01
) -> PadEstimate:
    v = variance_m2
    return PadEstimate(
        captured_at_ns=START + round(at_s * 1e9),
        position=moved_by_ned(HERE, ned_m),
        pad_ned_m=ned_m,
        azimuth_rad=0.0,
        covariance_ned_m2=(v, 0, 0, 0, v, 0, 0, 0, v),
        azimuth_variance_rad2=0.01,
        method="known",
        fixes_used=1,
    )


@pytest.fixture
def gate() -> EstimateGate:
    return EstimateGate(GateSettings())


def test_a_good_run_counts_from_its_first_estimate(gate: EstimateGate) -> None:
    assert [gate.offer(estimate(t / 10), VEHICLE) for t in range(6)] == [Verdict.ACCEPTED] * 6
    assert gate.good_for_ns() == 500_000_000


def test_a_gap_begins_a_new_run(gate: EstimateGate) -> None:
    for at_s in (0.0, 0.5, 4.0, 4.2):
        gate.offer(estimate(at_s), VEHICLE)
    assert gate.good_for_ns() == 200_000_000


@pytest.mark.parametrize(
    ("bad", "verdict"),
    [
        (estimate(0.0), Verdict.OLD),
        (estimate(1.0, variance_m2=1.1), Verdict.TOO_UNCERTAIN),
        (estimate(1.0, variance_m2=-0.1), Verdict.TOO_UNCERTAIN),
        (estimate(1.0, ned_m=(90.0, 90.0, 8.0)), Verdict.TOO_FAR),
        (estimate(1.0, ned_m=(2.5, 2.0, 8.0)), Verdict.JUMP),
        (estimate(1.0, ned_m=(1.0, 2.0, 6.5)), Verdict.JUMP),
    ],
)
def test_what_is_held_back(gate: EstimateGate, bad: PadEstimate, verdict: Verdict) -> None:
    good = estimate(0.5)
    gate.offer(good, VEHICLE)
    assert gate.offer(bad, VEHICLE) is verdict
    assert gate.newest is good


def test_a_single_outlier_among_good_ones_is_never_followed(gate: EstimateGate) -> None:
    for i in range(60):
        gate.offer(estimate(i / 10, (5.0, 2.0, 8.0) if i % 3 == 2 else (1.0, 2.0, 8.0)), VEHICLE)
    assert gate.counts["estimates_jump"] == 20
    assert gate.newest is not None
    assert gate.newest.pad_ned_m == (1.0, 2.0, 8.0)


def test_a_jump_is_believed_when_it_stays(gate: EstimateGate) -> None:
    gate.offer(estimate(0.0), VEHICLE)
    verdicts = [gate.offer(estimate(0.1 + i / 10, (5.0, 2.0, 8.0)), VEHICLE) for i in range(17)]
    assert verdicts == [Verdict.JUMP] * 15 + [Verdict.ACCEPTED] * 2


def test_outliers_that_disagree_with_each_other_are_never_believed(gate: EstimateGate) -> None:
    gate.offer(estimate(0.0), VEHICLE)
    for i in range(60):
        side = 8.0 if i % 2 else -8.0
        assert gate.offer(estimate(0.1 + i / 10, (side, 2.0, 8.0)), VEHICLE) is Verdict.JUMP


@pytest.mark.parametrize("captured_at_s", [0.2, 0.4])
def test_estimates_are_named_in_the_solution_that_jumped_once_whenever_they_come(
    gate: EstimateGate, captured_at_s: float
) -> None:
    """The vehicle hangs where it hung, 2 m farther south in the new coordinates; so does the pad."""
    gate.offer(estimate(0.1), VEHICLE)
    gate.displace((-2.0, 0.0, 0.0), START + 280_000_000, START + 300_000_000)
    after = LocalFrame(moved_by_ned(HERE, (-2.0, 0.0, 0.0)))
    assert gate.newest is not None
    assert after.ned_of(gate.newest.position) == pytest.approx((1.0, 2.0, 8.0), abs=1e-3)
    known = (1.0, 2.0, 8.0) if captured_at_s < 0.3 else (-1.0, 2.0, 8.0)
    assert gate.offer(estimate(captured_at_s, known), after) is Verdict.ACCEPTED
    assert after.ned_of(gate.newest.position) == pytest.approx((1.0, 2.0, 8.0), abs=1e-3)
    assert gate.counts["navigation_jumps"] == 1


def test_an_estimate_of_the_moment_of_a_jump_is_left_out(gate: EstimateGate) -> None:
    """It goes by a pose between the last one before the jump and the first one after it."""
    gate.offer(estimate(0.1), VEHICLE)
    gate.displace((-2.0, 0.0, 0.0), START + 280_000_000, START + 300_000_000)
    kept = gate.newest
    after = LocalFrame(moved_by_ned(HERE, (-2.0, 0.0, 0.0)))
    assert gate.offer(estimate(0.29, (0.0, 2.0, 8.0)), after) is Verdict.JUMP
    assert gate.newest is kept
