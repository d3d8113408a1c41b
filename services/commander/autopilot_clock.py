"""The autopilot's time since boot, brought to UTC by MAVLink's TIMESYNC."""

import math
from collections import deque
from dataclasses import dataclass

from alight.runtime.clock import NS_PER_S, nanoseconds

WINDOW_NS = nanoseconds(2.0)
"""Replies older than this are forgotten: long enough to average, short enough to follow a drift."""
MAX_ROUND_TRIP_NS = nanoseconds(1.0)
OUTLIER_NS = nanoseconds(0.02)
OUTLIERS_TO_RESTART = 4
"""So many replies in a row that contradict the rest mean that a clock was set anew."""
REPLIES_FOR_DRIFT = 4
MAX_DRIFT = 0.2
"""A simulation that cannot keep up runs slower than real time; no real clock is nearly as wrong."""
ONE_WAY_UNCERTAINTY_S = 0.05
"""What is said of a time that was mapped without any reply: the delay of the link is unknown."""


@dataclass(frozen=True)
class _Reply:
    boot_ns: int
    offset_ns: int
    round_trip_ns: int


class AutopilotClock:
    """Maps boot time to UTC.

    Each reply gives `offset = (sent + received) / 2 - boot`, wrong by at most half its round trip. Of a window of replies those with
    short round trips are kept and a straight line is laid through them, so that a drift is followed without lag. As long as there is
    no reply, the smallest delay seen of any message bounds the offset from above.
    """

    def __init__(self) -> None:
        self.restarts = 0
        """How often a clock turned out to be set anew."""
        self.reset()

    def reset(self) -> None:
        """Forget everything: the autopilot has booted anew."""
        self._replies: deque[_Reply] = deque()
        self._outliers = 0
        self._line: tuple[int, int, float] | None = None
        self._scatter_s = 0.0
        self._arrivals: deque[tuple[int, int]] = deque()

    @property
    def synchronised(self) -> bool:
        """Whether TIMESYNC has been answered."""
        return self._line is not None

    @property
    def uncertainty_s(self) -> float:
        """Half of the shortest round trip in the window, and by how much the replies contradict their line, seconds."""
        if not self._replies:
            return ONE_WAY_UNCERTAINTY_S
        return min(reply.round_trip_ns for reply in self._replies) / 2 / NS_PER_S + self._scatter_s

    def take_reply(self, sent_ns: int, boot_ns: int, now_ns: int) -> None:
        """Take the answer to a TIMESYNC request of our own; nonsense is left out.

        Args:
            sent_ns: Our time in the request, echoed, UTC ns.
            boot_ns: The autopilot's time since boot, ns.
            now_ns: When the answer came, UTC ns.
        """
        round_trip_ns = now_ns - sent_ns
        if not 0 <= round_trip_ns <= MAX_ROUND_TRIP_NS or boot_ns <= 0:
            return
        reply = _Reply(boot_ns, (sent_ns + now_ns) // 2 - boot_ns, round_trip_ns)
        if self._contradicts(reply):
            self._outliers += 1
            if self._outliers < OUTLIERS_TO_RESTART:
                return
            self.reset()
            self.restarts += 1
        self._outliers = 0
        self._replies.append(reply)
        while self._replies[0].boot_ns < boot_ns - WINDOW_NS:
            self._replies.popleft()
        self._fit()

    def take_arrival(self, boot_ns: int, now_ns: int) -> None:
        """Note when a message that carries its boot time came; used until TIMESYNC is answered."""
        if self._line is not None:
            return
        self._arrivals.append((boot_ns, now_ns - boot_ns))
        while self._arrivals[0][0] < boot_ns - WINDOW_NS:
            self._arrivals.popleft()

    def utc_ns(self, boot_ns: int) -> int | None:
        """UTC of a boot time, ns; None before anything is known."""
        if self._line is not None:
            reference_ns, offset_ns, drift = self._line
            return boot_ns + offset_ns + round(drift * (boot_ns - reference_ns))
        if self._arrivals:
            return boot_ns + min(offset_ns for _, offset_ns in self._arrivals)
        return None

    def _contradicts(self, reply: _Reply) -> bool:
        if self._line is None:
            return False
        expected_ns = self.utc_ns(reply.boot_ns)
        assert expected_ns is not None
        return abs(reply.boot_ns + reply.offset_ns - expected_ns) > OUTLIER_NS + reply.round_trip_ns

    def _fit(self) -> None:
        shortest_ns = min(reply.round_trip_ns for reply in self._replies)
        good = [reply for reply in self._replies if reply.round_trip_ns <= 2 * shortest_ns + NS_PER_S // 2000]
        reference_ns = good[-1].boot_ns
        base_ns = good[-1].offset_ns
        x = [float(reply.boot_ns - reference_ns) for reply in good]
        y = [float(reply.offset_ns - base_ns) for reply in good]
        mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
        spread = sum((value - mean_x) ** 2 for value in x)
        drift = 0.0
        if len(good) >= REPLIES_FOR_DRIFT and spread > 0.0:
            drift = sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y, strict=True)) / spread
            drift = min(max(drift, -MAX_DRIFT), MAX_DRIFT)
        self._line = (reference_ns, base_ns + round(mean_y - drift * mean_x), drift)
        residuals = [b - mean_y - drift * (a - mean_x) for a, b in zip(x, y, strict=True)]
        self._scatter_s = math.sqrt(sum(value * value for value in residuals) / len(residuals)) / NS_PER_S
