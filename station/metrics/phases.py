"""The mission's phases, and the part of the flight that is the landing."""

from collections.abc import Sequence
from dataclasses import dataclass

from alight.runtime.clock import seconds
from schemas.mission import MissionStatus, Phase


@dataclass(frozen=True)
class PhaseSpan:
    """One phase from its beginning to the next one's."""

    phase: Phase
    code: str
    reason: str
    began_at_ns: int
    ended_at_ns: int

    @property
    def duration_s(self) -> float:
        """How long it lasted, seconds."""
        return seconds(self.ended_at_ns - self.began_at_ns)


@dataclass(frozen=True)
class LandingPart:
    """The landing: from the first DESCEND to the first LANDED after it, or to the end of the record."""

    began_at_ns: int
    ended_at_ns: int
    looking_since_ns: int
    """When the ACQUIRE before it began; equals `began_at_ns` where there was none."""
    landed: bool
    """Whether the commander said LANDED."""

    def holds(self, at_ns: int) -> bool:
        """Whether a time lies in the landing, UTC ns."""
        return self.began_at_ns <= at_ns <= self.ended_at_ns


def phase_spans(statuses: Sequence[MissionStatus]) -> tuple[PhaseSpan, ...]:
    """The phases in the order of time; the last one ends with the last status."""
    firsts: list[MissionStatus] = []
    for status in statuses:
        if not firsts or (status.phase, status.phase_since_ns) != (firsts[-1].phase, firsts[-1].phase_since_ns):
            firsts.append(status)
    ends = [following.phase_since_ns for following in firsts[1:]] + [status.at_ns for status in statuses[-1:]]
    return tuple(
        PhaseSpan(first.phase, first.code, first.reason, first.phase_since_ns, max(end, first.phase_since_ns))
        for first, end in zip(firsts, ends, strict=True)
    )


def landing_part(spans: Sequence[PhaseSpan]) -> LandingPart | None:
    """The landing among the phases; None if no descent began."""
    first = next((index for index, span in enumerate(spans) if span.phase is Phase.DESCEND), None)
    if first is None:
        return None
    began_at_ns = spans[first].began_at_ns
    before = spans[first - 1] if first else spans[first]
    landed = next((span for span in spans[first:] if span.phase is Phase.LANDED), None)
    return LandingPart(
        began_at_ns=began_at_ns,
        ended_at_ns=landed.began_at_ns if landed else spans[-1].ended_at_ns,
        looking_since_ns=before.began_at_ns if before.phase is Phase.ACQUIRE else began_at_ns,
        landed=landed is not None,
    )
