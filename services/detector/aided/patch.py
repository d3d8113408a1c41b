"""The pixels that a fit compares: those around a marker, perhaps of a picture made smaller."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from services.detector.aided.pixel_rays import PixelRays
from services.detector.detector import GreyPicture

Array = NDArray[np.float64]

QUIET_CELLS = 1.0
"""How much of the board beside the marker is compared."""
_LARGEST_SIDE_PX = 42.0
_FEWEST_PIXELS, _MOST_PIXELS = 40, 1400
"""Of more pixels, every second, third, ... is taken. Half of the side and of the pixels would save a tenth of the time of following a pad, and make the
distance of one at 10 m, seen from aside, scatter by 0.6 cm from frame to frame instead of 0.3."""


@dataclass(frozen=True)
class Patch:
    """Pixels around a marker."""

    brightness: Array
    """(N,), grey levels."""
    rays: Array
    """(3, N): x/z, y/z and 1."""
    shrink: int
    """How many pixels of the whole picture, across, one of these is."""


def patch_around(
    picture: GreyPicture, rays: PixelRays, corners_px: Array, cells_from_rays: Array, count: int
) -> Patch | None:
    """Cut out what shows a marker and its quiet zone.

    Args:
        picture: (height, width), grey levels.
        rays: Of its camera.
        corners_px: (4, 2), where the marker's corners should be.
        cells_from_rays: (3, 3), takes rays to places on the print in cells.
        count: Cells a side, border included.

    Returns:
        None if too little is in view.
    """
    if not np.isfinite(corners_px).all():
        return None
    sides = np.hypot(*(corners_px - corners_px[[3, 0, 1, 2]]).T)
    shrink = shrink_of(float(sides.sum()) / 4.0)
    reach = float(sides.max()) * (QUIET_CELLS / count) * 1.5
    height, width = picture.shape
    low, high = (corners_px.min(axis=0) - reach) / shrink, (corners_px.max(axis=0) + reach) / shrink
    left, top = max(math.floor(low[0]), 0), max(math.floor(low[1]), 0)
    right, bottom = min(math.ceil(high[0]) + 1, width // shrink), min(math.ceil(high[1]) + 1, height // shrink)
    if right - left < 4 or bottom - top < 4:
        return None
    part = picture[top * shrink : bottom * shrink, left * shrink : right * shrink]
    if shrink > 1:
        part = np.asarray(cv2.resize(part, (right - left, bottom - top), interpolation=cv2.INTER_AREA), np.uint8)
    seen = rays.block(left, top, right - left, bottom - top, shrink)
    places = cells_from_rays @ seen
    middle, reach_cells = count / 2.0, count / 2.0 + QUIET_CELLS
    off = np.abs(places[:2] - middle * places[2])
    inside = np.flatnonzero(np.maximum(off[0], off[1]) < reach_cells * places[2])
    if len(inside) < _FEWEST_PIXELS:
        return None
    used = inside[:: math.ceil(len(inside) / _MOST_PIXELS)]
    return Patch(part.reshape(-1)[used].astype(np.float64), seen[:, used], shrink)


def shrink_of(side_px: float) -> int:
    """By which power of two a picture is made smaller so that a marker's sides are no longer than they need to be."""
    return 1 << max(math.ceil(math.log2(max(side_px, 1.0) / _LARGEST_SIDE_PX)), 0)
