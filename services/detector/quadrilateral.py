"""Whether four corners can be a marker's at all."""

import numpy as np
from numpy.typing import NDArray

_SMALLEST_AREA_PX2 = 9.0


def is_sound(corners_px: NDArray[np.float64]) -> bool:
    """Whether four corners (4, 2) are finite and make a convex quadrilateral that runs clockwise in the picture and has an area."""
    if not np.isfinite(corners_px).all():
        return False
    edges = np.roll(corners_px, -1, axis=0) - corners_px
    following = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    return bool((turns > 0.0).all()) and float(turns.sum()) / 2.0 > _SMALLEST_AREA_PX2
