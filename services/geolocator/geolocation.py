"""One detection brought to the earth: the chain of Eq. 1-2 at capture time."""

import math
from collections.abc import Iterator

from alight.geometry.azimuth import pad_azimuth
from alight.geometry.rotation import quaternion_multiply, quaternion_normalised, rotated
from schemas.calibration import CameraCalibration
from schemas.detection import Detection, PadView
from schemas.fix import FixInput, FixVerdict, PadFix, PadPosition
from schemas.message import Vector3
from schemas.settings.geolocator import GeolocatorSettings
from services.geolocator.correction import corrected_azimuth, corrected_vector, correction_jacobian
from services.geolocator.covariance import ErrorModel, Spread
from services.geolocator.installation import Installation
from services.geolocator.pad_attitude import AttitudeAid, Lie, PadAttitude
from services.geolocator.pad_height import PadHeight
from services.geolocator.planar import PlanarSolution, choose
from services.geolocator.refusal import FixRefusedError
from services.geolocator.view import View


class Geolocation:
    """The chain, with what of it the settings fix."""

    def __init__(self, settings: GeolocatorSettings) -> None:
        self._method = settings.method
        self._height = PadHeight(settings)
        self._correction = settings.correction
        self._position_sigma_m = settings.uncertainty.position_m
        self.attitude = PadAttitude(settings)
        """What the pad tells of the attitude, where its lie is surveyed."""
        self._max_pad_tilt_rad = math.radians(settings.level.max_pad_tilt_deg)
        extrinsic = settings.correction.method == "extrinsic"
        self.installation = Installation(settings.correction.extrinsic) if extrinsic else None
        """What an extrinsic correction knows of the camera; None without one."""
        self._errors = (
            ErrorModel(settings.uncertainty)
            if self.installation is None
            else ErrorModel(settings.uncertainty, self.installation.scale)
        )

    def fix(
        self,
        detection: Detection,
        pad: PadView,
        believed: View,
        true: View,
        calibration: CameraCalibration,
        *,
        now_ns: int,
    ) -> PadFix:
        """The fix.

        Args:
            detection: What the fix descends from.
            pad: The pad in it.
            believed: The vehicle's pose and the camera's at capture time.
            true: The same with all that an extrinsic correction knows of them; otherwise the same again.
            calibration: The camera's.
            now_ns: For the latency, UTC ns.

        Raises:
            FixRefusedError: With the verdict.
            ValueError: If the arithmetic ends in NaN, infinity, no rotation or no place.
        """
        vehicle = true.vehicle
        solution = choose(
            pad, true, self._max_pad_tilt_rad, math.hypot(self._errors.tilt_rad, vehicle.attitude_sigma_rad)
        )
        raw = _placed(believed, believed.ned_of(solution.pose.position_camera_m), solution)
        aid = self._aid(solution, true, detection.captured_at_ns) if self.attitude.is_surveyed else None
        if aid is not None:
            true, solution = _righted(true, solution, aid)
            vehicle = true.vehicle
        corrected_m, azimuth_rad, spread = self._corrected(raw, pad, solution, true, calibration, aid)
        sighted = self._height.applied(corrected_m, spread, true)
        corrected = raw if sighted.pad_ned_m is raw.pad_ned_m else _at(true, sighted.pad_ned_m, azimuth_rad)
        azimuth_noise_rad2 = self._errors.azimuth_noise_rad2(solution.pose, true)
        heading_rad = self._errors.heading_rad if aid is None else aid.heading_rad[2]
        return PadFix(
            captured_at_ns=detection.captured_at_ns,
            hops=detection.hops,
            verdict=FixVerdict.ACCEPTED,
            detail=_account(pad, solution) + sighted.remark,
            method=self._method,
            inputs=(*sighted.inputs, *self._inputs(pad, solution, true), *(aid.inputs if aid is not None else ())),
            raw=raw,
            corrected=corrected,
            covariance_ned_m2=sighted.spread.total_m2(self._position_sigma_m),
            azimuth_variance_rad2=azimuth_noise_rad2 + heading_rad**2,
            noise_covariance_ned_m2=sighted.spread.noise_m2,
            azimuth_noise_rad2=azimuth_noise_rad2,
            shared=self._errors.shared_errors(sighted.spread, heading_rad),
            vehicle_position=vehicle.position,
            pose_offset_s=vehicle.offset_s,
            latency_s=(now_ns - detection.captured_at_ns) * 1e-9,
        )

    def _aid(self, solution: PlanarSolution, true: View, captured_at_ns: int) -> AttitudeAid | None:
        """What this look at the pad tells of the attitude."""
        azimuth_rad = corrected_azimuth(pad_azimuth(solution.q_ned_marker), self._correction)
        noise_rad2 = self._errors.orientation_noise_rad2(solution.pose, true)
        normal_ned = rotated(solution.q_ned_marker, (0.0, 0.0, 1.0))
        return self.attitude.aid(Lie(captured_at_ns, normal_ned, azimuth_rad, noise_rad2))

    def _corrected(
        self,
        raw: PadPosition,
        pad: PadView,
        solution: PlanarSolution,
        true: View,
        calibration: CameraCalibration,
        aid: AttitudeAid | None,
    ) -> tuple[Vector3, float, Spread]:
        """The vector by the picture without its systematic error, the azimuth, and how sure the vector is."""
        seen_m, azimuth_rad = raw.pad_ned_m, raw.azimuth_rad
        if self.installation is not None or aid is not None:
            x, y, z = solution.pose.position_camera_m
            sx, sy, sz = self.installation.scale if self.installation is not None else (1.0, 1.0, 1.0)
            seen_m, azimuth_rad = true.ned_of((sx * x, sy * y, sz * z)), pad_azimuth(solution.q_ned_marker)
            _refuse_above(seen_m)
        spread = self._errors.spread(solution.pose, true, seen_m, calibration, pad.extent_px)
        if aid is not None:
            spread = spread.by_pad(aid, seen_m)
        if self._correction.method == "cylindrical":
            spread = spread.through(correction_jacobian(seen_m, self._correction))
            seen_m = corrected_vector(seen_m, self._correction)
            azimuth_rad = corrected_azimuth(azimuth_rad, self._correction)
        vehicle = true.vehicle
        return seen_m, azimuth_rad, spread.as_place(vehicle, self._errors.time_sigma_s(vehicle))

    def _inputs(self, pad: PadView, solution: PlanarSolution, view: View) -> Iterator[FixInput]:
        if solution.pose is not pad.poses[0]:
            yield FixInput.LEVEL_PRIOR
        yield FixInput.POSE_EXTRAPOLATED if view.vehicle.offset_s > 0.0 else FixInput.POSE_INTERPOLATED
        yield FixInput.GIMBAL if view.by_gimbal else FixInput.FIXED_MOUNT
        if self._correction.method != "none":
            yield FixInput.CORRECTION


