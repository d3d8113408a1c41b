"""What the extrinsic fit looks at: corners in the picture, with where the vehicle was and how it was turned over time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Track:
    """Something that changes over time, sampled."""

    times_s: Array
    """(M,), ascending."""
    values: Array
    """(M, K)."""

    def at(self, times_s: Array) -> Array:
        """Linear interpolation, (N, K); beyond the ends the first and the last value hold."""
        return np.column_stack([np.interp(times_s, self.times_s, column) for column in self.values.T])


@dataclass(frozen=True)
class Sightings:
    """The pad's corners in the frames of one recording. Times are seconds from any one moment of it."""

    captured_s: Array
    """(N,), the frames' stamps."""
    corners_px: Array
    """(N, C, 2), distorted pixels."""
    corners_m: Array
    """(C, 3), the same corners in the pad's frame (x right, y up, z out of the print) as believed, metres."""
    position: Track
    """Of the body's origin from the surveyed place of the pad, north, east, down, metres: the reference."""
    attitude: Track
    """q_ned_body (w, x, y, z) as the autopilot has it, signs unified from sample to sample."""

    def __len__(self) -> int:
        return len(self.captured_s)

    def thinned(self, every: int) -> "Sightings":
        """Every so many frames only."""
        return Sightings(
            self.captured_s[::every], self.corners_px[::every], self.corners_m, self.position, self.attitude
        )


def unified(q: Array) -> Array:
    """Quaternions (M, 4) with the sign that makes each the nearer one to that before it."""
    flips = np.sign(np.sum(q[1:] * q[:-1], axis=1))
    return np.asarray(q * np.concatenate(([1.0], np.cumprod(np.where(flips == 0.0, 1.0, flips))))[:, None], float)


def thinned_to(sightings: Sequence[Sightings], most: int) -> list[Sightings]:
    """As few frames as that, evenly over all recordings: neighbours tell the same."""
    every = max(1, -(-sum(len(one) for one in sightings) // most))
    return [one.thinned(every) for one in sightings]
