"""A picture of a pad for people: the print, and beside each marker its number."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.markers.layout import PadLayout
from alight.markers.print_grid import overlaps_m, print_grid, split_askew, turned_whiteness

_SIDE_PX = 1200
_FRAME_PX = 12
_LETTER = 0.45
_RED = (0, 0, 220)


def whiteness(layout: PadLayout, side_px: int) -> NDArray[np.float64]:
    """The print from straight above, 0 for ink and 1 for paper, means over each pixel's area, (n, n)."""
    upright, askew = split_askew(layout.markers)
    grid = print_grid(upright, layout.board_m, layout.ink)
    bounds = np.linspace(0.0, layout.board_m, side_px + 1)
    per_px = side_px / layout.board_m
    seen: NDArray[np.float64] = (
        (overlaps_m(bounds, grid.y_m) * per_px) @ grid.white @ (overlaps_m(bounds, grid.x_m) * per_px).T
    )
    for marker in askew:
        white, cover = turned_whiteness(marker, layout.board_m, side_px)
        seen = seen * (1.0 - cover) + white
    return seen


def draw_layout(layout: PadLayout, file: Path) -> bool:
    """Write the picture; False if that is impossible."""
    grey = np.rint(255.0 * whiteness(layout, _SIDE_PX)).astype(np.uint8)
    picture = np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR))
    for marker in layout.markers:
        corners = (marker.corners_m()[:, :2] * (1, -1) / layout.board_m + 0.5) * _SIDE_PX
        x, y = corners.max(axis=0).astype(int)[0], corners.max(axis=0).astype(int)[1]
        cv2.putText(picture, str(marker.id), (x - 8, y + 14), cv2.FONT_HERSHEY_SIMPLEX, _LETTER, _RED, 1, cv2.LINE_AA)
    framed = cv2.copyMakeBorder(picture, *(_FRAME_PX,) * 4, cv2.BORDER_CONSTANT, value=(160, 160, 160))
    try:
        return bool(cv2.imwrite(str(file), framed))
    except cv2.error:
        return False
