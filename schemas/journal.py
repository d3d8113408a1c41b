"""What a node was given, in the order in which it was given: with it a replay repeats a flight to the last bit."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from schemas.message import Nanoseconds, Part, ShortText, Stamped


class EntryKind(StrEnum):
    """What was given."""

    MESSAGE = "message"
    """A message that was admitted."""
    TICK = "tick"
    """The time alone."""
    BYTES = "bytes"
    """Bytes that came through a port."""


class JournalEntry(Part):
    """One thing that the node was given."""

    kind: EntryKind
    """What it was."""
    source: ShortText = ""
    """The topic's name in the table of topics, or the port's name; empty for a tick."""
    stamp_ns: Nanoseconds = 0
    """The time the message speaks of: which message of the topic it was, UTC ns; 0 for what is none."""
    received_at_ns: Nanoseconds
    """When it reached the process, UTC ns."""
    now_ns: Nanoseconds
    """The time that the node was told, UTC ns."""
    data: Annotated[str, Field(max_length=100_000)] = ""
    """The bytes, base64; empty for what has none."""


class Journal(Stamped):
    """All that one node was given since its last journal; `at_ns` is the time of writing."""

    service: ShortText
    """Name of the service."""
    started_at_ns: Nanoseconds
    """When the node began, UTC ns: another value means that it was started again and has forgotten everything."""
    number: Annotated[int, Field(ge=0)]
    """Counts the journals since the start: a gap means that one is missing."""
    entries: Annotated[tuple[JournalEntry, ...], Field(max_length=20_000)]
    """What it was given, first to last."""
