"""What the node hands to the file: one message, or one picture that is still to be made."""

from dataclasses import dataclass

from alight.runtime.node import Pixels
from schemas.frame import FrameHeader


@dataclass(frozen=True, slots=True)
class Picture:
    """A frame before it is made into what viewers show."""

    header: FrameHeader
    pixels: Pixels


@dataclass(frozen=True, slots=True)
class Entry:
    """One record of the file to be."""

    channel: str
    """Name of the channel below `alight/<vehicle>/`, such as `health/filter`."""
    data: bytes | Picture
    """The message's JSON text, or a picture."""
    sequence: int
    """Counts what the recorder was given on this channel since its start: a gap is a loss here."""
    received_at_ns: int
    """When it reached the process, UTC ns."""
    logged_at_ns: int
    """When the recorder took it up, UTC ns."""
    stamp_ns: int
    """The time it speaks of, UTC ns."""

    @property
    def weight_bytes(self) -> int:
        """What it takes in memory, about."""
        return len(self.data) if isinstance(self.data, bytes) else self.data.pixels.nbytes
