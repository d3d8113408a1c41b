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
    """(C, 3), or (N, C, 3) where frames differ: the same corners in the pad's frame (x right, y up, z out of the print) as believed, metres."""
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


_APART_S = 1000.0
"""Between recordings that are put after each other. No latency is nearly as long."""


def together(sightings: Sequence[Sightings]) -> Sightings:
    """All recordings as one: their times one after the other, so far apart that no track knows of its neighbours."""
    later_s, end_s = [], 0.0
    for one in sightings:
        begin_s = min(one.position.times_s[0], one.attitude.times_s[0])
        later_s.append(end_s + _APART_S - begin_s)
        end_s = later_s[-1] + max(one.position.times_s[-1], one.attitude.times_s[-1])
    return Sightings(
        np.concatenate([one.captured_s + later for one, later in zip(sightings, later_s, strict=True)]),
        np.concatenate([one.corners_px for one in sightings]),
        np.concatenate([np.broadcast_to(one.corners_m, (*one.corners_px.shape[:2], 3)) for one in sightings]),
        _joined([one.position for one in sightings], later_s),
        _joined([one.attitude for one in sightings], later_s),
    )


def _joined(tracks: Sequence[Track], later_s: Sequence[float]) -> Track:
    """Tracks one after the other, each that much later; the first and the last value of each hold nearly half-way to its neighbours."""
    hold_s = 0.4 * _APART_S
    times_s = [
        np.concatenate(([track.times_s[0] - hold_s], track.times_s, [track.times_s[-1] + hold_s])) + later
        for track, later in zip(tracks, later_s, strict=True)
    ]
    values = [np.concatenate((track.values[:1], track.values, track.values[-1:])) for track in tracks]
    return Track(np.concatenate(times_s), np.concatenate(values))


def unified(q: Array) -> Array:
    """Quaternions (M, 4) with the sign that makes each the nearer one to that before it."""
    flips = np.sign(np.sum(q[1:] * q[:-1], axis=1))
    return np.asarray(q * np.concatenate(([1.0], np.cumprod(np.where(flips == 0.0, 1.0, flips))))[:, None], float)


def thinned_to(sightings: Sequence[Sightings], most: int) -> list[Sightings]:
    """As few frames as that, evenly over all recordings: neighbours tell the same."""
    every = max(1, -(-sum(len(one) for one in sightings) // most))
    return [one.thinned(every) for one in sightings]
