"""What the parts of a recording say about themselves: how each began and ended, and what is missing."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from alight.runtime.clock import seconds
from services.recorder import layout

ROTATED = "rotated"
DISK_FAILED = "disk failed"
"""Reasons of an ending, as the recorder writes them."""


@dataclass
class PartStory:
    """One file of a recording."""

    path: Path
    number: int
    """1 for `flight.mcap`, 2 for `flight_2.mcap` ..."""
    beginning: Mapping[str, str] = field(default_factory=dict)
    """See `layout.BEGINNING`; empty in recordings of before."""
    ending: Mapping[str, str] | None = None
    """See `layout.ENDING`; None if the part was cut short, or is of before."""
    repair: Mapping[str, str] | None = None
    """See `layout.REPAIR`; None if it was not mended."""
    hosts: list[Mapping[str, str]] = field(default_factory=list)
    """Name and clocks of the recorder's machine, when the part began and when it ended."""
    first_ns: int | None = None
    """Earliest time of recording, UTC ns; None if there is no message."""
    last_ns: int | None = None
    """Latest time of recording, UTC ns."""
    defects: list[str] = field(default_factory=list)
    """What was found wrong with the file itself."""

    def note_chunk(self, first_ns: int, last_ns: int) -> None:
        """A chunk covers this time."""
        self.first_ns = first_ns if self.first_ns is None else min(self.first_ns, first_ns)
        self.last_ns = last_ns if self.last_ns is None else max(self.last_ns, last_ns)

    def note_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """The file has this metadata record."""
        if name == layout.BEGINNING:
            self.beginning = values
        elif name == layout.ENDING:
            self.ending = values
        elif name == layout.REPAIR:
            self.repair = values
        elif name == layout.HOST:
            self.hosts.append(values)


def missing(parts: Sequence[PartStory]) -> Iterator[str]:
    """What the parts of one recording lack, in words."""
    before: PartStory | None = None
    for part in parts:
        for number in range(1 if before is None else before.number + 1, part.number):
            yield f"part {number} of the recording is missing"
        yield from _before(before, part)
        yield from part.defects
        yield from _within(part)
        before = part


def _before(before: PartStory | None, part: PartStory) -> Iterator[str]:
    lost = int(part.beginning.get("lost_before", "0"))
    if lost:
        yield f"{lost} messages and pictures were lost before {part.path.name} began"
    rotated = part.beginning.get("reason") == ROTATED
    if before is None or before.last_ns is None or part.first_ns is None or rotated:
        return
    pause_s = seconds(part.first_ns - before.last_ns)
    if pause_s > 0.0:
        yield f"nothing was recorded for {pause_s:.2f} s between {before.path.name} and {part.path.name}"


def _within(part: PartStory) -> Iterator[str]:
    ending = part.ending or {}
    if ending.get("reason") == DISK_FAILED:
        yield f"{part.path.name} ends before its time: {ending.get('detail')}"
    lost = int(ending.get("lost", "0"))
    if lost:
        yield f"{lost} messages and pictures were lost while {part.path.name} was written"
    if part.repair is not None:
        yield f"{part.path.name} was mended: {part.repair.get('lost', '')}"