def _righted(view: View, solution: PlanarSolution, aid: AttitudeAid) -> tuple[View, PlanarSolution]:
    """View and print with the attitude's error undone."""
    north, east, down = aid.turn_rad
    righted = view.turned((-north, -east, -down))
    q_camera_marker = quaternion_normalised(solution.pose.q_camera_marker)
    return righted, solution._replace(q_ned_marker=quaternion_multiply(righted.q_ned_camera, q_camera_marker))


def _placed(view: View, pad_ned_m: Vector3, solution: PlanarSolution) -> PadPosition:
    _refuse_above(pad_ned_m)
    q_ned_marker = quaternion_multiply(view.q_ned_camera, quaternion_normalised(solution.pose.q_camera_marker))
    return _at(view, pad_ned_m, pad_azimuth(q_ned_marker))


def _at(view: View, pad_ned_m: Vector3, azimuth_rad: float) -> PadPosition:
    if not all(map(math.isfinite, pad_ned_m)):
        raise ValueError(f"vehicle-to-pad vector {pad_ned_m}")
    position = view.vehicle.frame.point_at(*pad_ned_m)
    return PadPosition(pad_ned_m=pad_ned_m, position=position, azimuth_rad=azimuth_rad)


def _refuse_above(pad_ned_m: Vector3) -> None:
    if pad_ned_m[2] <= 0.0:
        raise FixRefusedError(FixVerdict.ABOVE_VEHICLE, f"the pad would be {-pad_ned_m[2]:.2f} m above the vehicle")


def _account(pad: PadView, solution: PlanarSolution) -> str:
    return (
        f"solution {solution.number} of {len(pad.poses)}, tilt {math.degrees(solution.tilt_rad):.1f} of at most "
        f"{math.degrees(solution.allowed_tilt_rad):.1f} deg"
    )
