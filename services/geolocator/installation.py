"""What is built otherwise than believed, undone in the chain itself: the correction `extrinsic`."""

import math

from alight.geometry.rotation import quaternion_from_euler, quaternion_multiply
from schemas.message import Quaternion, Vector3
from schemas.settings.geolocator import Extrinsic


class Installation:
    """The camera as it is: `R_body_camera_true = R_z R_y R_x R_body_camera_believed`, its true place and its true lens."""

    def __init__(self, extrinsic: Extrinsic) -> None:
        self._turn = quaternion_from_euler(
            math.radians(extrinsic.mount_roll_deg),
            math.radians(extrinsic.mount_pitch_deg),
            math.radians(extrinsic.mount_yaw_deg),
        )
        self._moved_m = (extrinsic.forward_m, extrinsic.right_m, extrinsic.down_m)
        self.scale: Vector3 = (
            extrinsic.pad_scale,
            extrinsic.pad_scale,
            extrinsic.pad_scale * extrinsic.focal_scale,
        )
        """By what a place that was found with the believed focal length and size is to be multiplied, camera frame.

        A print that is larger than believed is farther away in proportion. A focal length that is longer than believed makes it
        farther along the optical axis alone: exact for a pad across the axis, to first order for a tilted one.
        """

    def q_body_camera(self, believed: Quaternion) -> Quaternion:
        """The camera's true orientation."""
        return quaternion_multiply(self._turn, believed)

    def camera_in_body_m(self, believed_m: Vector3) -> Vector3:
        """The camera's true place, metres."""
        (x, y, z), (dx, dy, dz) = believed_m, self._moved_m
        return (x + dx, y + dy, z + dz)
