"""The plane of a print in the picture: from rays to places in cells, and how these move with the pose."""

import math

import numpy as np
from numpy.typing import NDArray

from services.detector.aided.marker_view import MarkerView

Array = NDArray[np.float64]


def cells_from_rays(view: MarkerView, side_m: float, count: int) -> Array:
    """The homography (3, 3) from rays (x/z, y/z, 1) to places (u, v, 1), up to a factor that is positive before the camera.

    u and v count cells to the right and down from the upper left corner of the black outer edge.
    """
    cell_m, half = side_m / count, count / 2.0
    (r11, r12, _), (r21, r22, _), (r31, r32, _) = (view.R * cell_m).tolist()
    x, y, z = view.t.tolist()
    # Columns of the way back: one cell to the right, one down, and the print's corner.
    a, b, c = r11, r21, r31
    d, e, f = -r12, -r22, -r32
    g, h, i = x - half * (a + d), y - half * (b + e), z - half * (c + f)
    rows = (
        (e * i - f * h, f * g - d * i, d * h - e * g),
        (c * h - b * i, a * i - c * g, b * g - a * h),
        (b * f - c * e, c * d - a * f, a * e - b * d),
    )
    determinant = a * rows[0][0] + b * rows[0][1] + c * rows[0][2]
    return np.array(rows) / (determinant or math.inf)


def motions(view: MarkerView, side_m: float, count: int, plane: Array) -> Array:
    """How places move with the pose, (9, 6).

    Column k, as a (3, 3) matrix A, belongs to a shift along an axis of the camera by the whole distance (k < 3) or a turn about one by 1 rad (k >= 3):
    a pixel's place (u, v) moves by A[:2] @ (u, v, 1) - (u, v) (A[2] @ (u, v, 1)).

    Args:
        view: The pose.
        side_m: The marker's.
        count: Its cells.
        plane: `cells_from_rays` of these.
    """
    change = np.zeros((6, 3, 3))
    z = float(view.t[2])
    change[0, 0, 2] = change[1, 1, 2] = change[2, 2, 2] = z
    (r11, r12, _), (r21, r22, _), (r31, r32, _) = (view.R * (side_m / count)).tolist()
    # The cross products of the camera's axes with those of the print, v counted downwards.
    change[3:, :, :2] = (
        ((0.0, 0.0), (-r31, r32), (r21, -r22)),
        ((r31, -r32), (0.0, 0.0), (-r11, r12)),
        ((-r21, r22), (r11, -r12), (0.0, 0.0)),
    )
    change[3:, :, 2] = (change[3:, :, 0] + change[3:, :, 1]) * (-count / 2.0)
    return np.asarray(-(plane @ change).reshape(6, 9).T)
