"""How the camera is turned: what a gimbal reports, or the fixed mount of the settings."""

import math
from typing import Any

from alight.geometry.rotation import (
    euler_from_quaternion,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_multiply,
    quaternion_normalised,
)
from alight.runtime.clock import nanoseconds, seconds
from schemas.message import Quaternion, Vector3
from schemas.vehicle import UNKNOWN_ROTATION, GimbalState
from services.commander.dialect import mavlink

SILENT_AFTER_S = 1.0


class Gimbal:
    """The newest orientation. A gimbal that falls silent, or whose reports cannot be used, is published as unknown.

    Once one has been heard the fixed mount is never said again: a gimbal that looks elsewhere puts the pad as far beside as it is high.
    """

    def __init__(self, fixed_rpy_deg: Vector3) -> None:
        roll, pitch, yaw = (math.radians(angle) for angle in fixed_rpy_deg)
        self._fixed = quaternion_from_euler(roll, pitch, yaw)
        self._measured: GimbalState | None = None
        self._heard_ns: int | None = None

    def hear(self, now_ns: int) -> None:
        """Note that a gimbal is there, whether or not what it says can be used."""
        self._heard_ns = now_ns

    def take(self, message: Any, q_ned_body: Quaternion, at_ns: int) -> bool:
        """Take a GIMBAL_DEVICE_ATTITUDE_STATUS.

        Its roll and pitch are against the horizon; its yaw is against north or against the vehicle's heading, as its flags say.

        Args:
            message: The message.
            q_ned_body: The vehicle's attitude at the same time.
            at_ns: That time, UTC ns.

        Returns:
            False if its orientation is no rotation.
        """
        if not 0.9 < sum(part * part for part in message.q) < 1.1:
            return False
        q_level_gimbal = quaternion_normalised(message.q)
        if not _yaw_from_north(message.flags):
            heading = quaternion_from_euler(0.0, 0.0, euler_from_quaternion(q_ned_body)[2])
            q_level_gimbal = quaternion_multiply(heading, q_level_gimbal)
        q_body_gimbal = quaternion_multiply(quaternion_conjugate(q_ned_body), q_level_gimbal)
        self._measured = GimbalState(at_ns=at_ns, q_body_gimbal=q_body_gimbal, measured=True)
        return True

    def state(self, now_ns: int) -> GimbalState:
        """What to publish now."""
        if self._measured is not None and now_ns - self._measured.at_ns <= nanoseconds(SILENT_AFTER_S):
            return self._measured
        if self._measured is None and self._heard_ns is None:
            return GimbalState(at_ns=now_ns, q_body_gimbal=self._fixed, measured=False)
        return GimbalState(at_ns=now_ns, q_body_gimbal=UNKNOWN_ROTATION, measured=True)

    def complaints(self, now_ns: int) -> tuple[str, ...]:
        """What is wrong with it, in words with the consequence."""
        if self._heard_ns is None or self.state(now_ns).q_body_gimbal != UNKNOWN_ROTATION:
            return ()
        silent_s = seconds(now_ns - self._heard_ns)
        if silent_s > SILENT_AFTER_S:
            return (f"the gimbal has been silent for {silent_s:.0f} s: without its angles there is no fix of the pad",)
        return (
            "what the gimbal reports is no rotation, or no attitude of the vehicle fits to it: there is no fix of the pad",
        )


def _yaw_from_north(flags: int) -> bool:
    if flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME:
        return True
    if flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME:
        return False
    return bool(flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK)
