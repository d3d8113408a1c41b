"""What the system knows of the pad before it looks: attitude, height and place at capture time, from what others have said."""

import math
from collections import deque
from dataclasses import replace
from itertools import pairwise

import numpy as np

from alight.geometry.camera import PinholeCamera
from alight.geometry.frames import camera_from_ned, q_body_camera
from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.rotation import (
    quaternion_from_euler,
    quaternion_from_rotation_vector,
    quaternion_multiply,
    quaternion_normalised,
    slerp,
)
from alight.runtime.clock import seconds
from schemas.estimate import PadEstimate
from schemas.message import GlobalPosition, Quaternion, Vector3
from schemas.settings.geolocator import Mount
from schemas.vehicle import GimbalState, LandedState, VehicleState, VehicleStatus
from services.detector.detector import Prior

_MOST_STATES = 128
_LARGEST_GAP_S = 0.3
_LARGEST_EXTRAPOLATION_S = 0.2
_GIMBAL_MAX_AGE_S = 0.5
_STATUS_MAX_AGE_S = 2.0
_ESTIMATE_MAX_AGE_S = 3.0
_ATTITUDE_SIGMA_RAD = math.radians(1.5)
"""Of attitude, mount and the pad's levelness together."""
_YAW_SIGMA_RAD = math.radians(3.0)
_POSITION_SIGMA_M = 0.3
_DRIFT_SIGMA_MPS = 0.3
"""How the vehicle's own position wanders against the time of the estimate."""
_LEAST_HEIGHT_M = 0.2
_LARGEST_SIGMA_PART = 0.5
"""A height whose standard deviation is a larger part of it tells only how high the camera hardly is."""
_HIGH_SIGMAS = 2.0
_STANDING_HEIGHT_M = 0.5
"""How high the camera of a vehicle that stands on the ground hardly is."""


class PriorKeeper:
    """Takes what comes, and says what follows from it for the time of a frame. What is stale or nonsense gives no prior."""

    def __init__(self, mount: Mount) -> None:
        """Take the camera's mount, which rules where no gimbal reports."""
        self._misalignment = _from_degrees(
            mount.misalignment_roll_deg, mount.misalignment_pitch_deg, mount.misalignment_yaw_deg
        )
        nominal = _from_degrees(mount.roll_deg, mount.pitch_deg, mount.yaw_deg)
        self._fixed = quaternion_multiply(self._misalignment, nominal)
        self._camera_in_body_m: Vector3 = (mount.forward_m, mount.right_m, mount.down_m)
        self._states: deque[VehicleState] = deque(maxlen=_MOST_STATES)
        self._gimbal: GimbalState | None = None
        self._estimate: PadEstimate | None = None
        self._standing_at_ns: int | None = None

    def add_state(self, state: VehicleState) -> None:
        """Take the vehicle's pose, unless it is older than the newest."""
        if not self._states or state.at_ns > self._states[-1].at_ns:
            self._states.append(state)

    def add_gimbal(self, state: GimbalState) -> None:
        """Take the gimbal's angles, if they were measured."""
        if state.measured:
            self._gimbal = state

    def add_estimate(self, estimate: PadEstimate) -> None:
        """Take the pad's place."""
        self._estimate = estimate

    def add_status(self, status: VehicleStatus) -> None:
        """Take whether the vehicle stands on the ground."""
        stands = status.connected and status.landed_state is LandedState.ON_GROUND
        self._standing_at_ns = status.at_ns if stands else None

    def stands_at(self, captured_at_ns: int) -> bool:
        """Whether the autopilot says that the vehicle stood on the ground at a time. What it said too long ago says nothing."""
        standing_at_ns = self._standing_at_ns
        return standing_at_ns is not None and abs(seconds(captured_at_ns - standing_at_ns)) <= _STATUS_MAX_AGE_S

    def at(self, captured_at_ns: int, camera: PinholeCamera) -> Prior | None:
        """What is known for a frame; None if not even the attitude is."""
        try:
            return self._prior(captured_at_ns, camera)
        except (ValueError, ArithmeticError):
            return None

    def _prior(self, at_ns: int, camera: PinholeCamera) -> Prior | None:
        pose = self._pose(at_ns)
        q_body_gimbal = self._q_body_gimbal(at_ns)
        if pose is None or q_body_gimbal is None:
            return None
        position, q_ned_body = pose
        attitude = Prior(
            q_ned_camera=quaternion_multiply(q_ned_body, q_body_camera(q_body_gimbal)),
            attitude_sigma_rad=_ATTITUDE_SIGMA_RAD,
        )
        if self.stands_at(at_ns):
            return replace(attitude, height_at_most_m=_STANDING_HEIGHT_M)
        estimate = self._estimate
        if estimate is None or at_ns < estimate.captured_at_ns:
            return attitude
        pad_ned_m = ned_between(position, estimate.position)
        seen_m = camera_from_ned(pad_ned_m, q_ned_body, q_body_gimbal, self._camera_in_body_m)
        return _with_place(attitude, estimate, seen_m, camera, seconds(at_ns - estimate.captured_at_ns))

    def _pose(self, at_ns: int) -> tuple[GlobalPosition, Quaternion] | None:
        if not self._states:
            return None
        newest = self._states[-1]
        if at_ns >= newest.at_ns:
            return _extrapolated(newest, seconds(at_ns - newest.at_ns))
        for later, earlier in pairwise(reversed(self._states)):
            if earlier.at_ns <= at_ns:
                return _interpolated(earlier, later, at_ns)
        return None

    def _q_body_gimbal(self, at_ns: int) -> Quaternion | None:
        """Once a gimbal has reported, its silence is no fixed mount."""
        if self._gimbal is None:
            return self._fixed
        if abs(seconds(at_ns - self._gimbal.at_ns)) > _GIMBAL_MAX_AGE_S:
            return None
        return quaternion_multiply(self._misalignment, quaternion_normalised(self._gimbal.q_body_gimbal))


