"""Where a marker is and how it is turned, as the camera sees it."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.markers.layout import PlacedMarker

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MarkerView:
    """A pose in the camera frame: takes coordinates of the print (x right, y up, z out of it) to camera coordinates."""

    R: Array
    """(3, 3)."""
    t: Array
    """Its centre, (3,), metres."""

    def of_marker(self, marker: PlacedMarker) -> "MarkerView":
        """With this as the pad's pose, the pose of one of its markers."""
        return MarkerView(self.R @ _in_pad(marker), self.t + self.R[:, 0] * marker.x_m + self.R[:, 1] * marker.y_m)

    def of_pad(self, marker: PlacedMarker) -> "MarkerView":
        """With this as the pose of one of its markers, the pad's."""
        R = self.R @ _in_pad(marker).T
        return MarkerView(R, self.t - R[:, 0] * marker.x_m - R[:, 1] * marker.y_m)


@dataclass(frozen=True)
class TiltPrior:
    """Which way the print should face."""

    normal_camera: Array
    """Unit vector out of the print, camera frame, (3,)."""
    sigma_rad: float
    """Standard deviation about each axis across it."""


def _in_pad(marker: PlacedMarker) -> Array:
    c, s = math.cos(marker.rotation_rad), math.sin(marker.rotation_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def views_of_square(corners_px: Array, side_m: float, camera: PinholeCamera) -> list[MarkerView]:
    """Both poses that a square's corners allow, the better one first; empty if none puts it before the camera."""
    rays = camera.undistorted(corners_px)
    if not np.isfinite(rays).all():
        return []
    half = side_m / 2.0
    square = np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])
    try:
        _, rotations, positions, _ = cv2.solvePnPGeneric(
            square, rays.reshape(4, 1, 2), np.eye(3), np.zeros(5), flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
    except cv2.error:
        return []
    views = [
        MarkerView(np.asarray(cv2.Rodrigues(rotation)[0], float), np.asarray(position, float).reshape(3))
        for rotation, position in zip(rotations, positions, strict=True)
    ]
    return [view for view in views if view.t[2] > 0.0 and np.isfinite(view.R).all()]
