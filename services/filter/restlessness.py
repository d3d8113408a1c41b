"""How fast the navigation solution walks, where it walks faster than the settings say: learnt from the fixes.

A plain GNSS receiver, or an estimator that has just got its satellites back, moves the solution by decimetres within a second.
A filter that takes it for steady refuses every fix then, although all of them are good, and the vehicle holds above a pad that
it sees. One fix that is far off says nothing; that most of the last few are says that it is the solution that moves.
"""

import math
import statistics
from collections import deque

from schemas.message import Vector3

_REMEMBERED = 7
_FEWEST = 4
_BEYOND = 4.0
"""While nothing is learnt, an innovation counts from so many times its expected square on: with honest expectations, most of the last fixes
hardly ever do."""
_LEAST_S = 0.01


class Restlessness:
    """The median of what the last fixes ask for beyond the expected, as a random walk: m^2 a second, each axis."""

    def __init__(self, most_m: float) -> None:
        """Begin with a solution that is as steady as the settings say.

        Args:
            most_m: How far it is believed to walk within a second at most, standard deviation, metres; 0 never learns.
        """
        self._most = most_m**2
        self._asked: deque[float] = deque(maxlen=_REMEMBERED)

    @property
    def walk_m2ps(self) -> float:
        """What is to be added to the walk of the settings."""
        if len(self._asked) < _FEWEST:
            return 0.0
        return min(statistics.median(self._asked), self._most)

    def take(self, away_m: Vector3, expected_m2: float, since_s: float) -> None:
        """Take an innovation, whatever becomes of its fix.

        Args:
            away_m: Sighting minus expectation.
            expected_m2: Sum of its variances on the three axes, with the walk that was learnt.
            since_s: Time since the last fix that was fused.
        """
        since_s = max(since_s, _LEAST_S)
        walk_m2ps = self.walk_m2ps
        steady_m2 = max(expected_m2 - 3.0 * walk_m2ps * since_s, 0.0)
        north, east, down = away_m
        beyond_m2 = north * north + east * east + down * down - (1.0 if walk_m2ps > 0.0 else _BEYOND) * steady_m2
        if math.isfinite(beyond_m2):
            self._asked.append(max(beyond_m2, 0.0) / (3.0 * since_s))
