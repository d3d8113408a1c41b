"""The autopilot's time since boot, brought to UTC by MAVLink's TIMESYNC."""

import math
from collections import deque
from dataclasses import dataclass

from alight.runtime.clock import NS_PER_S, nanoseconds, seconds
from schemas.health import ClockHealth
from services.commander.clock_drift import ClockDrift

WINDOW_NS = nanoseconds(2.0)
"""Replies older than this are forgotten: long enough to average, short enough to follow a drift."""
MAX_ROUND_TRIP_NS = nanoseconds(1.0)
OUTLIER_NS = nanoseconds(0.02)
OUTLIERS_TO_RESTART = 4
"""So many replies in a row that contradict the rest mean that a clock was set anew."""
REPLIES_FOR_DRIFT = 4
MAX_DRIFT = 0.2
"""A simulation that cannot keep up runs slower than real time; no real clock is nearly as wrong."""
MAX_SILENCE_NS = nanoseconds(5.0)
"""TIMESYNC that is answered no more is complained of: a time carried on by the last drift is a guess."""
MAX_UNCERTAINTY_S = 0.02
"""From here on it is complained of: at 3 m/s it is 6 cm."""
MAX_DRIFT_PPM = 1e4
"""From here on it is complained of; a crystal is off by 100 at most."""
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
        self.replies = 0
        """Replies used."""
        self.outliers = 0
        """Replies left out: impossible ones, and those that contradict all others."""
        self.reset()

    def reset(self) -> None:
        """Forget everything: the autopilot has booted anew."""
        self._replies: deque[_Reply] = deque()
        self._outliers_in_a_row = 0
        self._drift = ClockDrift()
        self._came_ns: int | None = None
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
        shortest_ns = self._shortest_round_trip_ns
        if shortest_ns is None:
            return ONE_WAY_UNCERTAINTY_S
        return shortest_ns / 2 / NS_PER_S + self._scatter_s

    @property
    def _shortest_round_trip_ns(self) -> int | None:
        """Of the replies in the window; None before the first."""
        return min((reply.round_trip_ns for reply in self._replies), default=None)

    def take_reply(self, sent_ns: int, boot_ns: int, now_ns: int) -> None:
        """Take the answer to a TIMESYNC request of our own; nonsense is left out.

        Args:
            sent_ns: Our time in the request, echoed, UTC ns.
            boot_ns: The autopilot's time since boot, ns.
            now_ns: When the answer came, UTC ns.
        """
        round_trip_ns = now_ns - sent_ns
        if not 0 <= round_trip_ns <= MAX_ROUND_TRIP_NS or boot_ns <= 0:
            self.outliers += 1
            return
        reply = _Reply(boot_ns, (sent_ns + now_ns) // 2 - boot_ns, round_trip_ns)
        if self._contradicts(reply):
            self.outliers += 1
            self._outliers_in_a_row += 1
            if self._outliers_in_a_row < OUTLIERS_TO_RESTART:
                return
            self.reset()
            self.restarts += 1
        self._outliers_in_a_row = 0
        self.replies += 1
        self._came_ns = now_ns
        self._drift.take(boot_ns, reply.offset_ns, round_trip_ns)
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

    def boot_ns(self, utc_ns: int) -> int | None:
        """The boot time at a time, UTC ns: the inverse of `utc_ns`; None before anything is known."""
        if self._line is not None:
            reference_ns, offset_ns, drift = self._line
            return reference_ns + round((utc_ns - offset_ns - reference_ns) / (1.0 + drift))
        if self._arrivals:
            return utc_ns - min(offset_ns for _, offset_ns in self._arrivals)
        return None

    def health(self, now_ns: int) -> ClockHealth:
        """How well the autopilot's clock is known at `now_ns`, UTC ns."""
        shortest_ns = self._shortest_round_trip_ns
        if self._came_ns is None or shortest_ns is None:
            return ClockHealth(of="autopilot", uncertainty_s=self.uncertainty_s, outliers=self.outliers)
        return ClockHealth(
            of="autopilot",
            round_trip_s=seconds(shortest_ns),
            uncertainty_s=self.uncertainty_s,
            jitter_s=self._scatter_s,
            drift_ppm=self._drift.ppm,
            answers=self.replies,
            outliers=self.outliers,
            age_s=seconds(max(0, now_ns - self._came_ns)),
        )

    def complaints(self, now_ns: int) -> tuple[str, ...]:
        """What is wrong with it, in words."""
        if self._came_ns is None:
            return ("TIMESYNC is not answered: stamps are uncertain by 50 ms",)
        found = []
        if now_ns - self._came_ns > MAX_SILENCE_NS:
            found.append(f"TIMESYNC has not been answered for {seconds(now_ns - self._came_ns):.0f} s")
        if self.uncertainty_s > MAX_UNCERTAINTY_S:
            found.append(f"the autopilot's time is uncertain by {1e3 * self.uncertainty_s:.0f} ms: the link is slow")
        if self._drift.ppm is not None and abs(self._drift.ppm) > MAX_DRIFT_PPM:
            way = "fast" if self._drift.ppm > 0.0 else "slow"
            found.append(f"the autopilot's clock runs {abs(self._drift.ppm) / 1e4:.1f} % {way}: a slow simulation?")
        return tuple(found)

    def _contradicts(self, reply: _Reply) -> bool:
        if self._line is None:
            return False
        expected_ns = self.utc_ns(reply.boot_ns)
        assert expected_ns is not None
        return abs(reply.boot_ns + reply.offset_ns - expected_ns) > OUTLIER_NS + reply.round_trip_ns

    def _fit(self) -> None:
        shortest_ns = self._shortest_round_trip_ns
        assert shortest_ns is not None, "a reply has just come"
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
