"""How sure a fix is: first-order covariance through the chain of Eq. 1."""

import math
from dataclasses import dataclass

import numpy as np

from alight.geometry.rotation import Matrix, R_from_quaternion, rotated
from schemas.calibration import CameraCalibration
from schemas.detection import MarkerPose
from schemas.fix import FixVerdict
from schemas.message import Matrix3, Matrix6, Vector3
from schemas.settings.geolocator import FixUncertainty
from services.geolocator.refusal import FixRefusedError
from services.geolocator.view import View

_SYMMETRY_TOLERANCE = 1e-6
_MAX_VARIANCE = 1e8


@dataclass(frozen=True)
class FixCovariance:
    """Uncertainty of a fix."""

    position_ned_m2: Matrix3
    """Of the vehicle-to-pad vector as a place in the navigation solution, north, east, down, m^2."""
    azimuth_rad2: float
    """Of the pad's azimuth, rad^2."""


def fix_covariance(
    pose: MarkerPose,
    view: View,
    pad_ned_m: Vector3,
    calibration: CameraCalibration,
    uncertainty: FixUncertainty,
) -> FixCovariance:
    """Corners, lens, attitude and mount, timing and position, as independent contributions.

    The systematic correction (Eq. 24) changes lengths by a few per cent; its Jacobian is taken as the identity.

    Raises:
        FixRefusedError: BAD_COVARIANCE if the pose's covariance is not symmetric positive definite.
    """
    C = _checked(pose.covariance)
    R, vehicle = R_from_quaternion(view.q_ned_camera), view.vehicle
    depth_m = pose.position_camera_m[2]
    lens = C[:3, :3].copy()
    lens[0, 0] += (uncertainty.principal_point_px * depth_m / calibration.fx_px) ** 2
    lens[1, 1] += (uncertainty.principal_point_px * depth_m / calibration.fy_px) ** 2
    lens[2, 2] += (uncertainty.focal_fraction * depth_m) ** 2
    tilt_variance = math.radians(uncertainty.roll_pitch_deg) ** 2 + vehicle.attitude_sigma_rad**2
    yaw_variance = math.radians(uncertainty.yaw_deg) ** 2 + vehicle.attitude_sigma_rad**2
    rate_ned = rotated(vehicle.q_ned_body, vehicle.angular_velocity_body_rps)
    time_variance = uncertainty.time_s**2 + vehicle.clock_uncertainty_s**2
    total = R @ lens @ R.T
    total += _from_attitude(pad_ned_m, tilt_variance, yaw_variance)
    total += _from_timing(pad_ned_m, vehicle.velocity_ned_mps, rate_ned, time_variance)
    total[np.diag_indices(3)] += uncertainty.position_m**2 + vehicle.position_sigma_m**2
    down_in_camera = R[2]
    azimuth_variance = (
        float(down_in_camera @ C[3:, 3:] @ down_in_camera) + yaw_variance + rate_ned[2] ** 2 * time_variance
    )
    return FixCovariance(tuple(total.ravel().tolist()), azimuth_variance)


def _checked(covariance: Matrix6) -> Matrix:
    C = np.array(covariance).reshape(6, 6)
    scale = np.abs(C).max()
    if scale > _MAX_VARIANCE or np.abs(C - C.T).max() > _SYMMETRY_TOLERANCE * scale:
        raise FixRefusedError(FixVerdict.BAD_COVARIANCE, "the pose's covariance is huge or not symmetric")
    try:
        np.linalg.cholesky(C)
    except np.linalg.LinAlgError:
        raise FixRefusedError(FixVerdict.BAD_COVARIANCE, "the pose's covariance is not positive definite") from None
    return C


def _from_attitude(pad_ned_m: Vector3, tilt_variance: float, yaw_variance: float) -> Matrix:
    """Covariance of rotation x vector for independent small rotations about north, east and down."""
    n, e, d = pad_ned_m
    ne, nd, ed = -yaw_variance * n * e, -tilt_variance * n * d, -tilt_variance * e * d
    nn = tilt_variance * d * d + yaw_variance * e * e
    ee = tilt_variance * d * d + yaw_variance * n * n
    return np.array([[nn, ne, nd], [ne, ee, ed], [nd, ed, tilt_variance * (n * n + e * e)]])


def _from_timing(pad_ned_m: Vector3, velocity_mps: Vector3, rate_ned_rps: Vector3, time_variance: float) -> Matrix:
    """A pose that is late by dt misplaces the pad by dt (velocity + rate x vector)."""
    (n, e, d), (p, q, r) = pad_ned_m, rate_ned_rps
    slip = np.add(velocity_mps, (q * d - r * e, r * n - p * d, p * e - q * n))
    return np.asarray(time_variance * np.outer(slip, slip))
