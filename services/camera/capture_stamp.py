"""When a live frame was captured, from what the driver says and when it was read."""

from dataclasses import dataclass

from alight.runtime.clock import NS_PER_S

_OLDEST_NS = NS_PER_S
"""A driver's stamp that is older than this, or in the future, is from another clock."""
_NS_PER_MS = 1e6


@dataclass(frozen=True)
class ReadMoment:
    """The moment at which a frame had been read, on both clocks of the host."""

    utc_ns: int
    monotonic_ns: int


def stamped(driver_ms: float, read: ReadMoment) -> tuple[int, bool]:
    """The frame's stamp.

    V4L2 stamps with the host's monotonic clock, in milliseconds as OpenCV gives it. Other sources give the time since
    the stream's start, or nothing: then the moment of reading counts.

    Args:
        driver_ms: The driver's stamp, ms; 0 for none.
        read: When the frame had been read.

    Returns:
        UTC ns, and whether it is the driver's.
    """
    age_ns = read.monotonic_ns - round(driver_ms * _NS_PER_MS) if 0.0 < driver_ms < 1e15 else -1
    if 0 <= age_ns <= _OLDEST_NS:
        return read.utc_ns - age_ns, True
    return read.utc_ns, False
