"""Where the vehicle was when the light hit the sensor."""

from collections import deque
from typing import NamedTuple

from alight.geometry.local_frame import LocalFrame
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


class Pose(NamedTuple):
    """The vehicle's pose at one moment, and what finding it cost in certainty."""

    frame: LocalFrame
    """North, east, down from the vehicle."""
    q_ned_body: Quaternion
    """Unit quaternion."""
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

    @property
    def position(self) -> GlobalPosition:
        """Of the vehicle."""
        return self.frame.origin


class _Sample(NamedTuple):
    """A state with what every look at it needs, made when it comes and not when a picture waits."""

    at_ns: int
    state: VehicleState
    frame: LocalFrame
    q_ned_body: Quaternion
    """Unit quaternion."""


class PoseHistory:
    """The newest vehicle states, in order of time."""

    def __init__(self, lookup: PoseLookup, uncertainty: FixUncertainty) -> None:
        self._history_ns = nanoseconds(lookup.history_s)
        self._max_extrapolation_s = lookup.max_extrapolation_s
        self._max_gap_s = lookup.max_gap_s
        self._acceleration_mps2 = uncertainty.acceleration_mps2
        self._angular_acceleration_rps2 = uncertainty.angular_acceleration_rps2
        self._samples: deque[_Sample] = deque(maxlen=_MAX_SAMPLES)

    def add(self, state: VehicleState) -> bool:
        """Take a state.

        Returns:
            False, with nothing taken, if its time is not later than the newest one's or its attitude is no rotation.
        """
        squared_length = sum(component * component for component in state.q_ned_body)
        if not abs(squared_length - 1.0) <= 2.0 * _UNIT_LENGTH_TOLERANCE:
            return False
        samples = self._samples
        if samples and state.at_ns <= samples[-1].at_ns:
            return False
        samples.append(_Sample(state.at_ns, state, LocalFrame(state.position), quaternion_normalised(state.q_ned_body)))
        while state.at_ns - samples[0].at_ns > self._history_ns:
            samples.popleft()
        return True

    def newest_ns(self, otherwise_ns: int) -> int:
        """Time of the newest pose, UTC ns; `otherwise_ns` where there is none."""
        return self._samples[-1].at_ns if self._samples else otherwise_ns

    def at(self, at_ns: int) -> Pose:
        """The pose at a moment, UTC ns.

        Between neighbours the position goes linearly and the attitude along the shorter arc; beyond the newest sample both
        go on by its velocity and rates.

        Raises:
            FixRefusedError: If the samples do not allow it.
            ValueError: If they lead to no place or rotation.
        """
        if not self._samples:
            raise FixRefusedError(FixVerdict.NO_VEHICLE_STATE, "no vehicle pose has come yet")
        newest = self._samples[-1]
        if at_ns >= newest.at_ns:
            return self._extrapolated(newest, seconds(at_ns - newest.at_ns))
        later = newest
        for sample in reversed(self._samples):
            if sample.at_ns <= at_ns:
                return self._interpolated(sample, later, at_ns)
            later = sample
        lack_s = seconds(self._samples[0].at_ns - at_ns)
        raise FixRefusedError(FixVerdict.CAPTURE_BEFORE_HISTORY, f"captured {lack_s:.3f} s before the oldest pose kept")

    def _extrapolated(self, newest: _Sample, ahead_s: float) -> Pose:
        if ahead_s > self._max_extrapolation_s:
            raise FixRefusedError(
                FixVerdict.POSE_TOO_OLD,
                f"captured {ahead_s:.3f} s after the newest pose, at most {self._max_extrapolation_s:g} s",
            )
        state, frame, q = newest.state, newest.frame, newest.q_ned_body
        if ahead_s > 0.0:
            vn, ve, vd = state.velocity_ned_mps
            wx, wy, wz = state.angular_velocity_body_rps
            frame = LocalFrame(frame.point_at(vn * ahead_s, ve * ahead_s, vd * ahead_s))
            turn = quaternion_from_rotation_vector((wx * ahead_s, wy * ahead_s, wz * ahead_s))
            q = quaternion_normalised(quaternion_multiply(q, turn))
        return Pose(
            frame=frame,
            q_ned_body=q,
            velocity_ned_mps=state.velocity_ned_mps,
            angular_velocity_body_rps=state.angular_velocity_body_rps,
            offset_s=ahead_s,
            position_sigma_m=0.5 * self._acceleration_mps2 * ahead_s**2,
            attitude_sigma_rad=0.5 * self._angular_acceleration_rps2 * ahead_s**2,
            clock_uncertainty_s=state.clock_uncertainty_s,
        )

    def _interpolated(self, earlier: _Sample, later: _Sample, at_ns: int) -> Pose:
        gap_s, since_s = seconds(later.at_ns - earlier.at_ns), seconds(at_ns - earlier.at_ns)
        if gap_s > self._max_gap_s and since_s > 0.0:
            raise FixRefusedError(
                FixVerdict.POSE_GAP,
                f"the poses around the capture are {gap_s:.3f} s apart, at most {self._max_gap_s:g} s",
            )
        fraction = since_s / gap_s
        before, after = earlier.state, later.state
        north, east, down = earlier.frame.ned_of(after.position)
        # Neglecting a constant acceleration a between two samples costs a * t0 * t1 / 2.
        neglected_s2 = 0.5 * since_s * (gap_s - since_s)
        return Pose(
            frame=LocalFrame(earlier.frame.point_at(north * fraction, east * fraction, down * fraction)),
            q_ned_body=slerp(earlier.q_ned_body, later.q_ned_body, fraction),
            velocity_ned_mps=_blend(before.velocity_ned_mps, after.velocity_ned_mps, fraction),
            angular_velocity_body_rps=_blend(
                before.angular_velocity_body_rps, after.angular_velocity_body_rps, fraction
            ),
            offset_s=since_s - gap_s,
            position_sigma_m=self._acceleration_mps2 * neglected_s2,
            attitude_sigma_rad=self._angular_acceleration_rps2 * neglected_s2,
            clock_uncertainty_s=max(before.clock_uncertainty_s, after.clock_uncertainty_s),
        )


def _blend(a: Vector3, b: Vector3, fraction: float) -> Vector3:
    (ax, ay, az), (bx, by, bz) = a, b
    return (ax + (bx - ax) * fraction, ay + (by - ay) * fraction, az + (bz - az) * fraction)
