"""One detection brought to the earth: the chain of Eq. 1-2 at capture time."""

import math

from alight.geometry.azimuth import pad_azimuth
from alight.geometry.local import moved_by_ned
from alight.geometry.rotation import quaternion_multiply, quaternion_normalised
from schemas.calibration import CameraCalibration
from schemas.detection import Detection, PadView
from schemas.fix import FixVerdict, PadFix, PadPosition
from schemas.message import Vector3
from schemas.settings.geolocator import Correction, GeolocatorSettings
from services.geolocator.correction import corrected_azimuth, corrected_vector
from services.geolocator.covariance import fix_covariance
from services.geolocator.installation import true_position
from services.geolocator.planar import PlanarSolution, choose
from services.geolocator.pose_history import Pose
from services.geolocator.refusal import FixRefusedError
from services.geolocator.view import View


def geolocate(
    detection: Detection,
    pad: PadView,
    believed: View,
    true: View,
    calibration: CameraCalibration,
    settings: GeolocatorSettings,
    *,
    now_ns: int,
) -> PadFix:
    """The fix.

    Args:
        detection: What the fix descends from.
        pad: The pad in it.
        believed: The vehicle's pose and the camera's mount at capture time.
        true: The same with all that an extrinsic correction knows of them; otherwise the same again.
        calibration: The camera's.
        settings: The geolocator's.
        now_ns: For the latency, UTC ns.

    Raises:
        FixRefusedError: With the verdict.
        ValueError: If the arithmetic ends in NaN, infinity, no rotation or no place.
    """
    vehicle = true.vehicle
    attitude_sigma_rad = math.hypot(math.radians(settings.uncertainty.roll_pitch_deg), vehicle.attitude_sigma_rad)
    max_tilt_rad = math.radians(settings.level.max_pad_tilt_deg)
    solution = choose(pad, true.q_ned_camera, max_tilt_rad, attitude_sigma_rad)
    raw, corrected = _raw_and_corrected(solution, believed, true, settings.correction)
    covariance = fix_covariance(
        solution.pose, true, corrected.pad_ned_m, calibration, settings.uncertainty, pad.extent_px
    )
    return PadFix(
        captured_at_ns=detection.captured_at_ns,
        hops=detection.hops,
        verdict=FixVerdict.ACCEPTED,
        detail=_account(pad, solution, vehicle),
        raw=raw,
        corrected=corrected,
        covariance_ned_m2=covariance.position_ned_m2,
        azimuth_variance_rad2=covariance.azimuth_rad2,
        noise_covariance_ned_m2=covariance.noise_ned_m2,
        azimuth_noise_rad2=covariance.azimuth_noise_rad2,
        shared=covariance.shared,
        vehicle_position=vehicle.position,
        pose_offset_s=vehicle.offset_s,
        latency_s=(now_ns - detection.captured_at_ns) * 1e-9,
    )


def _raw_and_corrected(
    solution: PlanarSolution, believed: View, true: View, correction: Correction
) -> tuple[PadPosition, PadPosition]:
    position_camera_m = solution.pose.position_camera_m
    raw = _placed(believed, believed.ned_of(position_camera_m), solution)
    if correction.method == "none":
        return raw, raw
    if correction.method == "extrinsic":
        return raw, _placed(true, true.ned_of(true_position(position_camera_m, correction.extrinsic)), solution)
    pad_ned_m = corrected_vector(raw.pad_ned_m, correction)
    position = moved_by_ned(believed.vehicle.position, pad_ned_m)
    azimuth_rad = corrected_azimuth(raw.azimuth_rad, correction)
    return raw, PadPosition(pad_ned_m=pad_ned_m, position=position, azimuth_rad=azimuth_rad)


def _placed(view: View, pad_ned_m: Vector3, solution: PlanarSolution) -> PadPosition:
    if not all(map(math.isfinite, pad_ned_m)):
        raise ValueError(f"vehicle-to-pad vector {pad_ned_m}")
    if pad_ned_m[2] <= 0.0:
        raise FixRefusedError(FixVerdict.ABOVE_VEHICLE, f"the pad would be {-pad_ned_m[2]:.2f} m above the vehicle")
    q_ned_marker = quaternion_multiply(view.q_ned_camera, quaternion_normalised(solution.pose.q_camera_marker))
    return PadPosition(
        pad_ned_m=pad_ned_m,
        position=moved_by_ned(view.vehicle.position, pad_ned_m),
        azimuth_rad=pad_azimuth(q_ned_marker),
    )


def _account(pad: PadView, solution: PlanarSolution, vehicle: Pose) -> str:
    number = pad.poses.index(solution.pose) + 1
    return (
        f"solution {number} of {len(pad.poses)}, tilt {math.degrees(solution.tilt_rad):.1f} of at most "
        f"{math.degrees(solution.allowed_tilt_rad):.1f} deg, pose {'extrapolated' if vehicle.offset_s > 0.0 else 'interpolated'}"
    )
