"""From which heights a pad can be seen at all, and how large its markers are then."""

from collections.abc import Iterator

import numpy as np

from alight.geometry.camera import PinholeCamera
from alight.markers.layout import PadLayout
from alight.markers.visibility import Spread, worst_sight

READABLE_PX = 18.0
"""OpenCV's detector reads nearly all markers that are at least so large."""

_HEIGHTS_M = np.geomspace(0.1, 60.0, 60)


def range_lines(layout: PadLayout, camera: PinholeCamera) -> Iterator[str]:
    """In words, line by line: some marker whole in view, and large enough to be read."""
    spread = Spread()
    sides_px = [worst_sight(layout, camera, height_m, spread).side_px for height_m in _HEIGHTS_M.tolist()]
    readable = [
        height_m for height_m, side_px in zip(_HEIGHTS_M.tolist(), sides_px, strict=True) if side_px >= READABLE_PX
    ]
    yield (
        f"from anywhere within {spread.offset_m:g} m + {spread.offset_per_height:g} of the height beside its middle, tilted up to "
        f"{np.degrees(spread.tilt_rad):g} deg, turned any way:"
    )
    if not readable:
        yield f"at no height is a marker whole in view and {READABLE_PX:g} px large"
        return
    gaps = [
        height_m
        for height_m, side_px in zip(_HEIGHTS_M.tolist(), sides_px, strict=True)
        if readable[0] < height_m < readable[-1] and side_px < READABLE_PX
    ]
    yield (
        f"some marker is whole in view and at least {READABLE_PX:g} px large from {readable[0]:.2f} m to {readable[-1]:.1f} m "
        "of the camera above the print" + (f", but not from {gaps[0]:.2f} to {gaps[-1]:.2f} m" if gaps else "")
    )
