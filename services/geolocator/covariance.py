"""How sure a fix is: first-order covariance through the chain of Eq. 1, as independent contributions."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from alight.geometry.flat_matrix import Flat3, congruent, is_positive_definite, times
from alight.geometry.rotation import rotated
from schemas.calibration import CameraCalibration
from schemas.detection import MarkerPose
from schemas.fix import FixVerdict, SharedErrors
from schemas.message import Vector3
from schemas.settings.geolocator import FixUncertainty
from services.geolocator.pad_attitude import AttitudeAid
from services.geolocator.pose_history import Pose
from services.geolocator.refusal import FixRefusedError
from services.geolocator.view import View

_SYMMETRY_TOLERANCE = 1e-6
_MAX_VARIANCE = 1e8
_NOTHING = (0.0, 0.0, 0.0)


class Spread(NamedTuple):
    """Where the errors of a fix may have put the pad."""

    noise_m2: Flat3
    """Covariance of the part that is new in each fix, north, east, down, m^2."""
    tilt_north: Vector3
    """Where one standard deviation of each error that neighbouring fixes share puts the pad, metres; see `SharedErrors`."""
    tilt_east: Vector3
    heading: Vector3
    range: Vector3
    principal_x: Vector3
    principal_y: Vector3
    size: Vector3
    timing: Vector3
    mount_roll: Vector3
    mount_pitch: Vector3
    height: Vector3 = (0.0, 0.0, 0.0)

    def through(self, jacobian: Flat3) -> "Spread":
        """What becomes of it in a mapping of the vector that has this Jacobian."""
        noise, *shared = self
        return Spread(congruent(jacobian, noise), *[times(jacobian, one) for one in shared])

    def by_pad(self, aid: AttitudeAid, pad_ned_m: Vector3) -> "Spread":
        """With what is left of the attitude's errors where the pad tells them, those of the mount in it."""
        return self._replace(
            tilt_north=_cross(aid.tilt_north_rad, pad_ned_m),
            tilt_east=_cross(aid.tilt_east_rad, pad_ned_m),
            heading=_cross(aid.heading_rad, pad_ned_m),
            mount_roll=_NOTHING,
            mount_pitch=_NOTHING,
        )

    def as_place(self, vehicle: Pose, time_sigma_s: float) -> "Spread":
        """That of the pad's coordinates instead of the vector's: a vehicle looked for at the wrong time is in another place, too."""
        n, e, d = self.timing
        vn, ve, vd = vehicle.velocity_ned_mps
        slipped = (n + time_sigma_s * vn, e + time_sigma_s * ve, d + time_sigma_s * vd)
        noise = _with_diagonal(self.noise_m2, vehicle.position_sigma_m**2)
        return self._replace(noise_m2=noise, timing=slipped)

    def pulled(self, gain: Vector3, lasting_m: float, quick_m: float) -> "Spread":
        """What becomes of it when the vector is pulled by `gain` (height - down) to a height above the pad.

        Args:
            gain: How far north, east and down for each metre.
            lasting_m: Standard deviation of the height that neighbouring fixes share, metres.
            quick_m: That which is new in each, metres.
        """
        n, e, d = gain
        noise, *shared, _ = self
        quick2 = quick_m**2
        a, b, c, _, f, g, _, _, i = congruent((1.0, 0.0, -n, 0.0, 1.0, -e, 0.0, 0.0, 1.0 - d), noise)
        b, c, g = b + quick2 * n * e, c + quick2 * n * d, g + quick2 * e * d
        pulled = [(x - n * z, y - e * z, z - d * z) for x, y, z in shared]
        pulled.append(_scaled(gain, lasting_m))
        return Spread((a + quick2 * n * n, b, c, b, f + quick2 * e * e, g, c, g, i + quick2 * d * d), *pulled)

    def total_m2(self, position_sigma_m: float) -> Flat3:
        """Noise, all that is shared, and the uncertainty of the vehicle's position, m^2.

        Raises:
            FixRefusedError: BAD_COVARIANCE if that is huge or, by what the arithmetic can tell, no covariance.
        """
        noise, *shared = self
        nn = ne = nd = ee = ed = dd = 0.0
        for n, e, d in shared:
            nn += n * n
            ne += n * e
            nd += n * d
            ee += e * e
            ed += e * d
            dd += d * d
        a, b, c, _, f, g, _, _, i = _with_diagonal(noise, position_sigma_m**2)
        nn, ne, nd, ee, ed, dd = a + nn, b + ne, c + nd, f + ee, g + ed, i + dd
        total = (nn, ne, nd, ne, ee, ed, nd, ed, dd)
        if not max(nn, ee, dd) <= _MAX_VARIANCE or not is_positive_definite(total, 3):
            raise FixRefusedError(FixVerdict.BAD_COVARIANCE, "with all errors of the chain the pad may be anywhere")
        return total


