"""The pose of a plane from any number of its points, each with its own noise: both solutions, and how sure they are."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.geometry.rotation import R_from_quaternion, quaternion_from_R, quaternion_from_rotation_vector
from schemas.detection import MarkerPose
from services.detector.square_pose import PRIOR_POSITION_SIGMA_M, PRIOR_ROTATION_SIGMA_RAD, SAME_ROTATION_TRACE

Array = NDArray[np.float64]

_MOST_STEPS = 12
_SETTLED_ROTATION_RAD = 1e-7
_FIRST_DAMPING = 1e-6
_NEAREST_M = 1e-3


@dataclass(frozen=True)
class SeenPoints:
    """Points of a plane and where they are in the picture."""

    points_m: Array
    """(N, 3), in the plane's frame, z = 0, metres."""
    pixels: Array
    """(N, 2), distorted pixels."""
    sigma_px: Array
    """(N,), standard deviation of one coordinate, pixels."""


@dataclass(frozen=True)
class PlanarPose:
    """A plane in the camera's frame."""

    R_camera_plane: Array
    position_m: Array
    residuals_px: Array
    """(N, 2), reprojected minus seen, pixels."""
    information: Array
    """(6, 6), of (position, small rotation in the camera frame), without the prior."""
    chi2: float
    """Sum of the squared residuals, each in its standard deviations."""

    @property
    def covariance(self) -> Array:
        """(6, 6), first order, of (position, small rotation in the camera frame): m^2, m rad, rad^2."""
        prior = np.array([PRIOR_POSITION_SIGMA_M**-2] * 3 + [PRIOR_ROTATION_SIGMA_RAD**-2] * 3)
        inverse = np.linalg.inv(self.information + np.diag(prior))
        symmetric: Array = (inverse + inverse.T) / 2.0
        return symmetric

    def as_message(self) -> MarkerPose:
        """The pose as it travels. Where points fit worse than their noise says, the covariance grows to match."""
        spare = max(self.residuals_px.size - 6, 1)
        covariance = self.covariance * max(self.chi2 / spare, 1.0)
        x, y, z = self.position_m.tolist()
        return MarkerPose(
            position_camera_m=(x, y, z),
            q_camera_marker=quaternion_from_R(self.R_camera_plane),
            reprojection_error_px=float(np.sqrt(np.mean(np.sum(self.residuals_px**2, axis=1)))),
            covariance=tuple(covariance.ravel().tolist()),
        )


def planar_poses(seen: SeenPoints, camera: PinholeCamera) -> tuple[PlanarPose, ...]:
    """Both solutions that a plane's picture allows (IPPE), each settled where it fits best; the better one first.

    Returns:
        At most two; one where the picture allows but one; none if no solution puts all points before the camera.
    """
    rays = camera.undistorted(seen.pixels)
    if not np.isfinite(rays).all():
        return ()
    try:
        count, turns, shifts, _ = cv2.solvePnPGeneric(
            seen.points_m, rays.reshape(-1, 1, 2), np.eye(3), np.zeros(5), flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error:
        return ()
    starts = [
        (np.asarray(cv2.Rodrigues(turns[i])[0], float), np.asarray(shifts[i], float).ravel()) for i in range(count)
    ]
    found = [pose for R, t in starts if (pose := _settled(R, t, seen, rays, camera)) is not None]
    found.sort(key=lambda pose: pose.chi2)
    if len(found) == 2 and float(np.trace(found[0].R_camera_plane.T @ found[1].R_camera_plane)) > SAME_ROTATION_TRACE:
        found.pop()
    return tuple(found)


def predicted(pose: PlanarPose, points_m: Array, camera: PinholeCamera) -> tuple[Array, Array]:
    """Where other points of the plane should be, pixels (M, 2), and the covariance of that by the pose, (M, 2, 2)."""
    turned = points_m @ pose.R_camera_plane.T
    J = _jacobian(turned, turned + pose.position_m, camera)
    return camera.project(turned + pose.position_m), J @ pose.covariance @ J.transpose(0, 2, 1)


def _settled(R: Array, t: Array, seen: SeenPoints, rays: Array, camera: PinholeCamera) -> PlanarPose | None:
    """Least squares from a start, by Levenberg's method on the undistorted rays; residuals are weighted by their noise."""
    weight = np.array((camera.fx_px, camera.fy_px)) / seen.sigma_px[:, None]
    damping, chi2 = _FIRST_DAMPING, np.inf
    turned = seen.points_m @ R.T
    for _ in range(_MOST_STEPS):
        at = turned + t
        if not np.isfinite(at).all() or float(at[:, 2].min()) < _NEAREST_M:
            return None
        residual = ((at[:, :2] / at[:, 2:] - rays) * weight).ravel()
        J = (_jacobian(turned, at, camera) / seen.sigma_px[:, None, None]).reshape(-1, 6)
        normal = J.T @ J
        chi2 = float(residual @ residual)
        R, t, step = _stepped(R, t, seen, rays, weight, (normal, J.T @ residual, chi2, damping))
        turned = seen.points_m @ R.T
        if step < _SETTLED_ROTATION_RAD:
            break
    return _judged(R, t, seen, camera)


def _stepped(
    R: Array, t: Array, seen: SeenPoints, rays: Array, weight: Array, system: tuple[Array, Array, float, float]
) -> tuple[Array, Array, float]:
    """The next pose, and how far away it is; shorter steps are tried until one is an improvement."""
    normal, gradient, chi2, damping = system
    for _ in range(_MOST_STEPS):
        move = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -gradient)
        turn = R_from_quaternion(quaternion_from_rotation_vector(move[3:].tolist()))
        new_R, new_t = turn @ R, t + move[:3]
        at = seen.points_m @ new_R.T + new_t
        if float(at[:, 2].min()) >= _NEAREST_M:
            residual = (at[:, :2] / at[:, 2:] - rays) * weight
            if float((residual**2).sum()) <= chi2:
                return new_R, new_t, float(np.abs(move[3:]).max() + np.abs(move[:3]).max() / new_t[2])
        damping = max(damping * 10.0, 1e-3)
    return R, t, 0.0


def _judged(R: Array, t: Array, seen: SeenPoints, camera: PinholeCamera) -> PlanarPose | None:
    turned = seen.points_m @ R.T
    residuals = camera.project(turned + t) - seen.pixels
    if not np.isfinite(residuals).all():
        return None
    J = (_jacobian(turned, turned + t, camera) / seen.sigma_px[:, None, None]).reshape(-1, 6)
    chi2 = float(((residuals / seen.sigma_px[:, None]) ** 2).sum())
    return PlanarPose(R, t, residuals, J.T @ J, chi2)


def _jacobian(turned: Array, at: Array, camera: PinholeCamera) -> Array:
    """Of the pixels by (position, small rotation in the camera frame), (N, 2, 6); the lens's few per cent are left out."""
    x, y, z = at.T
    J = np.zeros((len(at), 2, 6))
    J[:, 0, 0], J[:, 0, 2] = camera.fx_px / z, -camera.fx_px * x / z**2
    J[:, 1, 1], J[:, 1, 2] = camera.fy_px / z, -camera.fy_px * y / z**2
    cx, cy, cz = turned.T
    # A small rotation w moves a point by w x point.
    crossing = np.zeros((len(at), 3, 3))
    crossing[:, 0, 1], crossing[:, 0, 2] = cz, -cy
    crossing[:, 1, 0], crossing[:, 1, 2] = -cz, cx
    crossing[:, 2, 0], crossing[:, 2, 1] = cy, -cx
    J[:, :, 3:] = J[:, :, :3] @ crossing
    return J
