"""Where the time comes from: the wall, or the lockstep executor."""

import time
from typing import Protocol

NS_PER_S = 1_000_000_000

LOCKSTEP_EPOCH_NS = 1_767_225_600 * NS_PER_S
"""Where virtual time begins: 2026-01-01 00:00:00 UTC. Fixed, so that recordings repeat to the byte."""


class Clock(Protocol):
    """Tells the time."""

    def now_ns(self) -> int:
        """The time, UTC ns."""
        ...


class WallClock:
    """The host's clock. Separate hosts need NTP or PTP between them."""

    def now_ns(self) -> int:
        """The time, UTC ns."""
        return time.time_ns()


class MonotonicClock:
    """The host's clock that nobody sets: for how long something has lasted, never for when."""

    def now_ns(self) -> int:
        """The time since some moment, ns."""
        return time.monotonic_ns()


class VirtualClock:
    """A clock that only moves when told."""

    def __init__(self, start_ns: int = LOCKSTEP_EPOCH_NS) -> None:
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """The time, UTC ns."""
        return self._now_ns

    def advance_to(self, now_ns: int) -> None:
        """Move forward.

        Raises:
            ValueError: If that would be backwards.
        """
        if now_ns < self._now_ns:
            raise ValueError(f"virtual time cannot run backwards: {now_ns} < {self._now_ns}")
        self._now_ns = now_ns


def seconds(duration_ns: int) -> float:
    """Nanoseconds as seconds."""
    return duration_ns / NS_PER_S


def nanoseconds(duration_s: float) -> int:
    """Seconds as nanoseconds, rounded."""
    return round(duration_s * NS_PER_S)
