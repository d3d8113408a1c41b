"""How sure a fix is: first-order covariance through the chain of Eq. 1."""

import math
from dataclasses import dataclass

import numpy as np

from alight.geometry.rotation import Matrix, R_from_quaternion, rotated
from schemas.calibration import CameraCalibration
from schemas.detection import MarkerPose
from schemas.fix import FixVerdict, SharedErrors
from schemas.message import Matrix3, Matrix6, Vector3
from schemas.settings.geolocator import FixUncertainty
from services.geolocator.refusal import FixRefusedError
from services.geolocator.view import View

_SYMMETRY_TOLERANCE = 1e-6
_MAX_VARIANCE = 1e8
_DIAGONAL = np.diag_indices(3)
_NAMES = (
    "tilt_north_ned_m",
    "tilt_east_ned_m",
    "heading_ned_m",
    "range_ned_m",
    "principal_x_ned_m",
    "principal_y_ned_m",
    "size_ned_m",
    "timing_ned_m",
)


@dataclass(frozen=True)
class FixCovariance:
    """Uncertainty of a fix: position = noise + outer products of what is shared + that of the vehicle's coordinates."""

    position_ned_m2: Matrix3
    """Of the vehicle-to-pad vector as a place in the navigation solution, north, east, down, m^2."""
    noise_ned_m2: Matrix3
    """The part that is new in each fix, of the vector itself, m^2."""
    shared: SharedErrors
    """The part that neighbouring fixes have in common."""
    azimuth_rad2: float
    """Of the pad's azimuth, rad^2."""
    azimuth_noise_rad2: float
    """The part of it that is new in each fix, rad^2."""


def fix_covariance(
    pose: MarkerPose,
    view: View,
    pad_ned_m: Vector3,
    calibration: CameraCalibration,
    uncertainty: FixUncertainty,
    extent_px: float,
) -> FixCovariance:
    """Corners, lens, attitude and mount, timing and position, as independent contributions.

    Args:
        pose: The pad's, by the detector.
        view: From where it was seen.
        pad_ned_m: The vector that the covariance is for.
        calibration: The camera's.
        uncertainty: Standard deviations behind it.
        extent_px: How large the pad is in the picture.

    The systematic correction (Eq. 24) changes lengths by a few per cent; its Jacobian is taken as the identity.

    Raises:
        FixRefusedError: BAD_COVARIANCE if the pose's covariance is not symmetric positive definite.
    """
    C = _checked(pose.covariance)
    R, vehicle = R_from_quaternion(view.q_ned_camera), view.vehicle
    rate_ned = rotated(vehicle.q_ned_body, vehicle.angular_velocity_body_rps)
    time_sigma_s = math.hypot(uncertainty.time_s, vehicle.clock_uncertainty_s)
    unknown_turn2 = vehicle.attitude_sigma_rad**2
    noise = R @ C[:3, :3] @ R.T + _from_attitude(pad_ned_m, unknown_turn2)
    noise[_DIAGONAL] += vehicle.position_sigma_m**2
    displacements = _displacements(R, pose.position_camera_m[2], pad_ned_m, calibration, uncertainty)
    along_axis = uncertainty.pad_size_px / extent_px * pose.position_camera_m[2]
    displacements.append((R[0, 2] * along_axis, R[1, 2] * along_axis, R[2, 2] * along_axis))
    displacements.append(_slip(pad_ned_m, vehicle.velocity_ned_mps, rate_ned, time_sigma_s))
    J = np.array(displacements)
    total = noise + J.T @ J
    total[_DIAGONAL] += uncertainty.position_m**2
    down_in_camera = R[2]
    azimuth_noise = float(down_in_camera @ C[3:, 3:] @ down_in_camera) + unknown_turn2
    azimuth_noise += (rate_ned[2] * time_sigma_s) ** 2
    heading_rad = math.radians(uncertainty.yaw_deg)
    return FixCovariance(
        position_ned_m2=tuple(total.ravel().tolist()),
        noise_ned_m2=tuple(noise.ravel().tolist()),
        shared=SharedErrors(**dict(zip(_NAMES, displacements, strict=True)), heading_rad=heading_rad),
        azimuth_rad2=azimuth_noise + heading_rad**2,
        azimuth_noise_rad2=azimuth_noise,
    )


def _displacements(
    R: Matrix, depth_m: float, pad_ned_m: Vector3, calibration: CameraCalibration, uncertainty: FixUncertainty
) -> list[Vector3]:
    """Where one sigma of attitude, heading, focal length and principal point puts the pad, in the order of `_NAMES`."""
    n, e, d = pad_ned_m
    tilt, heading = math.radians(uncertainty.roll_pitch_deg), math.radians(uncertainty.yaw_deg)
    across, along, axis = R.T.tolist()
    x = uncertainty.principal_point_px * depth_m / calibration.fx_px
    y = uncertainty.principal_point_px * depth_m / calibration.fy_px
    z = uncertainty.focal_fraction * depth_m
    return [
        (0.0, -tilt * d, tilt * e),
        (tilt * d, 0.0, -tilt * n),
        (-heading * e, heading * n, 0.0),
        (axis[0] * z, axis[1] * z, axis[2] * z),
        (across[0] * x, across[1] * x, across[2] * x),
        (along[0] * y, along[1] * y, along[2] * y),
    ]


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


def _from_attitude(pad_ned_m: Vector3, variance: float) -> Matrix:
    """Covariance of rotation x vector for a small rotation of that variance about each axis: variance (|v|^2 I - v v^T)."""
    v = np.array(pad_ned_m)
    return np.asarray(variance * (v @ v * np.eye(3) - np.outer(v, v)))


def _slip(pad_ned_m: Vector3, velocity_mps: Vector3, rate_ned_rps: Vector3, time_s: float) -> Vector3:
    """A pose that is late by dt misplaces the pad by dt (velocity + rate x vector)."""
    (n, e, d), (p, q, r), (vn, ve, vd) = pad_ned_m, rate_ned_rps, velocity_mps
    return (time_s * (vn + q * d - r * e), time_s * (ve + r * n - p * d), time_s * (vd + p * e - q * n))
