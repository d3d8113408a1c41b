"""Which estimates may steer: what is too uncertain, too far away or somewhere else all of a sudden does not.

Where it is the vehicle's navigation solution that jumps, the pad has not moved, and its coordinates do. The estimates that speak of the
solution before the jump are named anew, those that are here and those that are still to come; what the filter makes of the jump
meets them there. To fly to the old coordinates instead would be a dash sideways, close to the ground.
"""

import math
from collections import Counter, deque
from enum import StrEnum
from typing import NamedTuple

from alight.geometry.horizontal_sigma import horizontal_sigma
from alight.geometry.local import moved_by_ned
from alight.geometry.local_frame import LocalFrame
from alight.runtime.clock import nanoseconds
from schemas.estimate import PadEstimate
from schemas.message import Vector3
from schemas.settings.commander import GateSettings
from services.commander.carried_pad import place_at_ns

JUMP_PART_OF_HEIGHT = 0.1
GAP_S = 2.5
"""Estimates farther apart than this are no uninterrupted run."""
_JUMPS_REMEMBERED = 16


class Verdict(StrEnum):
    """What the gate says of an estimate."""

    ACCEPTED = "accepted"
    OLD = "old"
    TOO_UNCERTAIN = "too_uncertain"
    TOO_FAR = "too_far"
    JUMP = "jump"


class _Jump(NamedTuple):
    """One of the navigation solution."""

    before_ns: int
    after_ns: int
    ned_m: Vector3


class EstimateGate:
    """Keeps the newest estimate that may steer."""

    def __init__(self, settings: GateSettings) -> None:
        self._settings = settings
        self.counts: Counter[str] = Counter()
        """Estimates by verdict."""
        self.newest: PadEstimate | None = None
        self._run_since_ns = 0
        self._elsewhere: PadEstimate | None = None
        self._elsewhere_since_ns = 0
        self._jumps: deque[_Jump] = deque(maxlen=_JUMPS_REMEMBERED)

    def forget(self) -> None:
        """Begin anew, for a new landing."""
        self.newest = self._elsewhere = None

    def displace(self, jump_ned_m: Vector3, before_ns: int, after_ns: int) -> None:
        """The navigation solution has jumped.

        Args:
            jump_ned_m: North, east, down, metres.
            before_ns: The last moment that is known to be before it, UTC ns.
            after_ns: The first that is known to be after it.
        """
        self.counts["navigation_jumps"] += 1
        jump = _Jump(before_ns, after_ns, jump_ned_m)
        self._jumps.append(jump)
        if self.newest is not None:
            self.newest = _named_anew(self.newest, jump)
        if self._elsewhere is not None:
            self._elsewhere = _named_anew(self._elsewhere, jump)

    def offer(self, estimate: PadEstimate, vehicle: LocalFrame | None) -> Verdict:
        """Judge an estimate; keep it if it may steer.

        Args:
            estimate: The newest.
            vehicle: The frame where the vehicle is; None if that is not known.
        """
        torn = any(jump.before_ns < estimate.captured_at_ns < jump.after_ns for jump in self._jumps)
        for jump in self._jumps:
            estimate = _named_anew(estimate, jump)
        # A picture of the moment of a jump goes by a pose that is neither before it nor after it.
        verdict = Verdict.JUMP if torn else self._judge(estimate, vehicle)
        self.counts[f"estimates_{verdict}"] += 1
        if verdict is Verdict.ACCEPTED:
            gap_ns = 0 if self.newest is None else estimate.captured_at_ns - self.newest.captured_at_ns
            if self.newest is None or gap_ns > nanoseconds(GAP_S):
                self._run_since_ns = estimate.captured_at_ns
            self.newest, self._elsewhere = estimate, None
        return verdict

    def good_for_ns(self) -> int:
        """Length of the present run of estimates, from the capture of its first to that of its newest, ns."""
        return 0 if self.newest is None else self.newest.captured_at_ns - self._run_since_ns

    def _judge(self, estimate: PadEstimate, vehicle: LocalFrame | None) -> Verdict:
        if self.newest is not None and estimate.captured_at_ns <= self.newest.captured_at_ns:
            return Verdict.OLD
        nn, ne, _, _, ee, *_ = estimate.covariance_ned_m2
        sigma_m = horizontal_sigma(nn, ne, ee)
        if not sigma_m <= self._settings.max_sigma_m:
            return Verdict.TOO_UNCERTAIN
        if vehicle is None:
            return Verdict.TOO_FAR
        north, east, down = vehicle.ned_of(estimate.position)
        if math.sqrt(north**2 + east**2 + down**2) > self._settings.max_distance_m:
            return Verdict.TOO_FAR
        allowed_m = max(self._settings.max_jump_m, JUMP_PART_OF_HEIGHT * down)

        def is_near(other: PadEstimate) -> bool:
            return math.dist(vehicle.ned_of(other.position), (north, east, down)) <= allowed_m

        if self.newest is None or is_near(self.newest):
            return Verdict.ACCEPTED
        return self._judge_jump(estimate, gone_on=self._elsewhere is not None and is_near(self._elsewhere))

    def _judge_jump(self, estimate: PadEstimate, *, gone_on: bool) -> Verdict:
        """A jump is believed once the estimates at the new place have agreed for long enough; `gone_on`: so does this one."""
        if not gone_on:
            self._elsewhere_since_ns = estimate.captured_at_ns
        self._elsewhere = estimate
        agreed_ns = estimate.captured_at_ns - self._elsewhere_since_ns
        return Verdict.ACCEPTED if agreed_ns >= nanoseconds(self._settings.jump_believed_after_s) else Verdict.JUMP


def _named_anew(estimate: PadEstimate, jump: _Jump) -> PadEstimate:
    """The same place in the solution after a jump, if the estimate speaks of the time before."""
    if place_at_ns(estimate) >= jump.after_ns:
        return estimate
    return estimate.model_copy(update={"position": moved_by_ned(estimate.position, jump.ned_m)})
