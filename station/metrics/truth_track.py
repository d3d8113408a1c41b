"""The true path relative to the pad, at any time."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from alight.runtime.clock import nanoseconds
from schemas.truth import GroundTruth

MAX_GAP_NS = nanoseconds(0.2)
"""Truth further apart than this is not interpolated."""

Vector = NDArray[np.float64]


class TruthTrack:
    """Interpolates the vehicle's true position from the pad's centre (north, east, down, metres)."""

    def __init__(self, truths: Sequence[GroundTruth]) -> None:
        self.times_ns = np.array([truth.at_ns for truth in truths], np.int64)
        self.ned_m = np.array([truth.vehicle_from_pad_ned_m for truth in truths], float).reshape(-1, 3)

    def at(self, at_ns: int) -> Vector | None:
        """The position at a time, UTC ns; None outside the record and in its gaps."""
        after = int(np.searchsorted(self.times_ns, at_ns))
        if after < len(self.times_ns) and self.times_ns[after] == at_ns:
            return np.array(self.ned_m[after])
        if after in (0, len(self.times_ns)):
            return None
        begin_ns, end_ns = int(self.times_ns[after - 1]), int(self.times_ns[after])
        if end_ns - begin_ns > MAX_GAP_NS:
            return None
        fraction = (at_ns - begin_ns) / (end_ns - begin_ns)
        return np.array(self.ned_m[after - 1] + fraction * (self.ned_m[after] - self.ned_m[after - 1]))
