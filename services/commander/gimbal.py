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
from alight.runtime.clock import nanoseconds
from schemas.message import Quaternion, Vector3
from schemas.vehicle import GimbalState
from services.commander.dialect import mavlink

SILENT_AFTER_S = 1.0


class Gimbal:
    """The newest orientation. A gimbal that falls silent is reported as unknown: nothing is published in its place."""

    def __init__(self, fixed_rpy_deg: Vector3) -> None:
        roll, pitch, yaw = (math.radians(angle) for angle in fixed_rpy_deg)
        self._fixed = quaternion_from_euler(roll, pitch, yaw)
        self._measured: GimbalState | None = None

    def take(self, message: Any, q_ned_body: Quaternion, at_ns: int) -> None:
        """Take a GIMBAL_DEVICE_ATTITUDE_STATUS.

        Its roll and pitch are against the horizon; its yaw is against north or against the vehicle's heading, as its flags say.

        Args:
            message: The message.
            q_ned_body: The vehicle's attitude at the same time.
            at_ns: That time, UTC ns.
        """
        if not 0.9 < sum(part * part for part in message.q) < 1.1:
            return
        q_level_gimbal = quaternion_normalised(message.q)
        if not _yaw_from_north(message.flags):
            heading = quaternion_from_euler(0.0, 0.0, euler_from_quaternion(q_ned_body)[2])
            q_level_gimbal = quaternion_multiply(heading, q_level_gimbal)
        q_body_gimbal = quaternion_multiply(quaternion_conjugate(q_ned_body), q_level_gimbal)
        self._measured = GimbalState(at_ns=at_ns, q_body_gimbal=q_body_gimbal, measured=True)

    def state(self, now_ns: int) -> GimbalState | None:
        """What to publish now; None while a gimbal that has reported before is silent."""
        if self._measured is None:
            return GimbalState(at_ns=now_ns, q_body_gimbal=self._fixed, measured=False)
        return self._measured if now_ns - self._measured.at_ns <= nanoseconds(SILENT_AFTER_S) else None


def _yaw_from_north(flags: int) -> bool:
    if flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME:
        return True
    if flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME:
        return False
    return bool(flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK)
