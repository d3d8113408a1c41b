"""From the pose of one marker to that of the pad that it lies on."""

import math
from collections.abc import Sequence

import numpy as np

from alight.geometry.rotation import Matrix, R_from_quaternion, quaternion_from_euler, quaternion_multiply
from alight.markers.layout import PlacedMarker
from schemas.detection import Corner, MarkerPose


def pad_pose(pose: MarkerPose, marker: PlacedMarker) -> MarkerPose:
    """The pad's pose, given that of a marker on it; the covariance is carried along the lever between them.

    Args:
        pose: The marker's.
        marker: Where it lies on the pad.
    """
    if marker.x_m == 0.0 and marker.y_m == 0.0 and marker.rotation_rad == 0.0:
        return pose
    q_marker_pad = quaternion_from_euler(0.0, 0.0, -marker.rotation_rad)
    q_camera_pad = quaternion_multiply(pose.q_camera_marker, q_marker_pad)
    # From the marker to the pad's centre.
    lever_m = R_from_quaternion(q_camera_pad) @ np.array((-marker.x_m, -marker.y_m, 0.0))
    x, y, z = (np.array(pose.position_camera_m) + lever_m).tolist()
    carried = np.eye(6)
    carried[:3, 3:] = -_cross(lever_m)
    covariance = carried @ np.array(pose.covariance).reshape(6, 6) @ carried.T
    return MarkerPose(
        position_camera_m=(x, y, z),
        q_camera_marker=q_camera_pad,
        reprojection_error_px=pose.reprojection_error_px,
        covariance=tuple(((covariance + covariance.T) / 2.0).ravel().tolist()),
    )


def mean_side_px(corners_px: Sequence[Corner]) -> float:
    """Mean length of the four sides of a marker, pixels, at least one pixel."""
    sides = (math.dist(corners_px[i], corners_px[i - 1]) for i in range(4))
    return max(1.0, sum(sides) / 4.0)


def _cross(v: Matrix) -> Matrix:
    """The matrix whose product with w is v x w."""
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
