"""How far another clock is from ours, from questions and answers, as NTP does it (RFC 5905, Section 8)."""

import math
from collections import deque
from dataclasses import dataclass

from alight.runtime.clock import seconds

ROUNDED_NS = 2
"""What whole nanoseconds cost in twice the difference of two offsets."""
KEPT = 8
"""Answers that are looked back on, as NTP's clock filter does."""


@dataclass(frozen=True)
class Exchange:
    """One question and its answer: two stamps of ours around two of theirs, each UTC ns on its own clock."""

    asked_ns: int
    received_ns: int
    answered_ns: int
    came_ns: int

    @property
    def offset_ns(self) -> int:
        """Their clock minus ours, if both ways took equally long."""
        return (self.received_ns - self.asked_ns + self.answered_ns - self.came_ns) // 2

    @property
    def round_trip_ns(self) -> int:
        """Time on the way, there and back. The offset is wrong by half of it at most."""
        return (self.came_ns - self.asked_ns) - (self.answered_ns - self.received_ns)

    def contradicts(self, other: "Exchange") -> bool:
        """Whether no one offset explains both: a clock was set in between, or has drifted that far."""
        apart_ns = abs(self.offset_ns - other.offset_ns)
        return 2 * apart_ns > self.round_trip_ns + other.round_trip_ns + ROUNDED_NS


class ClockOffset:
    """The offset by the quickest of the last answers; what came before a clock was set is forgotten."""

    def __init__(self, max_round_trip_ns: int) -> None:
        self._max_round_trip_ns = max_round_trip_ns
        self._kept: deque[Exchange] = deque(maxlen=KEPT)
        self.taken = 0
        """Answers used."""
        self.left_out = 0
        """Answers that took too long, or that left before they were asked for."""

    def take(self, exchange: Exchange) -> bool:
        """Take one exchange in; False if it is nonsense, or too slow to tell anything."""
        thought_ns = exchange.answered_ns - exchange.received_ns
        if thought_ns < 0 or not 0 <= exchange.round_trip_ns <= self._max_round_trip_ns:
            self.left_out += 1
            return False
        self.taken += 1
        if any(exchange.contradicts(one) for one in self._kept):
            self._kept.clear()
        self._kept.append(exchange)
        return True

    @property
    def best(self) -> Exchange | None:
        """The exchange with the shortest round trip; the newest of several."""
        return min(reversed(self._kept), key=lambda one: one.round_trip_ns, default=None)

    @property
    def came_ns(self) -> int | None:
        """When the last answer came, UTC ns by our clock."""
        return self._kept[-1].came_ns if self._kept else None

    @property
    def jitter_s(self) -> float | None:
        """Root mean square of the other offsets against the best one, seconds; None of fewer than two."""
        best = self.best
        if best is None or len(self._kept) < 2:
            return None
        squares = [seconds(one.offset_ns - best.offset_ns) ** 2 for one in self._kept]
        return math.sqrt(sum(squares) / (len(squares) - 1))
