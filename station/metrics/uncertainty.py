"""How sure a fix or an estimate was, against how wrong it was."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from alight.geometry.local import ned_between
from schemas import topics
from schemas.fix import FixVerdict
from schemas.message import GlobalPosition, Matrix3
from station.flight_record import FlightRecord
from station.metrics.phases import LandingPart
from station.metrics.smoothed_pad import smoothed_pad
from station.metrics.truth_track import TruthTrack

NINETY_FIVE = float(np.sqrt(-2.0 * np.log(0.05)))
"""95 % of honest normal errors in the plane are shorter than this many sigmas: chi-square with two degrees of freedom."""


@dataclass(frozen=True)
class Claim:
    """One horizontal error beside the sigma that was claimed for it."""

    captured_at_ns: int
    error_m: float
    sigma_m: float
    """Standard deviation along the major horizontal axis, metres."""
    normalised: float
    """Mahalanobis distance of the horizontal error: its length in sigmas of its own direction."""


@dataclass(frozen=True)
class Uncertainty:
    """Claims of a landing."""

    fixes: tuple[Claim, ...]
    estimates: tuple[Claim, ...]
    by_truth: bool
    """Whether errors are against the ground truth; otherwise against the smoothed place of the pad."""


def uncertainty(record: FlightRecord, part: LandingPart) -> Uncertainty | None:
    """Compare claims with the truth, or with the smoothed place of the pad; None where there is neither."""
    fixes = [
        (fix.captured_at_ns, np.array(fix.corrected.pad_ned_m), fix.corrected.position, fix.covariance_ned_m2)
        for fix in record.messages(topics.PAD_FIX)
        if fix.verdict is FixVerdict.ACCEPTED and fix.corrected and fix.covariance_ned_m2
    ]
    estimates = [
        (one.captured_at_ns, np.array(one.pad_ned_m), one.position, one.covariance_ned_m2)
        for one in record.messages(topics.PAD_ESTIMATE)
    ]
    truths = record.messages(topics.GROUND_TRUTH)
    smoothed = None if truths else smoothed_pad(record.messages(topics.PAD_FIX))
    if not truths and smoothed is None:
        return None
    track = TruthTrack(truths)

    def claims(measured: Sequence[tuple[int, np.ndarray, GlobalPosition, Matrix3]]) -> tuple[Claim, ...]:
        found = []
        for captured_at_ns, pad_ned_m, position, covariance in measured:
            vehicle_ned_m = track.at(captured_at_ns)
            if not part.looking_since_ns <= captured_at_ns <= part.ended_at_ns:
                continue
            if smoothed is not None:
                found.append(claim(captured_at_ns, ned_between(smoothed, position), covariance))
            elif vehicle_ned_m is not None:
                found.append(claim(captured_at_ns, pad_ned_m + vehicle_ned_m, covariance))
        return tuple(found)

    return Uncertainty(claims(fixes), claims(estimates), by_truth=bool(truths))


def claim(captured_at_ns: int, error_ned_m: np.ndarray, covariance_ned_m2: Iterable[float]) -> Claim:
    """One error (3,) in NED metres, and its covariance row by row, m^2."""
    horizontal_m2 = np.array(tuple(covariance_ned_m2)).reshape(3, 3)[:2, :2]
    error_m = np.asarray(error_ned_m, float)[:2]
    sigma_m = float(np.sqrt(max(0.0, np.linalg.eigvalsh(horizontal_m2)[-1])))
    squared = float(error_m @ np.linalg.pinv(horizontal_m2) @ error_m)
    return Claim(captured_at_ns, float(np.hypot(*error_m)), sigma_m, float(np.sqrt(max(0.0, squared))))


def share_within(claims: Sequence[Claim]) -> float | None:
    """Which share of the errors lies within what 95 % of honest ones do, 0 to 1; None of nothing."""
    return sum(one.normalised <= NINETY_FIVE for one in claims) / len(claims) if claims else None
