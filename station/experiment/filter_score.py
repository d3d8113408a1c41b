"""How good a filter's estimates of one flight are, against the truth, relative to the vehicle."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alight.geometry.local import ned_between
from alight.runtime.clock import NS_PER_S, nanoseconds
from schemas import topics
from schemas.estimate import PadEstimate
from schemas.fix import FixVerdict, PadFix
from schemas.fusion import FusionVerdict
from schemas.message import GlobalPosition, Matrix3
from schemas.truth import GroundTruth
from schemas.vehicle import VehicleState
from station.flight_record import FlightRecord, Logged
from station.metrics.truth_track import TruthTrack

Array = NDArray[np.float64]

USABLE_S = 0.5
"""An estimate whose light is older than this does not count as available."""
_UNJUDGED = (FusionVerdict.OUTLIER, FusionVerdict.REINITIALISED, FusionVerdict.STARTED)
"""Refused fixes, and those before there was anything to judge by."""
_GRID_NS = nanoseconds(0.05)


@dataclass(frozen=True)
class Claim:
    """One vector to the pad: how wrong it was, and how wrong it claimed it might be."""

    captured_at_ns: int
    height_m: float
    """True height of the vehicle above the pad, metres."""
    error_m: Array
    """(3,), vector from the vehicle at capture time, measured minus true, north, east, down, metres."""
    covariance_m2: Array
    """(3, 3), of it."""
    steered_error_m: Array | None
    """(3,), the same of what is steered by: from the vehicle's coordinates when the measurement was out to the pad's coordinates."""
    velocity_mps: Array
    """(3,), true velocity of the vehicle, m/s."""


@dataclass(frozen=True)
class FlightTruth:
    """What really was, from the first look at the pad to the touchdown."""

    track: TruthTrack
    velocities: TruthTrack
    touched_at_ns: int | None
    """First contact, UTC ns; None if there was none."""
    states: tuple[VehicleState, ...]
    """What the vehicle said of itself, in order."""
    states_ns: NDArray[np.int64]
    """Times of these, UTC ns."""

    @classmethod
    def of(cls, record: FlightRecord) -> "FlightTruth":
        """The truth of a recording."""
        truths = record.messages(topics.GROUND_TRUTH)
        flown = next((i for i, truth in enumerate(truths) if not truth.touching_ground), len(truths))
        touched = next((truth.at_ns for truth in truths[flown:] if truth.touching_ground), None)
        states = record.messages(topics.VEHICLE_STATE)
        times_ns = np.array([state.at_ns for state in states], np.int64)
        return cls(TruthTrack(truths), _velocities(truths), touched, states, times_ns)

    def claim(self, measured: Logged[PadEstimate] | Logged[PadFix], covariance_m2: Array) -> Claim | None:
        """A vector against the truth; None after the touchdown, and where there is no truth."""
        message = measured.message
        place = message.corrected if isinstance(message, PadFix) else message
        captured_at_ns = message.captured_at_ns
        here, velocity = self.track.at(captured_at_ns), self.velocities.at(captured_at_ns)
        if place is None or here is None or velocity is None:
            return None
        if self.touched_at_ns is not None and captured_at_ns > self.touched_at_ns:
            return None
        return Claim(
            captured_at_ns=captured_at_ns,
            height_m=-float(here[2]),
            error_m=np.asarray(place.pad_ned_m) + here,
            covariance_m2=covariance_m2,
            steered_error_m=self.steered_error_m(place.position, measured.logged_at_ns),
            velocity_mps=velocity,
        )

    def steered_error_m(self, pad: GlobalPosition, at_ns: int) -> Array | None:
        """The vector that a commander takes at a time: from where the vehicle says it is to the pad; measured minus true, (3,)."""
        index = int(np.searchsorted(self.states_ns, at_ns, side="right")) - 1
        here = self.track.at(int(self.states_ns[index])) if index >= 0 else None
        return None if here is None else np.asarray(ned_between(self.states[index].position, pad) + here)


@dataclass(frozen=True)
class FlightScore:
    """One filter over one flight."""

    claims: tuple[Claim, ...]
    """Its estimates, in order."""
    carried_m: Array | None
    """(2,), the last estimate at the moment of touchdown by the vehicle's own coordinates, measured minus true, north and east, metres: what
    a blind last metre adds."""
    drifted_m: Array | None
    """(2,), the same if its reader lets it go on by the drift that it tells."""
    available: float | None
    """Part of the time from the first accepted fix to the last one in which there was an estimate of light at most `USABLE_S` old."""
    age_s: float | None
    """Mean age of the newest estimate's light meanwhile, seconds."""


