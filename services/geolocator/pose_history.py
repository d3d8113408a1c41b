"""Where the vehicle was when the light hit the sensor."""

from collections import deque
from dataclasses import dataclass

from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.rotation import (
    quaternion_from_rotation_vector,
    quaternion_multiply,
    quaternion_normalised,
    slerp,
)
from alight.runtime.clock import nanoseconds, seconds
from schemas.fix import FixVerdict
from schemas.message import GlobalPosition, Quaternion, Vector3
from schemas.settings.geolocator import FixUncertainty, PoseLookup
from schemas.vehicle import VehicleState
from services.geolocator.refusal import FixRefusedError

_MAX_SAMPLES = 10_000
_UNIT_LENGTH_TOLERANCE = 0.01


@dataclass(frozen=True)
class Pose:
    """The vehicle's pose at one moment, and what finding it cost in certainty."""

    position: GlobalPosition
    q_ned_body: Quaternion
    velocity_ned_mps: Vector3
    angular_velocity_body_rps: Vector3
    offset_s: float
    """The moment minus the newer sample used; positive if extrapolated, seconds."""
    position_sigma_m: float
    """From not knowing the acceleration between samples or beyond them, each axis, metres."""
    attitude_sigma_rad: float
    """From not knowing the angular acceleration, each axis, rad."""
    clock_uncertainty_s: float
    """Of the samples' stamps, seconds."""


class PoseHistory:
    """The newest vehicle states, in order of time."""

    def __init__(self, lookup: PoseLookup, uncertainty: FixUncertainty) -> None:
        self._history_ns = nanoseconds(lookup.history_s)
        self._max_extrapolation_s = lookup.max_extrapolation_s
        self._max_gap_s = lookup.max_gap_s
        self._acceleration_mps2 = uncertainty.acceleration_mps2
        self._angular_acceleration_rps2 = uncertainty.angular_acceleration_rps2
        self._states: deque[VehicleState] = deque(maxlen=_MAX_SAMPLES)

    def add(self, state: VehicleState) -> bool:
        """Take a state.

        Returns:
            False, with nothing taken, if its time is not later than the newest one's or its attitude is no rotation.
        """
        squared_length = sum(component * component for component in state.q_ned_body)
        if abs(squared_length - 1.0) > 2.0 * _UNIT_LENGTH_TOLERANCE:
            return False
        if self._states and state.at_ns <= self._states[-1].at_ns:
            return False
        self._states.append(state)
        while state.at_ns - self._states[0].at_ns > self._history_ns:
            self._states.popleft()
        return True

    def newest_ns(self, otherwise_ns: int) -> int:
        """Time of the newest pose, UTC ns; `otherwise_ns` where there is none."""
        return self._states[-1].at_ns if self._states else otherwise_ns

    def at(self, at_ns: int) -> Pose:
        """The pose at a moment, UTC ns.

        Between neighbours the position goes linearly and the attitude along the shorter arc; beyond the newest sample both
        go on by its velocity and rates.

        Raises:
            FixRefusedError: If the samples do not allow it.
            ValueError: If they lead to no place or rotation.
        """
        if not self._states:
            raise FixRefusedError(FixVerdict.NO_VEHICLE_STATE, "no vehicle pose has come yet")
        newest = self._states[-1]
        if at_ns >= newest.at_ns:
            return self._extrapolated(newest, seconds(at_ns - newest.at_ns))
        later = newest
        for state in reversed(self._states):
            if state.at_ns <= at_ns:
                return self._interpolated(state, later, at_ns)
            later = state
        lack_s = seconds(self._states[0].at_ns - at_ns)
        raise FixRefusedError(FixVerdict.CAPTURE_BEFORE_HISTORY, f"captured {lack_s:.3f} s before the oldest pose kept")

    def _extrapolated(self, newest: VehicleState, ahead_s: float) -> Pose:
        if ahead_s > self._max_extrapolation_s:
            raise FixRefusedError(
                FixVerdict.POSE_TOO_OLD,
                f"captured {ahead_s:.3f} s after the newest pose, at most {self._max_extrapolation_s:g} s",
            )
        q = quaternion_normalised(newest.q_ned_body)
        position = newest.position
        if ahead_s > 0.0:
            vn, ve, vd = newest.velocity_ned_mps
            wx, wy, wz = newest.angular_velocity_body_rps
            position = moved_by_ned(position, (vn * ahead_s, ve * ahead_s, vd * ahead_s))
            turn = quaternion_from_rotation_vector((wx * ahead_s, wy * ahead_s, wz * ahead_s))
            q = quaternion_normalised(quaternion_multiply(q, turn))
        return Pose(
            position=position,
            q_ned_body=q,
            velocity_ned_mps=newest.velocity_ned_mps,
            angular_velocity_body_rps=newest.angular_velocity_body_rps,
            offset_s=ahead_s,
            position_sigma_m=0.5 * self._acceleration_mps2 * ahead_s**2,
            attitude_sigma_rad=0.5 * self._angular_acceleration_rps2 * ahead_s**2,
            clock_uncertainty_s=newest.clock_uncertainty_s,
        )

    def _interpolated(self, earlier: VehicleState, later: VehicleState, at_ns: int) -> Pose:
        gap_s, since_s = seconds(later.at_ns - earlier.at_ns), seconds(at_ns - earlier.at_ns)
        if gap_s > self._max_gap_s and since_s > 0.0:
            raise FixRefusedError(
                FixVerdict.POSE_GAP,
                f"the poses around the capture are {gap_s:.3f} s apart, at most {self._max_gap_s:g} s",
            )
        fraction = since_s / gap_s
        north, east, down = ned_between(earlier.position, later.position).tolist()
        # Neglecting a constant acceleration a between two samples costs a * t0 * t1 / 2.
        neglected_s2 = 0.5 * since_s * (gap_s - since_s)
        return Pose(
            position=moved_by_ned(earlier.position, (north * fraction, east * fraction, down * fraction)),
            q_ned_body=slerp(
                quaternion_normalised(earlier.q_ned_body), quaternion_normalised(later.q_ned_body), fraction
            ),
            velocity_ned_mps=_blend(earlier.velocity_ned_mps, later.velocity_ned_mps, fraction),
            angular_velocity_body_rps=_blend(
                earlier.angular_velocity_body_rps, later.angular_velocity_body_rps, fraction
            ),
            offset_s=since_s - gap_s,
            position_sigma_m=self._acceleration_mps2 * neglected_s2,
            attitude_sigma_rad=self._angular_acceleration_rps2 * neglected_s2,
            clock_uncertainty_s=max(earlier.clock_uncertainty_s, later.clock_uncertainty_s),
        )


def _blend(a: Vector3, b: Vector3, fraction: float) -> Vector3:
    (ax, ay, az), (bx, by, bz) = a, b
    return (ax + (bx - ax) * fraction, ay + (by - ay) * fraction, az + (bz - az) * fraction)
