"""Did it land on the pad, and if not, what went wrong."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from schemas.mission import Phase
from station.metrics.phases import LandingPart, PhaseSpan


class Outcome(StrEnum):
    """How a flight ended."""

    LANDED_ON_PAD = "landed_on_pad"
    LANDED_BESIDE_PAD = "landed_beside_pad"
    """On the ground, but too far from the pad's centre."""
    LANDED_UNVERIFIED = "landed_unverified"
    """The commander says landed, and nothing recorded says where."""
    NO_TOUCHDOWN = "no_touchdown"
    """The commander says landed, but by the ground truth the vehicle never touched the ground."""
    NOT_LANDED = "not_landed"
    """The descent began and did not end on the ground."""
    NO_DESCENT = "no_descent"
    """The descent never began."""
    NO_MISSION = "no_mission"
    """The commander said nothing at all."""


@dataclass(frozen=True)
class Verdict:
    """The judgement on a flight."""

    outcome: Outcome
    reason: str
    """In words, with numbers."""
    error_m: float | None = None
    """Horizontal distance from the pad's centre, metres: the larger of first contact and rest."""
    by_truth: bool = False
    """Whether the ground truth says so; otherwise the vehicle's own positions and the last estimate do."""

    @property
    def ok(self) -> bool:
        """Whether it landed on the pad."""
        return self.outcome is Outcome.LANDED_ON_PAD


def judge(
    spans: Sequence[PhaseSpan], part: LandingPart | None, error_m: float | None, pad_radius_m: float, *, by_truth: bool
) -> Verdict:
    """Judge a flight.

    Args:
        spans: The mission's phases.
        part: The landing among them.
        error_m: Horizontal distance from the pad's centre on the ground, metres; None if unknown.
        pad_radius_m: What counts as on the pad, metres.
        by_truth: Whether there is a ground truth, so that an unknown error means no touchdown.
    """
    if not spans:
        return Verdict(Outcome.NO_MISSION, "the commander's mission status is not in the recording")
    last = spans[-1]
    if part is None:
        return Verdict(Outcome.NO_DESCENT, f"the descent never began: {_end(last)}", by_truth=by_truth)
    if not part.landed:
        return Verdict(Outcome.NOT_LANDED, f"the landing did not end on the ground: {_end(last)}", by_truth=by_truth)
    return _judge_place(error_m, pad_radius_m, by_truth=by_truth)


def _judge_place(error_m: float | None, pad_radius_m: float, *, by_truth: bool) -> Verdict:
    if error_m is None and by_truth:
        return Verdict(Outcome.NO_TOUCHDOWN, "reported landed, but the ground truth has no contact", by_truth=True)
    if error_m is None:
        return Verdict(Outcome.LANDED_UNVERIFIED, "reported landed; neither truth nor estimate says where")
    judged = "" if by_truth else " by its own estimate"
    if error_m > pad_radius_m:
        reason = f"landed {error_m:.2f} m from the pad's centre{judged}, more than {pad_radius_m:g} m"
        return Verdict(Outcome.LANDED_BESIDE_PAD, reason, error_m, by_truth)
    return Verdict(Outcome.LANDED_ON_PAD, f"within {pad_radius_m:g} m of the pad's centre{judged}", error_m, by_truth)


def _end(last: PhaseSpan) -> str:
    passive = last.phase in (Phase.ABORTED, Phase.YIELDED, Phase.FAILED, Phase.HOLD)
    return f"{'ended' if passive else 'still'} in {last.phase.value}, {last.code}: {last.reason}"