def estimate_score(
    truth: FlightTruth, estimates: Sequence[Logged[PadEstimate]], fixes: Sequence[Logged[PadFix]]
) -> FlightScore:
    """Score one filter."""
    made = [truth.claim(one, _matrix(one.message.covariance_ned_m2)) for one in estimates]
    claims = tuple(claim for claim in made if claim is not None)
    accepted = [
        fix.logged_at_ns
        for fix in fixes
        if fix.message.verdict is FixVerdict.ACCEPTED
        and (truth.touched_at_ns is None or fix.logged_at_ns <= truth.touched_at_ns)
    ]
    available, age_s = _availability(estimates, accepted)
    carried, drifted = _carried(truth, estimates, claims)
    return FlightScore(claims, carried, drifted, available, age_s)


def fix_claims(
    truth: FlightTruth, fixes: Sequence[Logged[PadFix]], verdicts: dict[int, FusionVerdict]
) -> tuple[Claim, ...]:
    """The fixes that the filter judged and did not refuse as outliers, with the covariance of the vector itself."""
    claims = []
    for logged in fixes:
        fix = logged.message
        if fix.corrected is None or fix.noise_covariance_ned_m2 is None or fix.shared is None:
            continue
        if verdicts.get(fix.captured_at_ns) in _UNJUDGED:
            continue
        vectors = np.array([value for key, value in fix.shared if key.endswith("_ned_m")])
        covariance = _matrix(fix.noise_covariance_ned_m2) + vectors.T @ vectors
        claim = truth.claim(logged, covariance)
        if claim is not None:
            claims.append(claim)
    return tuple(claims)


def lag_s(claims: Sequence[Claim]) -> float | None:
    """How late what is steered by is, seconds: least squares of its error against the vehicle's velocity.

    The pad's coordinates are those of the vehicle plus the vector. If these belong to a vehicle that has moved on for a time t
    since the light, the error is the velocity times t.
    """
    pairs = [(claim.steered_error_m, claim.velocity_mps) for claim in claims if claim.steered_error_m is not None]
    moved = sum(float(velocity @ velocity) for _, velocity in pairs)
    return sum(float(error @ velocity) for error, velocity in pairs) / moved if moved else None


def _availability(
    estimates: Sequence[Logged[PadEstimate]], accepted_ns: Sequence[int]
) -> tuple[float | None, float | None]:
    if not accepted_ns or not estimates:
        return (0.0 if accepted_ns else None), None
    released = np.array([one.logged_at_ns for one in estimates], np.int64)
    captured = np.array([one.message.captured_at_ns for one in estimates], np.int64)
    grid = np.arange(accepted_ns[0], accepted_ns[-1] + 1, _GRID_NS, dtype=np.int64)
    newest = np.searchsorted(released, grid, side="right") - 1
    ages_ns = (grid - captured[newest])[newest >= 0]
    if not len(ages_ns):
        return 0.0, None
    usable = np.count_nonzero(ages_ns <= nanoseconds(USABLE_S))
    return float(usable / len(grid)), float(np.mean(ages_ns)) / NS_PER_S


def _carried(
    truth: FlightTruth, estimates: Sequence[Logged[PadEstimate]], claims: Sequence[Claim]
) -> tuple[Array | None, Array | None]:
    if truth.touched_at_ns is None or not claims:
        return None, None
    last = next(one for one in estimates if one.message.captured_at_ns == claims[-1].captured_at_ns)
    error = truth.steered_error_m(last.message.position, truth.touched_at_ns)
    if error is None:
        return None, None
    blind_s = (truth.touched_at_ns - last.logged_at_ns) / NS_PER_S
    drift = np.zeros(3) if last.message.velocity_ned_mps is None else np.array(last.message.velocity_ned_mps)
    return error[:2], (error + drift * blind_s)[:2]


def _velocities(truths: Sequence[GroundTruth]) -> TruthTrack:
    track = TruthTrack(truths)
    track.ned_m = np.array([truth.velocity_ned_mps for truth in truths], float).reshape(-1, 3)
    return track


def _matrix(values: Matrix3) -> Array:
    return np.array(values).reshape(3, 3)