class ErrorModel:
    """The errors of the chain, by their standard deviations."""

    def __init__(self, uncertainty: FixUncertainty, scale: Vector3 = (1.0, 1.0, 1.0)) -> None:
        """Take the settings.

        Args:
            uncertainty: The standard deviations.
            scale: By what places in the camera's frame are multiplied before they are turned to NED.
        """
        self._tilt_rad = math.radians(uncertainty.roll_pitch_deg)
        self._mount_rad = math.radians(uncertainty.mount_roll_pitch_deg)
        self.tilt_rad = math.hypot(self._tilt_rad, self._mount_rad)
        """Of attitude and mount together, about each horizontal axis, rad."""
        self.heading_rad = math.radians(uncertainty.yaw_deg)
        """Of heading and mount, rad."""
        self._time_s = uncertainty.time_s
        self._focal_fraction = uncertainty.focal_fraction
        self._principal_point_px = uncertainty.principal_point_px
        self._pad_size_px = uncertainty.pad_size_px
        self._scale = scale

    def time_sigma_s(self, vehicle: Pose) -> float:
        """Of the capture time against the pose's, seconds."""
        return math.hypot(self._time_s, vehicle.clock_uncertainty_s)

    def spread(
        self, pose: MarkerPose, view: View, pad_ned_m: Vector3, calibration: CameraCalibration, extent_px: float
    ) -> Spread:
        """Corners, lens, attitude and mount, and the turn that a wrong time leads to, of the vector from the vehicle to the pad.

        What `roll_pitch_deg` and `yaw_deg` count in of the mount turns the whole vector, as the attitude does: the lever between vehicle
        and camera is short.

        Args:
            pose: The pad's, by the detector.
            view: From where it was seen.
            pad_ned_m: The vector, before its systematic error is removed.
            calibration: The camera's.
            extent_px: How large the pad is in the picture.

        Raises:
            FixRefusedError: BAD_COVARIANCE if the pose's covariance is not symmetric positive definite.
        """
        C = pose.covariance
        _check(C)
        vehicle, R = view.vehicle, view.R_ned_camera
        sx, sy, sz = self._scale
        across, along, axis = (R[0], R[3], R[6]), (R[1], R[4], R[7]), (R[2], R[5], R[8])
        scaled = (sx * R[0], sy * R[1], sz * R[2], sx * R[3], sy * R[4], sz * R[5], sx * R[6], sy * R[7], sz * R[8])
        corners = congruent(scaled, (C[0], C[1], C[2], C[6], C[7], C[8], C[12], C[13], C[14]))
        depth_m = sz * pose.position_camera_m[2]
        principal_m = self._principal_point_px * depth_m
        n, e, d = pad_ned_m
        tilt, heading = self._tilt_rad, self.heading_rad
        time_s = self.time_sigma_s(vehicle)
        p, q, r = rotated(vehicle.q_ned_body, vehicle.angular_velocity_body_rps)
        mount_roll, mount_pitch = self._mount_tilts(view, pad_ned_m)
        return Spread(
            noise_m2=_with_turn(corners, pad_ned_m, vehicle.attitude_sigma_rad**2),
            tilt_north=(0.0, -tilt * d, tilt * e),
            tilt_east=(tilt * d, 0.0, -tilt * n),
            heading=(-heading * e, heading * n, 0.0),
            range=_scaled(axis, self._focal_fraction * depth_m),
            principal_x=_scaled(across, principal_m / calibration.fx_px),
            principal_y=_scaled(along, principal_m / calibration.fy_px),
            size=_scaled(times(scaled, pose.position_camera_m), self._pad_size_px / extent_px),
            timing=(time_s * (q * d - r * e), time_s * (r * n - p * d), time_s * (p * e - q * n)),
            mount_roll=mount_roll,
            mount_pitch=mount_pitch,
        )

    def _mount_tilts(self, view: View, pad_ned_m: Vector3) -> tuple[Vector3, Vector3]:
        if self._mount_rad == 0.0:
            return _NOTHING, _NOTHING
        (n, e, d), (cn, ce, cd), q_ned_body = pad_ned_m, view.camera_ned_m, view.vehicle.q_ned_body
        from_camera_m = (n - cn, e - ce, d - cd)
        forward, right = rotated(q_ned_body, (1.0, 0.0, 0.0)), rotated(q_ned_body, (0.0, 1.0, 0.0))
        return (
            _scaled(_cross(forward, from_camera_m), self._mount_rad),
            _scaled(_cross(right, from_camera_m), self._mount_rad),
        )

    def azimuth_noise_rad2(self, pose: MarkerPose, view: View) -> float:
        """Variance of the part of the azimuth's error that is new in each fix: corners, the turn between samples, timing."""
        vehicle, C = view.vehicle, pose.covariance
        _, _, _, _, _, _, a, b, c = view.R_ned_camera
        corners = (
            a * (a * C[21] + b * C[22] + c * C[23])
            + b * (a * C[27] + b * C[28] + c * C[29])
            + c * (a * C[33] + b * C[34] + c * C[35])
        )
        rate_down_rps = rotated(vehicle.q_ned_body, vehicle.angular_velocity_body_rps)[2]
        return corners + vehicle.attitude_sigma_rad**2 + (rate_down_rps * self.time_sigma_s(vehicle)) ** 2

    def orientation_noise_rad2(self, pose: MarkerPose, view: View) -> Flat3:
        """Covariance of the small turn about north, east and down by which one look errs on how the print lies: as for the azimuth.

        Raises:
            FixRefusedError: BAD_COVARIANCE if the pose's covariance is not symmetric positive definite.
        """
        vehicle, C = view.vehicle, pose.covariance
        _check(C)
        turned = congruent(view.R_ned_camera, (C[21], C[22], C[23], C[27], C[28], C[29], C[33], C[34], C[35]))
        nn, ne, nd, en, ee, ed, dn, de, dd = _with_diagonal(turned, vehicle.attitude_sigma_rad**2)
        time_s = self.time_sigma_s(vehicle)
        p, q, r = rotated(vehicle.q_ned_body, vehicle.angular_velocity_body_rps)
        return (nn + (p * time_s) ** 2, ne, nd, en, ee + (q * time_s) ** 2, ed, dn, de, dd + (r * time_s) ** 2)

    def shared_errors(self, spread: Spread, heading_rad: float) -> SharedErrors:
        """The form in which what is shared travels; `heading_rad` is that of the heading, one standard deviation."""
        return SharedErrors(
            tilt_north_ned_m=spread.tilt_north,
            tilt_east_ned_m=spread.tilt_east,
            heading_ned_m=spread.heading,
            range_ned_m=spread.range,
            principal_x_ned_m=spread.principal_x,
            principal_y_ned_m=spread.principal_y,
            size_ned_m=spread.size,
            timing_ned_m=spread.timing,
            height_ned_m=spread.height,
            mount_roll_ned_m=spread.mount_roll,
            mount_pitch_ned_m=spread.mount_pitch,
            heading_rad=heading_rad,
        )


