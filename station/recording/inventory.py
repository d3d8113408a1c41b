"""What is in a recording, topic by topic: how much, how often, with which gaps."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field

from alight.runtime.clock import seconds
from schemas import topics
from services.recorder import layout
from station.mcap_parts import PartsReader, StoredMessage

_OWN_NUMBER = {topics.FRAME.name: "sequence", topics.JOURNAL.name: "number"}
"""Topics whose messages are numbered by their publisher, and the field with the number."""


@dataclass
class Channel:
    """One topic, or one service's part of it."""

    name: str
    messages: int = 0
    first_ns: int = 0
    """When its first message reached the recorder, UTC ns."""
    last_ns: int = 0
    """When its last one did, UTC ns."""
    longest_gap_ns: int = 0
    """Longest time without a message between these."""
    not_written: int = 0
    """Reached the recorder and are not in the file."""
    not_received: int | None = None
    """Were published and never reached the recorder; None for topics whose messages carry no number."""
    _number: int | None = None
    _own_number: int | None = None

    @property
    def rate_hz(self) -> float:
        """Messages a second between the first and the last."""
        duration_s = seconds(self.last_ns - self.first_ns)
        return (self.messages - 1) / duration_s if duration_s > 0.0 else 0.0

    def take(self, stored: StoredMessage) -> None:
        """Count one message."""
        if self.messages == 0:
            self.first_ns = stored.logged_at_ns
        else:
            self.longest_gap_ns = max(self.longest_gap_ns, stored.logged_at_ns - self.last_ns)
        self.messages += 1
        self.last_ns = stored.logged_at_ns
        missed = _missed(self._number, stored.number)
        self.not_written += missed
        self._number = stored.number
        field_name = _OWN_NUMBER.get(stored.topic.name)
        if field_name is not None:
            own = int(json.loads(stored.data)[field_name])
            self.not_received = (self.not_received or 0) + max(0, _missed(self._own_number, own) - missed)
            self._own_number = own


@dataclass
class Inventory:
    """All of it."""

    channels: dict[str, Channel] = field(default_factory=dict)
    """By name below `alight/<vehicle>/`, in alphabetical order."""
    pictures: int = 0
    """Frames whose picture is kept."""
    begin_ns: int = 0
    """When the first message reached the recorder, UTC ns."""
    end_ns: int = 0
    """When the last one did, UTC ns."""

    @property
    def messages(self) -> int:
        """All messages, without the pictures."""
        return sum(channel.messages for channel in self.channels.values())


def take_inventory(reader: PartsReader) -> Inventory:
    """Go through a recording."""
    found: dict[str, Channel] = {}
    for stored in reader.stored():
        name = stored.key.split("/", 2)[-1]
        found.setdefault(name, Channel(name)).take(stored)
    begins = [channel.first_ns for channel in found.values()]
    ends = [channel.last_ns for channel in found.values()]
    return Inventory(dict(sorted(found.items())), len(reader.pictures), min(begins, default=0), max(ends, default=0))


def gaps(inventory: Inventory) -> Iterator[str]:
    """What the numbers of the messages say is missing, in words."""
    for channel in inventory.channels.values():
        if channel.not_written:
            yield f"{channel.not_written} messages of {channel.name} reached the recorder and are not in the file"
        if channel.not_received:
            yield f"{channel.not_received} messages of {channel.name} were published and never reached the recorder"


def _missed(before: int | None, number: int) -> int:
    """How many numbers are left out; a number that goes back is a new start."""
    return max(0, number - before - 1) if before is not None else 0


def picture_name() -> str:
    """Where pictures are listed."""
    return f"{topics.FRAME.name}/{layout.IMAGE}"
