"""What a replay yields."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from schemas.journal import JournalEntry
from schemas.message import Message
from schemas.settings import Settings
from station.mcap_parts import StoredMessage
from station.replay.comparison import FieldDifference


class Origin(StrEnum):
    """Where a message that a node was given came from."""

    RECORDED = "recorded"
    SAME = "replayed, the same as recorded"
    TOLERATED = "replayed, within tolerance of the recorded one"
    DIFFERENT = "replayed, different from the recorded one"
    ADDITIONAL = "replayed, not in the recording"
    UNHEARD = "replayed, from a time when no recorder listened"
    STAND_IN = "recorded, because what caused it was not"


@dataclass(frozen=True)
class Input:
    """The newest message of one topic that a node had been given."""

    topic: str
    stamp_ns: int
    origin: Origin


@dataclass(frozen=True)
class Given:
    """What one node was given, from its start to its end."""

    started_at_ns: int
    """UTC ns."""
    entries: list[JournalEntry]
    ended_at_ns: int
    """When the recorder had the last of what it published, UTC ns."""


@dataclass(frozen=True)
class Output:
    """One message that a replayed node published."""

    service: str
    topic: str
    message: Message
    entry: JournalEntry
    """What the node was given when it published this."""
    recorded: bool
    """Whether it published one of this stamp in flight, too."""
    logged_at_ns: int
    """When the recorder had it, or, of what was not recorded, when it would have left the service, UTC ns."""
    differences: tuple[FieldDifference, ...] = ()
    inputs: tuple[Input, ...] = ()
    """What the node had been given by then, told for outputs that differ."""
    exact_input: bool = True
    """Whether the node's journal was whole, and the recording had all that it was given by then."""
    heard: bool = True
    """Whether the recorder would have had it."""

    @property
    def origin(self) -> Origin:
        """How it compares."""
        if not self.recorded:
            return Origin.ADDITIONAL if self.heard else Origin.UNHEARD
        if not self.differences:
            return Origin.SAME
        return Origin.TOLERATED if all(d.within for d in self.differences) else Origin.DIFFERENT

    @property
    def equal(self) -> bool:
        """Whether it is what was recorded, within tolerance."""
        return self.origin in (Origin.SAME, Origin.TOLERATED, Origin.UNHEARD)


@dataclass
class TopicCount:
    """How the messages of one topic compare."""

    same: int = 0
    tolerated: int = 0
    different: int = 0
    additional: int = 0
    missing: int = 0
    stand_in: int = 0
    """Recorded ones that could not be replayed, because what caused them is not in the recording."""
    uncovered: int = 0
    """From a time of which no journal tells, or when no recorder listened: not compared."""

    def add(self, origin: Origin) -> None:
        """Count one message that the replay yielded, or that stood in for one."""
        if origin is Origin.SAME:
            self.same += 1
        elif origin is Origin.TOLERATED:
            self.tolerated += 1
        elif origin is Origin.DIFFERENT:
            self.different += 1
        elif origin is Origin.ADDITIONAL:
            self.additional += 1
        elif origin is Origin.STAND_IN:
            self.stand_in += 1
        else:
            self.uncovered += 1

    @property
    def equal(self) -> bool:
        """Whether nothing is different, additional or missing."""
        return not (self.different or self.additional or self.missing)


@dataclass
class ReplayResult:
    """One replay of one flight."""

    services: tuple[str, ...]
    settings: Settings
    tolerances: str
    """Name of the tolerances that the comparison was made with."""
    assignments: tuple[str, ...] = ()
    """What was set over the flight's own settings."""
    outputs: list[Output] = field(default_factory=list)
    """In the order of replay: causes before what they cause."""
    missing: list[StoredMessage] = field(default_factory=list)
    """Recorded messages that the replayed nodes did not publish."""
    counts: dict[str, TopicCount] = field(default_factory=dict)
    """By topic, in the order of the chain."""
    given: dict[str, list[Given]] = field(default_factory=dict)
    """What each node was given in this replay, by service, one for each of its lives."""
    stand_ins: list[tuple[str, int]] = field(default_factory=list)
    """Recorded messages that took the place of replayed ones: topic and stamp in UTC ns."""
    absent: Counter[str] = field(default_factory=Counter)
    """What a node was given in flight and is not in the recording, by topic."""
    remarks: list[str] = field(default_factory=list)
    """What keeps the replay from being exact, in words."""
    took_s: float = 0.0
    """Wall time of the replay itself, without reading the file, seconds."""
    flown_s: float = 0.0
    """What the inputs span, seconds."""

    @property
    def equal(self) -> bool:
        """Whether every output is what was recorded, within tolerance, and something was compared."""
        compared = any(count.same or count.tolerated for count in self.counts.values())
        return compared and all(count.equal for count in self.counts.values())

    @property
    def first_divergence(self) -> Output | None:
        """The first output that is not what was recorded."""
        return next((output for output in self.outputs if not output.equal), None)

    def of(self, topic: str) -> Iterator[Output]:
        """The outputs of one topic."""
        return (output for output in self.outputs if output.topic == topic)


def empty_counts(published: Mapping[str, Sequence[str]]) -> dict[str, TopicCount]:
    """A count for each topic, given the topics by service."""
    return {name: TopicCount() for names in published.values() for name in names}
