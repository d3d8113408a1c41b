"""Which marker of a pad is whole in view, and how large, from where the camera may be."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.geometry.rotation import R_x, R_z
from alight.markers.layout import PadLayout

Array = NDArray[np.float64]

_DIRECTIONS = 8
_YAWS = 12
_BORDER_PX = 4.0
_FACING_DOWN = np.diag((1.0, -1.0, -1.0))


@dataclass(frozen=True)
class Spread:
    """Where the camera may be over the pad at a given height."""

    offset_m: float = 0.05
    """Horizontal distance from the pad's centre at height 0, at most, metres."""
    offset_per_height: float = 0.1
    """How much farther it may be per metre of height."""
    tilt_rad: float = math.radians(6.0)
    """Between the optical axis and the vertical, at most."""


@dataclass(frozen=True)
class Sight:
    """The worst view from one height: the one whose best marker is smallest."""

    side_px: float
    """Shortest side of the largest marker that is whole in view; 0 if there is none."""
    share_by_marker: tuple[float, ...]
    """For each marker of the layout the share of views in which it is whole in view."""


def worst_sight(layout: PadLayout, camera: PinholeCamera, height_m: float, spread: Spread) -> Sight:
    """Look at the pad from everywhere that is allowed at one height.

    Args:
        layout: The pad.
        camera: Its lens and the size of its picture; in the vertical view the optical axis points straight down.
        height_m: Of the camera above the print, metres.
        spread: Where else it may be: on a circle of the largest offset and in the middle, turned to any yaw, upright and
            tilted any way by the largest tilt.
    """
    corners_m = np.array([marker.corners_m() for marker in layout.markers])
    sides = _sides_px(corners_m, camera, *_views(height_m, spread))
    return Sight(
        side_px=float(sides.max(axis=1).min()),
        share_by_marker=tuple((sides > 0.0).mean(axis=0).tolist()),
    )


def _views(height_m: float, spread: Spread) -> tuple[Array, Array]:
    """R_camera_pad (n, 3, 3) and the camera's position in the pad's frame (n, 3), metres, of every view."""
    reach_m = spread.offset_m + spread.offset_per_height * height_m
    circle = np.arange(_DIRECTIONS) * (math.tau / _DIRECTIONS)
    places = [(0.0, 0.0), *((reach_m * math.cos(angle), reach_m * math.sin(angle)) for angle in circle)]
    tilts = [np.eye(3), *(R_z(angle) @ R_x(spread.tilt_rad) @ R_z(-angle) for angle in circle)]
    yaws = [R_z(math.tau * index / _YAWS) for index in range(_YAWS)]
    views = [(tilt @ yaw @ _FACING_DOWN, (*place, height_m)) for place in places for tilt in tilts for yaw in yaws]
    return np.array([R for R, _ in views]), np.array([position for _, position in views])


def _sides_px(corners_m: Array, camera: PinholeCamera, R_camera_pad: Array, positions_m: Array) -> Array:
    """Shortest side of each marker in each picture, (n, N), pixels; 0 where it is not whole in view."""
    from_camera = corners_m.reshape(1, -1, 3) - positions_m[:, None]
    pixels = camera.project(np.einsum("nij,nkj->nki", R_camera_pad, from_camera))
    pixels = pixels.reshape(len(positions_m), len(corners_m), 4, 2)
    size = np.array((camera.width_px, camera.height_px)) - 1.0
    inside = ((pixels >= _BORDER_PX) & (pixels <= size - _BORDER_PX)).all(axis=(2, 3))
    sides = np.linalg.norm(pixels - np.roll(pixels, 1, axis=2), axis=3).min(axis=2)
    return np.where(inside, sides, 0.0)
