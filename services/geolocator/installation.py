"""What is built otherwise than believed, undone in the chain itself: the correction `extrinsic`."""

import dataclasses
import math

from alight.geometry.rotation import quaternion_from_euler, quaternion_multiply
from schemas.message import Vector3
from schemas.settings.geolocator import Extrinsic
from services.geolocator.view import View


def as_installed(view: View, extrinsic: Extrinsic) -> View:
    """The view through the camera as it is: `R_body_camera_true = R_z R_y R_x R_body_camera_believed`, and its true place."""
    turned = quaternion_from_euler(
        math.radians(extrinsic.mount_roll_deg),
        math.radians(extrinsic.mount_pitch_deg),
        math.radians(extrinsic.mount_yaw_deg),
    )
    x, y, z = view.camera_in_body_m
    return dataclasses.replace(
        view,
        q_body_gimbal=quaternion_multiply(turned, view.q_body_gimbal),
        camera_in_body_m=(x + extrinsic.forward_m, y + extrinsic.right_m, z + extrinsic.down_m),
    )


def true_position(position_camera_m: Vector3, extrinsic: Extrinsic) -> Vector3:
    """Where the pad is that was located with the believed focal length and size, camera frame, metres.

    A print that is larger than believed is farther away in proportion. A focal length that is longer than believed makes it
    farther along the optical axis alone: exact for a pad across the axis, to first order for a tilted one.
    """
    x, y, z = position_camera_m
    size = extrinsic.pad_scale
    return (x * size, y * size, z * size * extrinsic.focal_scale)
