"""When an OFFBOARD setpoint is due, and how long the pauses between them have been."""

from collections import deque

from alight.runtime.clock import nanoseconds, seconds

REMEMBERED_NS = nanoseconds(5.0)
"""A pause shows its effect when the autopilot's mode is heard, up to two seconds later."""


class SetpointStream:
    """Counts from `begin` on."""

    def __init__(self, period_s: float) -> None:
        self._period_ns = nanoseconds(period_s)
        self._last_ns: int | None = None
        self._pauses: deque[tuple[int, float]] = deque()
        """When each ended, and how long it was: those that none since was as long as, so that the first is the longest."""

    def begin(self) -> None:
        """A new stream: the pause before it does not count."""
        self._last_ns = None
        self._pauses.clear()

    def is_due(self, now_ns: int) -> bool:
        """Whether the next one has to go out now."""
        return self._last_ns is None or not 0 <= now_ns - self._last_ns < self._period_ns

    def sent(self, now_ns: int) -> None:
        """Note that one goes out."""
        if self._last_ns is not None:
            pause_s = seconds(now_ns - self._last_ns)
            while self._pauses and self._pauses[-1][1] <= pause_s:
                self._pauses.pop()
            self._pauses.append((now_ns, pause_s))
        self._last_ns = now_ns
        while self._pauses and self._pauses[0][0] < now_ns - REMEMBERED_NS:
            self._pauses.popleft()

    def longest_pause_s(self, now_ns: int) -> float:
        """The longest pause of late, the present one included, seconds."""
        present_s = 0.0 if self._last_ns is None else seconds(now_ns - self._last_ns)
        return max(present_s, self._pauses[0][1]) if self._pauses else present_s
