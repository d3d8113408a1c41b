"""What an import puts into a recording."""

from dataclasses import dataclass
from typing import Any

from alight.runtime.node import Pixels
from schemas.message import Message
from schemas.topics import Topic


@dataclass(frozen=True)
class Heard:
    """One message, and when it would have reached the recorder."""

    at_ns: int
    """Arrival, UTC ns."""
    topic: Topic[Any]
    message: Message
    pixels: Pixels | None = None
    """The picture beside a frame's header."""
