"""The rays of a camera on a regular grid of nodes, from which whole maps are interpolated."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera

STEP_PX = 4
"""Pixels between nodes. Interpolating the lens between them errs by less than 0.01 px in the corner of a 95 degree picture."""

Grid = NDArray[np.float32]


class RayGrid:
    """Undistorted rays at the centres of blocks of `STEP_PX` x `STEP_PX` pixels, one block beyond the picture on each side."""

    def __init__(self, camera: PinholeCamera) -> None:
        self.columns = math.ceil(camera.width_px / STEP_PX)
        self.rows = math.ceil(camera.height_px / STEP_PX)
        x_px = np.arange(-1, self.columns + 1) * STEP_PX + (STEP_PX - 1) / 2.0
        y_px = np.arange(-1, self.rows + 1) * STEP_PX + (STEP_PX - 1) / 2.0
        pixels = np.stack(np.meshgrid(x_px, y_px), axis=-1).reshape(-1, 2)
        centred = (pixels - (camera.cx_px, camera.cy_px)) / (camera.fx_px, camera.fy_px)
        rays = camera.undistorted(pixels)
        rays = np.where(np.isfinite(rays), rays, centred)
        self.rows_px = y_px
        """Picture rows of the nodes, (rows + 2,)."""
        shape = (self.rows + 2, self.columns + 2, 3)
        self.rays: Grid = np.column_stack((rays, np.ones(len(rays)))).reshape(shape).astype(np.float32)
        """(rows + 2, columns + 2, 3): x/z, y/z, 1."""


def enlarged(nodes: Grid) -> Grid:
    """Values on nodes, interpolated to pixels; the outermost nodes are used up.

    Args:
        nodes: (rows + 2, columns + 2) or (rows + 2, columns + 2, n).

    Returns:
        (rows * STEP_PX, columns * STEP_PX) or the same with n.
    """
    large = cv2.resize(nodes, None, fx=STEP_PX, fy=STEP_PX, interpolation=cv2.INTER_LINEAR)
    return np.asarray(large[STEP_PX:-STEP_PX, STEP_PX:-STEP_PX], np.float32)
