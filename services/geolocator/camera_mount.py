"""Which way the camera looked, and where it sits: a fixed mount from the settings, or a gimbal that reports."""

import math
from collections import deque

from alight.geometry.frames import q_body_camera
from alight.geometry.rotation import quaternion_from_euler, quaternion_multiply, quaternion_normalised, slerp
from alight.runtime.clock import nanoseconds, seconds
from schemas.fix import FixVerdict
from schemas.message import Quaternion, Vector3
from schemas.settings.geolocator import Mount, PoseLookup
from schemas.vehicle import GimbalState
from services.geolocator.refusal import FixRefusedError

_MAX_SAMPLES = 10_000


class CameraMount:
    """The mount's orientation over time.

    Only measured gimbal states count: a state that merely repeats a fixed mount's constant leaves the settings in force.
    Once a gimbal has reported, its silence is a fault and not a fixed mount, and so is one that nobody knows how it is turned.
    """

    def __init__(self, mount: Mount, lookup: PoseLookup) -> None:
        self.camera_in_body_m: Vector3 = (mount.forward_m, mount.right_m, mount.down_m)
        """Position of the camera in the body frame, metres."""
        self._misalignment = _from_degrees(
            mount.misalignment_roll_deg, mount.misalignment_pitch_deg, mount.misalignment_yaw_deg
        )
        nominal = _from_degrees(mount.roll_deg, mount.pitch_deg, mount.yaw_deg)
        self._fixed = quaternion_multiply(self._misalignment, nominal)
        self._fixed_camera = q_body_camera(self._fixed)
        self._history_ns = nanoseconds(lookup.history_s)
        self._max_age_s = lookup.gimbal_max_age_s
        self._states: deque[tuple[int, Quaternion]] = deque(maxlen=_MAX_SAMPLES)
        self._has_gimbal = False

    def add(self, state: GimbalState) -> bool:
        """Take a gimbal state.

        Returns:
            False if it is nonsense: not later than the newest, or no rotation.
        """
        if not state.measured:
            return True
        self._has_gimbal = True
        try:
            q = quaternion_normalised(state.q_body_gimbal)
        except ValueError:
            return False
        if self._states and state.at_ns <= self._states[-1][0]:
            return False
        self._states.append((state.at_ns, quaternion_multiply(self._misalignment, q)))
        while state.at_ns - self._states[0][0] > self._history_ns:
            self._states.popleft()
        return True

    @property
    def is_measured(self) -> bool:
        """Whether a gimbal has reported its angles."""
        return bool(self._states)

    def q_body_camera(self, at_ns: int) -> Quaternion:
        """Takes camera to body coordinates at a moment, UTC ns; raises what `q_body_gimbal` raises."""
        return q_body_camera(self.q_body_gimbal(at_ns)) if self._has_gimbal else self._fixed_camera

    def q_body_gimbal(self, at_ns: int) -> Quaternion:
        """The orientation at a moment, UTC ns; unit quaternion.

        Raises:
            FixRefusedError: If a gimbal has reported, but not near enough to that moment, or nothing that can be used.
        """
        if not self._has_gimbal:
            return self._fixed
        if not self._states:
            raise FixRefusedError(FixVerdict.POSE_TOO_OLD, "there is a gimbal, and how it is turned is not known yet")
        later_ns, later_q = self._states[-1]
        if at_ns >= later_ns:
            self._refuse_older_than(seconds(at_ns - later_ns), FixVerdict.POSE_TOO_OLD)
            return later_q
        for sample_ns, q in reversed(self._states):
            if sample_ns <= at_ns:
                before_s, after_s = seconds(at_ns - sample_ns), seconds(later_ns - at_ns)
                self._refuse_older_than(min(before_s, after_s), FixVerdict.POSE_GAP)
                return slerp(q, later_q, before_s / (before_s + after_s))
            later_ns, later_q = sample_ns, q
        self._refuse_older_than(seconds(later_ns - at_ns), FixVerdict.CAPTURE_BEFORE_HISTORY)
        return later_q

    def _refuse_older_than(self, age_s: float, verdict: FixVerdict) -> None:
        if age_s > self._max_age_s:
            raise FixRefusedError(
                verdict, f"the nearest gimbal angles are {age_s:.3f} s from the capture, at most {self._max_age_s:g} s"
            )


def _from_degrees(roll_deg: float, pitch_deg: float, yaw_deg: float) -> Quaternion:
    return quaternion_from_euler(math.radians(roll_deg), math.radians(pitch_deg), math.radians(yaw_deg))
