"""What of a recording is published, in the order in which the recorder heard it."""

import heapq
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from alight.runtime.clock import nanoseconds, seconds
from schemas import topics
from schemas.message import Message
from schemas.topics import Delivery, Topic
from station.flight_record import FlightRecord


@dataclass(frozen=True)
class Item:
    """One message of the recording."""

    at_ns: int
    """When the recorder heard it, UTC ns."""
    topic: Topic[Any]
    message: Message

    @property
    def lane(self) -> tuple[str, str]:
        """The topic and, where each service has a key of its own, the service."""
        return self.topic.name, str(getattr(self.message, "service", "")) if self.topic.per_service else ""


@dataclass(frozen=True)
class Excerpt:
    """A part of a recording, ready to be published."""

    items: tuple[Item, ...]
    """In order of `at_ns`."""
    began_ns: int
    """Where it begins, recorded time, UTC ns."""
    ended_ns: int
    """Where it ends, recorded time, UTC ns."""
    without_picture: int
    """Frames that are left out because the recording kept their headers only."""


def recorded_topics(record: FlightRecord) -> tuple[str, ...]:
    """Names of the topics that a recording has messages of."""
    return tuple(topic.name for topic in topics.TOPICS if record.logged(topic))


def excerpt(record: FlightRecord, names: Collection[str], from_s: float = 0.0, to_s: float | None = None) -> Excerpt:
    """Cut a part out of a recording.

    Who joins a live bus late is given the newest message of each state; so is whoever is fed from the middle of a flight.

    Args:
        record: The recording.
        names: Topics to take.
        from_s: Where to begin, seconds after the recording's first message.
        to_s: Where to end; None for the recording's end.

    Raises:
        ValueError: If nothing is left.
    """
    first_ns, last_ns = _span_ns(record)
    began_ns = first_ns + nanoseconds(from_s)
    ended_ns = last_ns if to_s is None else min(last_ns, first_ns + nanoseconds(to_s))
    chosen = [topic for topic in topics.TOPICS if topic.name in names]
    items = [
        item
        for item in heapq.merge(*(_items(record, topic) for topic in chosen), key=lambda item: item.at_ns)
        if item.at_ns <= ended_ns
    ]
    later = [item for item in items if item.at_ns >= began_ns]
    pictured = frozenset(record.picture_times_ns)
    kept = [item for item in later if not item.topic.has_pixels or item.message.stamp_ns in pictured]
    if not kept:
        raise ValueError(
            f"nothing to publish between {from_s:g} s and {seconds(ended_ns - first_ns):g} s; "
            f"the recording is {seconds(last_ns - first_ns):.1f} s long"
        )
    retained = _retained([item for item in items if item.at_ns < began_ns], began_ns)
    return Excerpt((*retained, *kept), began_ns, ended_ns, len(later) - len(kept))


def _span_ns(record: FlightRecord) -> tuple[int, int]:
    logs = [logged for topic in topics.TOPICS if (logged := record.logged(topic))]
    if not logs:
        raise ValueError("the recording is empty")
    return min(log[0].logged_at_ns for log in logs), max(log[-1].logged_at_ns for log in logs)


def _items(record: FlightRecord, topic: Topic[Any]) -> Iterator[Item]:
    for logged in record.logged(topic):
        yield Item(logged.logged_at_ns, topic, logged.message)


def _retained(earlier: Sequence[Item], began_ns: int) -> list[Item]:
    """The newest of each state, as if it came at `began_ns`; what would be refused as too old by then is left out."""
    newest = {item.lane: item for item in earlier if item.topic.delivery is Delivery.STATE}
    return [
        Item(began_ns, item.topic, item.message)
        for item in newest.values()
        if item.topic.max_age_s is None or began_ns - item.message.stamp_ns <= nanoseconds(item.topic.max_age_s)
    ]
