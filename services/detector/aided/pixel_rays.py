"""The ray of every pixel of a camera, worked out once."""

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera

_STEP_PX = 2
"""Between two pixels a lens is straight enough: a 95 degree lens errs by less than 0.003 px."""


class PixelRays:
    """Undistorted x/z, y/z at the pixels' centres, from exact rays on a grid of nodes, interpolated between them."""

    def __init__(self, camera: PinholeCamera) -> None:
        self.camera = camera
        columns, rows = camera.width_px // _STEP_PX + 5, camera.height_px // _STEP_PX + 5
        # OpenCV's enlarging puts the centre of a node's block of pixels on the node.
        x = (np.arange(columns) - 2) * _STEP_PX + (_STEP_PX - 1) / 2.0
        y = (np.arange(rows) - 2) * _STEP_PX + (_STEP_PX - 1) / 2.0
        nodes = camera.undistorted(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)).reshape(rows, columns, 2)
        large = cv2.resize(nodes, None, fx=_STEP_PX, fy=_STEP_PX, interpolation=cv2.INTER_LINEAR)
        first = 2 * _STEP_PX
        rays = np.asarray(large[first : first + camera.height_px, first : first + camera.width_px], np.float32)
        self._levels = {1: np.ascontiguousarray(rays.transpose(2, 0, 1))}

    def block(self, left: int, top: int, columns: int, rows: int, shrink: int) -> NDArray[np.float64]:
        """Rays (3, rows * columns), as x/z, y/z and 1, of a part of the picture made smaller.

        Args:
            left: First column, in pixels of the smaller picture.
            top: First row.
            columns: How many pixels of the smaller picture.
            rows: Likewise.
            shrink: A pixel of the smaller picture is a block of so many by so many of the whole one; a power of two.
        """
        part = self._level(shrink)[:, top : top + rows, left : left + columns]
        rays = np.ones((3, part.shape[1] * part.shape[2]))
        rays[:2] = part.reshape(2, -1)
        return rays

    def at(self, points_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rays x/z, y/z, (N, 2), at places in the picture (N, 2); beyond its edges the lens is asked."""
        width, height = self.camera.width_px, self.camera.height_px
        x, y = points_px[:, 0], points_px[:, 1]
        if not (x.min() >= 0.0 and y.min() >= 0.0 and x.max() <= width - 1.0 and y.max() <= height - 1.0):
            return self.camera.undistorted(points_px)
        column = np.minimum(x.astype(np.intp), width - 2)
        row = np.minimum(y.astype(np.intp), height - 2)
        right, down = x - column, y - row
        rays = self._levels[1]
        above = rays[:, row, column] * (1.0 - right) + rays[:, row, column + 1] * right
        below = rays[:, row + 1, column] * (1.0 - right) + rays[:, row + 1, column + 1] * right
        return np.asarray((above * (1.0 - down) + below * down).T, np.float64)

    def _level(self, shrink: int) -> NDArray[np.float32]:
        level = self._levels.get(shrink)
        if level is None:
            finer = self._level(shrink // 2)
            height, width = finer.shape[1] // 2, finer.shape[2] // 2
            halves = finer[:, : 2 * height, : 2 * width].reshape(2, height, 2, width, 2)
            level = self._levels[shrink] = np.asarray(halves.mean(axis=(2, 4)), np.float32)
        return level
