"""From where the true camera looks at the pad: the ground truth and everything that is built otherwise than believed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from alight.geometry.frames import CAMERA_IN_BODY_M, R_body_camera
from alight.geometry.rotation import Matrix, R_from_quaternion, R_x, R_y, R_z, quaternion_from_rotation_vector
from schemas.settings.simulator import Installation
from schemas.truth import GroundTruth

_LOWEST_CAMERA_M = 0.02
_R_BODY_CAMERA = R_body_camera()


def mount_rotation(installation: Installation) -> Matrix:
    """Believed to true camera, in body coordinates: R_z(yaw) R_y(pitch) R_x(roll), (3, 3)."""
    roll, pitch, yaw = (
        math.radians(angle)
        for angle in (installation.mount_roll_deg, installation.mount_pitch_deg, installation.mount_yaw_deg)
    )
    return R_z(yaw) @ R_y(pitch) @ R_x(roll)


def R_ned_marker(azimuth_rad: float) -> Matrix:
    """Marker coordinates (x right, y up in the print, z out of it) to NED for a level pad, (3, 3)."""
    s, c = math.sin(azimuth_rad), math.cos(azimuth_rad)
    return np.array([[-s, c, 0.0], [c, s, 0.0], [0.0, 0.0, -1.0]])


@dataclass(frozen=True)
class Viewpoint:
    """The true camera's pose in the marker's frame."""

    R_marker_camera: Matrix
    """Takes camera to marker coordinates, (3, 3)."""
    position_marker_m: tuple[float, float, float]
    """Where the camera is, marker frame, metres."""

    @classmethod
    def from_truth(cls, truth: GroundTruth, mount: Matrix, after_s: float = 0.0) -> Self:
        """The viewpoint a moment after the truth was taken.

        Args:
            truth: Pose, velocity and rates of the vehicle; the pad's azimuth.
            mount: From `mount_rotation`.
            after_s: How long after, at constant velocity and rates, seconds; may be negative.
        """
        turned = [rate * after_s for rate in truth.angular_velocity_body_rps]
        R_ned_body = R_from_quaternion(truth.q_ned_body) @ R_from_quaternion(quaternion_from_rotation_vector(turned))
        body_ned_m = np.array(truth.vehicle_from_pad_ned_m) + np.array(truth.velocity_ned_mps) * after_s
        R_marker_ned = R_ned_marker(truth.pad_azimuth_rad).T
        x, y, z = (R_marker_ned @ (body_ned_m + R_ned_body @ np.array(CAMERA_IN_BODY_M))).tolist()
        return cls(R_marker_ned @ R_ned_body @ mount @ _R_BODY_CAMERA, (x, y, max(z, _LOWEST_CAMERA_M)))

    @property
    def extremes(self) -> "tuple[Viewpoint, ...]":
        """What bounds the viewpoints of all rows: with all rows exposed at once, this one alone."""
        return (self,)

    @property
    def ground_from_ray(self) -> Matrix:
        """Where a ray (x/z, y/z, 1) of the camera meets the plane of the print, (3, 3): homogeneous marker x, y in metres.

        The third component is positive for rays that go down.
        """
        x, y, height = self.position_marker_m
        right, up, out = self.R_marker_camera
        return np.array([height * right - x * out, height * up - y * out, -out])

    def in_camera(self, points_marker_m: Matrix) -> Matrix:
        """Points (N, 3) of the marker's frame in camera coordinates, metres."""
        moved: Matrix = (points_marker_m - np.array(self.position_marker_m)) @ self.R_marker_camera
        return moved


@dataclass(frozen=True)
class RollingViewpoint(Viewpoint):
    """The middle row's viewpoint, and those of rows from above to below the picture, each with a moment of its own."""

    rows: tuple[Viewpoint, ...]

    @classmethod
    def of_rows(cls, truth: GroundTruth, mount: Matrix, rows_after_s: Sequence[float], after_s: float = 0.0) -> Self:
        """The viewpoints a moment after the truth was taken.

        Args:
            truth: Pose, velocity and rates of the vehicle; the pad's azimuth.
            mount: From `mount_rotation`.
            rows_after_s: Of each row, after the middle row's exposure, seconds.
            after_s: The middle row's, after the truth, seconds.
        """
        middle = Viewpoint.from_truth(truth, mount, after_s)
        rows = tuple(Viewpoint.from_truth(truth, mount, after_s + row_s) for row_s in rows_after_s)
        return cls(middle.R_marker_camera, middle.position_marker_m, rows)

    @property
    def extremes(self) -> tuple[Viewpoint, ...]:
        """The first row's, the middle row's and the last row's."""
        return (self.rows[0], Viewpoint(self.R_marker_camera, self.position_marker_m), self.rows[-1])

    @property
    def ground_from_ray(self) -> Matrix:
        """The same for each row, (rows, 3, 3)."""
        return np.array([row.ground_from_ray for row in self.rows])
