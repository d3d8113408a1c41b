"""Markers drawn into a picture, for people."""

from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from services.detector.detector import FoundMarker

_OUTLINE = (60, 220, 60)
_FIRST_CORNER = (60, 60, 240)
_SHIFT_BITS = 4


def draw_markers(picture: NDArray[np.uint8], markers: Iterable[FoundMarker], path: Path) -> None:
    """Write the picture with each marker's outline, its first corner in red, and its number.

    Raises:
        OSError: If it cannot be written.
    """
    canvas = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture.copy()
    for marker in markers:
        corners = np.rint(marker.corners_px * 2**_SHIFT_BITS).astype(np.int32)
        cv2.polylines(canvas, [corners], True, _OUTLINE, 1, cv2.LINE_AA, _SHIFT_BITS)
        first = (int(corners[0][0]), int(corners[0][1]))
        cv2.circle(canvas, first, 3 * 2**_SHIFT_BITS, _FIRST_CORNER, 1, cv2.LINE_AA, _SHIFT_BITS)
        x, y = (round(value) for value in marker.corners_px.mean(axis=0).tolist())
        cv2.putText(
            canvas, str(marker.id), (x + 4, y - 4), cv2.FONT_HERSHEY_SIMPLEX, 0.5, _FIRST_CORNER, 1, cv2.LINE_AA
        )
    if not cv2.imwrite(str(path), canvas):
        raise OSError(f"{path}: cannot be written")
