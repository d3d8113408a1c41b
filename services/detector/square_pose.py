"""Both poses that the picture of a square allows (IPPE), with their covariances."""

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.geometry.rolling_shutter import row_after_s
from alight.geometry.rotation import quaternion_from_R
from schemas.detection import Marker, MarkerPose
from services.detector.detector import FoundMarker

Array = NDArray[np.float64]

PRIOR_POSITION_SIGMA_M = 1000.0
"""How far away a marker may be at all: keeps the covariance finite."""
PRIOR_ROTATION_SIGMA_RAD = 1.0
"""How much a rotation may be wrong at all; rules where a square seen from straight above does not show its tilt."""

SAME_ROTATION_TRACE = 2.9999
"""Trace of the rotation between two poses that counts as none: less than 0.6 degrees."""

_NEAREST_M = 1e-3
_LEAST_SIGMA_PX = 1e-3
"""Keeps positive what is propagated from corners of which some are said not to err at all."""


def square_points_m(side_m: float) -> Array:
    """The corners in the marker's frame (x right, y up, z out of the print), (4, 3), in the order of `Marker.corners_px`."""
    half = side_m / 2.0
    return np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])


def located(found: FoundMarker, side_m: float, camera: PinholeCamera, row_time_s: float = 0.0) -> Marker | None:
    """The marker with its poses, the better one first; None if no pose puts it before the camera.

    Args:
        found: The marker in the picture.
        side_m: Length of its black outer edge, metres.
        camera: The calibrated camera.
        row_time_s: From the exposure of one row to that of the next, seconds.
    """
    rays = camera.undistorted(found.corners_px)
    if not np.isfinite(rays).all():
        return None
    poses = [_pose(R, t, found, side_m, camera) for R, t in _ippe(rays, side_m)]
    seen = sorted((pose for pose in poses if pose is not None), key=lambda pose: pose.reprojection_error_px)
    if not seen:
        return None
    best, worst = seen[0].reprojection_error_px, seen[-1].reprojection_error_px
    return Marker(
        family=found.family,
        id=found.id,
        side_m=side_m,
        corners_px=tuple((float(x), float(y)) for x, y in found.corners_px),
        corner_sigma_px=found.corner_sigma_px,
        poses=tuple(seen),
        ambiguity=(best / worst if worst > 0.0 else 1.0) if len(seen) > 1 else 0.0,
        rows_after_s=row_after_s(float(found.corners_px[:, 1].mean()), camera.height_px, row_time_s),
    )


def _ippe(rays: Array, side_m: float) -> list[tuple[Array, Array]]:
    """Both solutions, each settled where it fits best; the second as IPPE gives it where it would settle in the first."""
    try:
        count, rotations, positions, _ = cv2.solvePnPGeneric(
            square_points_m(side_m), rays.reshape(4, 1, 2), np.eye(3), np.zeros(5), flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
    except cv2.error:
        return []
    settled = [_settled(rotations[index], positions[index], rays, side_m) for index in range(count)]
    if len(settled) < 2 or not _turn_alike(*settled):
        return settled
    given = np.asarray(cv2.Rodrigues(rotations[1])[0], float), np.asarray(positions[1], float).reshape(3)
    return settled[:1] if _turn_alike(settled[0], given) else [settled[0], given]


def _settled(
    rotation: cv2.typing.MatLike, position: cv2.typing.MatLike, rays: Array, side_m: float
) -> tuple[Array, Array]:
    """The least-squares pose next to one of IPPE's: IPPE's own scatters several times more sideways where the marker is near."""
    points_m, seen = square_points_m(side_m), rays.reshape(4, 1, 2)
    rotation, position = cv2.solvePnPRefineLM(points_m, seen, np.eye(3), np.zeros(5), rotation.copy(), position.copy())
    return np.asarray(cv2.Rodrigues(rotation)[0], float), np.asarray(position, float).reshape(3)


def _turn_alike(one: tuple[Array, Array], other: tuple[Array, Array]) -> bool:
    return float(np.trace(one[0].T @ other[0])) > SAME_ROTATION_TRACE


def _pose(R: Array, t: Array, found: FoundMarker, side_m: float, camera: PinholeCamera) -> MarkerPose | None:
    corners_m = square_points_m(side_m) @ R.T
    if not (np.isfinite(R).all() and np.isfinite(t).all()) or float((corners_m + t)[:, 2].min()) < _NEAREST_M:
        return None
    error = camera.project(corners_m + t) - found.corners_px
    if not np.isfinite(error).all():
        return None
    covariance = _covariance(corners_m, t, found, camera)
    return MarkerPose(
        position_camera_m=(float(t[0]), float(t[1]), float(t[2])),
        q_camera_marker=quaternion_from_R(R),
        reprojection_error_px=float(np.sqrt(np.mean(np.sum(error**2, axis=1)))),
        covariance=tuple(covariance.ravel().tolist()),
    )


def _covariance(corners_m: Array, t: Array, found: FoundMarker, camera: PinholeCamera) -> Array:
    """First-order propagation of the corners' errors to the least-squares pose, (6, 6).

    Corners that err each on its own: (J^T J / sigma^2 + prior^-1)^-1. Where the detector tells how they err together, C: G C G^T with
    G = (J^T J + sigma^2 prior^-1)^-1 J^T, since the pose is fitted to them as if they were alike. The lens's distortion is left out of J:
    it stretches the picture by some percent only.
    """
    rows = []
    for corner, (x, y, z) in zip(corners_m, corners_m + t, strict=True):
        projection = np.array(
            [[camera.fx_px / z, 0.0, -camera.fx_px * x / z**2], [0.0, camera.fy_px / z, -camera.fy_px * y / z**2]]
        )
        cx, cy, cz = corner
        # A small rotation w moves the corner by w x corner.
        turning = np.array([[0.0, cz, -cy], [-cz, 0.0, cx], [cy, -cx, 0.0]])
        rows.append(projection @ np.hstack((np.eye(3), turning)))
    J, sigma2 = np.vstack(rows), found.corner_sigma_px**2
    prior = np.diag([PRIOR_POSITION_SIGMA_M**-2] * 3 + [PRIOR_ROTATION_SIGMA_RAD**-2] * 3)
    inverse = np.linalg.inv(J.T @ J + sigma2 * prior)
    if found.corner_covariance_px2 is None:
        covariance = inverse * sigma2
    else:
        G = inverse @ J.T
        covariance = G @ (found.corner_covariance_px2 + _LEAST_SIGMA_PX**2 * np.eye(8)) @ G.T
    symmetric: Array = (covariance + covariance.T) / 2.0
    return symmetric
