"""Enough markers of many: those that say most of the pad's pose, the largest and those farthest from each other."""

import numpy as np
from numpy.typing import NDArray

Found = list[tuple[int, NDArray[np.float64]]]
"""Number and corners (4, 2), pixels."""


def thinned(found: Found, most: int) -> Found:
    """At most so many: the largest, then always the one that is farthest from those taken, weighed by its size.

    Args:
        found: Markers, any order.
        most: How many to keep, at least one.
    """
    if len(found) <= most:
        return found
    middles = np.array([corners.mean(axis=0) for _, corners in found])
    sides_px = np.array([np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).mean() for _, corners in found])
    taken = [int(np.argmax(sides_px))]
    nearest_px = np.linalg.norm(middles - middles[taken[0]], axis=1)
    while len(taken) < most:
        taken.append(int(np.argmax(nearest_px * sides_px)))
        nearest_px = np.minimum(nearest_px, np.linalg.norm(middles - middles[taken[-1]], axis=1))
    return [found[index] for index in sorted(taken)]
