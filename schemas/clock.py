"""What a process answers when another asks for its time."""

from schemas.message import Nanoseconds, Part, ShortText


class ClockReading(Part):
    """The answer to a question at `alight/<vehicle>/clock/<service>`; the asker knows when it asked and when the answer came."""

    service: ShortText
    """Name of the service that answers."""
    host: ShortText
    """Name of the host that it runs on."""
    received_at_ns: Nanoseconds
    """When the question came, UTC ns on that host."""
    answered_at_ns: Nanoseconds
    """When the answer left, UTC ns on that host."""
