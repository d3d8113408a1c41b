"""Where in the picture corners were seen: the lens is known there, and guessed elsewhere."""

from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from station.calibrate.views import View

COLUMNS, ROWS = 8, 6
CORNER_PART = 0.25
"""Width and height of the zones in the picture's corners, as parts of its own."""
ZONES = ("upper left", "upper right", "lower left", "lower right")

_DOT_PX = 2
_ONE = (60, 200, 60)
_GRID = (90, 90, 90)


class Coverage:
    """Collects the corners of views."""

    def __init__(self, size_px: tuple[int, int]) -> None:
        self.size_px = size_px
        self._pixels: list[NDArray[np.float64]] = []

    def add(self, views: Iterable[View]) -> None:
        """Take the corners of some views."""
        self._pixels.extend(view.corners.pixels for view in views)

    @property
    def covered(self) -> float:
        """Part of the picture's `COLUMNS` x `ROWS` fields with a corner in them, 0 to 1."""
        return float((self._counts() > 0).mean())

    def empty_zones(self) -> tuple[str, ...]:
        """The corners of the picture in which nothing was seen."""
        width, height = self.size_px
        places = self._places() / (width, height)
        left, top = places[:, 0] < CORNER_PART, places[:, 1] < CORNER_PART
        right, below = places[:, 0] > 1.0 - CORNER_PART, places[:, 1] > 1.0 - CORNER_PART
        seen = (left & top, right & top, left & below, right & below)
        return tuple(zone for zone, each in zip(ZONES, seen, strict=True) if not each.any())

    def draw(self, file: Path, behind: NDArray[np.uint8] | None = None) -> None:
        """Write a picture: green where corners were seen, the more the brighter, with a dot for each.

        Args:
            file: Where to.
            behind: What the camera sees now, (height, width), grey levels.

        Raises:
            OSError: If it cannot be written.
        """
        width, height = self.size_px
        counts = self._counts()
        field = np.zeros((ROWS, COLUMNS, 3))
        field[counts > 0] = np.array(_ONE) * 0.35
        field += np.array(_ONE) * (0.65 * np.minimum(counts / max(counts.max(), 1), 1.0))[..., None]
        picture = cv2.resize(field.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
        if behind is not None:
            picture = np.asarray(cv2.addWeighted(picture, 0.5, cv2.cvtColor(behind, cv2.COLOR_GRAY2BGR), 0.5, 0.0))
        for line in range(1, COLUMNS):
            cv2.line(picture, (width * line // COLUMNS, 0), (width * line // COLUMNS, height), _GRID)
        for line in range(1, ROWS):
            cv2.line(picture, (0, height * line // ROWS), (width, height * line // ROWS), _GRID)
        for x, y in np.rint(self._places()).astype(int).tolist():
            cv2.circle(picture, (x, y), _DOT_PX, (255, 255, 255), -1)
        made, code = cv2.imencode(".png", picture)
        if made:
            # Whoever watches the file never sees half a picture.
            part = file.with_suffix(".part")
            part.write_bytes(code.tobytes())
            part.replace(file)

    def _places(self) -> NDArray[np.float64]:
        return np.concatenate(self._pixels) if self._pixels else np.zeros((0, 2))

    def _counts(self) -> NDArray[np.int64]:
        width, height = self.size_px
        cells = np.floor(self._places() / (width / COLUMNS, height / ROWS)).astype(int)
        cells = cells[((cells >= 0) & (cells < (COLUMNS, ROWS))).all(axis=1)]
        counts = np.zeros((ROWS, COLUMNS), np.int64)
        np.add.at(counts, (cells[:, 1], cells[:, 0]), 1)
        return counts