def _check(C: Sequence[float]) -> None:
    """Refuse a 6x6 matrix that is no covariance."""
    largest = max(C[0], C[7], C[14], C[21], C[28], C[35])
    if not largest <= _MAX_VARIANCE or not _is_symmetric(C, _SYMMETRY_TOLERANCE * largest):
        raise FixRefusedError(FixVerdict.BAD_COVARIANCE, "the pose's covariance is huge or not symmetric")
    if not is_positive_definite(C, 6):
        raise FixRefusedError(FixVerdict.BAD_COVARIANCE, "the pose's covariance is not positive definite")


def _is_symmetric(C: Sequence[float], tolerance: float) -> bool:
    for i in range(5):
        row, column = C[7 * i + 1 : 6 * i + 6], C[7 * i + 6 :: 6]
        if row != column and not all(abs(a - b) <= tolerance for a, b in zip(row, column, strict=True)):
            return False
    return True


def _with_turn(C: Flat3, v: Vector3, variance: float) -> Flat3:
    """Plus the covariance of rotation x v for a small rotation of that variance about each axis: variance (|v|^2 I - v v^T)."""
    if variance == 0.0:
        return C
    nn, ne, nd, en, ee, ed, dn, de, dd = C
    n, e, d = v
    vn, ve, vd = variance * n, variance * e, variance * d
    return (
        nn + ve * e + vd * d, ne - vn * e, nd - vn * d,
        en - vn * e, ee + vn * n + vd * d, ed - ve * d,
        dn - vn * d, de - ve * d, dd + vn * n + ve * e,
    )  # fmt: skip


def _with_diagonal(C: Flat3, variance: float) -> Flat3:
    nn, ne, nd, en, ee, ed, dn, de, dd = C
    return (nn + variance, ne, nd, en, ee + variance, ed, dn, de, dd + variance)


def _scaled(v: Vector3, factor: float) -> Vector3:
    n, e, d = v
    return (factor * n, factor * e, factor * d)


def _cross(a: Vector3, b: Vector3) -> Vector3:
    (an, ae, ad), (bn, be, bd) = a, b
    return (ae * bd - ad * be, ad * bn - an * bd, an * be - ae * bn)