def _with_place(attitude: Prior, estimate: PadEstimate, seen_m: Vector3, camera: PinholeCamera, age_s: float) -> Prior:
    """The attitude with what the estimate adds, as far as that makes sense."""
    covariance = np.array(estimate.covariance_ned_m2).reshape(3, 3)
    wander_m = _POSITION_SIGMA_M + _DRIFT_SIGMA_MPS * age_s
    across_m = math.sqrt(max(float(covariance[0, 0]), float(covariance[1, 1]), 0.0) + wander_m**2)
    height_sigma_m = math.sqrt(max(float(covariance[2, 2]), 0.0) + wander_m**2)
    if attitude.q_ned_camera is None:
        return attitude
    height_m = _down_of(attitude.q_ned_camera, seen_m)
    vague = height_m < _LEAST_HEIGHT_M or height_sigma_m > _LARGEST_SIGMA_PART * height_m
    if vague or age_s > _ESTIMATE_MAX_AGE_S:
        highest_m = height_m + _HIGH_SIGMAS * height_sigma_m
        return replace(attitude, height_at_most_m=highest_m) if highest_m > 0.0 else attitude
    centre_px, sigma_px = None, 0.0
    if seen_m[2] > 0.0:
        x, y = camera.project(np.array([seen_m]))[0].tolist()
        distance_m = math.sqrt(sum(value**2 for value in seen_m))
        sigma_rad = math.hypot(across_m / distance_m, _ATTITUDE_SIGMA_RAD)
        if math.isfinite(x) and math.isfinite(y):
            centre_px, sigma_px = (x, y), camera.fx_px * sigma_rad * (distance_m / seen_m[2]) ** 2
    return Prior(
        height_m=height_m,
        height_sigma_m=height_sigma_m,
        q_ned_camera=attitude.q_ned_camera,
        attitude_sigma_rad=attitude.attitude_sigma_rad,
        centre_px=centre_px,
        centre_sigma_px=sigma_px,
        azimuth_rad=estimate.azimuth_rad,
        azimuth_sigma_rad=math.hypot(math.sqrt(estimate.azimuth_variance_rad2), _YAW_SIGMA_RAD),
    )


def _down_of(q_ned_camera: Quaternion, p_camera_m: Vector3) -> float:
    w, x, y, z = q_ned_camera
    row = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    return sum(r * p for r, p in zip(row, p_camera_m, strict=True))


def _extrapolated(state: VehicleState, ahead_s: float) -> tuple[GlobalPosition, Quaternion] | None:
    if ahead_s > _LARGEST_EXTRAPOLATION_S:
        return None
    vn, ve, vd = (value * ahead_s for value in state.velocity_ned_mps)
    wx, wy, wz = (value * ahead_s for value in state.angular_velocity_body_rps)
    turned = quaternion_multiply(quaternion_normalised(state.q_ned_body), quaternion_from_rotation_vector((wx, wy, wz)))
    return moved_by_ned(state.position, (vn, ve, vd)), turned


def _interpolated(earlier: VehicleState, later: VehicleState, at_ns: int) -> tuple[GlobalPosition, Quaternion] | None:
    gap_s = seconds(later.at_ns - earlier.at_ns)
    if gap_s > _LARGEST_GAP_S:
        return None
    part = seconds(at_ns - earlier.at_ns) / gap_s
    north, east, down = (value * part for value in ned_between(earlier.position, later.position).tolist())
    q = slerp(quaternion_normalised(earlier.q_ned_body), quaternion_normalised(later.q_ned_body), part)
    return moved_by_ned(earlier.position, (north, east, down)), q


def _from_degrees(roll_deg: float, pitch_deg: float, yaw_deg: float) -> Quaternion:
    return quaternion_from_euler(math.radians(roll_deg), math.radians(pitch_deg), math.radians(yaw_deg))
