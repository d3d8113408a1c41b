"""The chain of frames from the camera to local north, east, down (Eq. 1, 8 and 9).

Camera: x right, y down, z along the optical axis. Socket and gimbal: x along the optical axis, y right, z down.
Body: forward, right, down.
"""

import math

import numpy as np

from alight.geometry.rotation import (
    Matrix,
    R_from_quaternion,
    VectorLike,
    quaternion_from_euler,
    quaternion_from_R,
    quaternion_multiply,
    rotated,
)
from schemas.message import Quaternion, Vector3

R_SOCKET_CAMERA: Matrix = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Camera to socket coordinates. Eq. 8 as printed is of the transpose's family; this is Rz(90 deg) @ Rx(90 deg)."""
R_SOCKET_CAMERA.setflags(write=False)

Q_SOCKET_CAMERA: Quaternion = quaternion_from_R(R_SOCKET_CAMERA)
"""The same as a quaternion."""

Q_BODY_GIMBAL_DOWN: Quaternion = quaternion_from_euler(0.0, -math.pi / 2, 0.0)
"""A camera that looks straight down (Section 2.4): image up is body forward, image right is body right."""

CAMERA_IN_BODY_M: Vector3 = (0.0, 0.0, 0.1)
"""Where the camera sits in the body frame (Section 2.4), metres."""


def q_body_camera(q_body_gimbal: VectorLike = Q_BODY_GIMBAL_DOWN) -> Quaternion:
    """Takes camera to body coordinates; the gimbal's frame equals the socket's."""
    return quaternion_multiply(q_body_gimbal, Q_SOCKET_CAMERA)


def R_body_camera(q_body_gimbal: VectorLike = Q_BODY_GIMBAL_DOWN) -> Matrix:
    """Takes camera to body coordinates, (3, 3)."""
    return R_from_quaternion(q_body_gimbal) @ R_SOCKET_CAMERA


def body_from_camera(
    p_camera_m: VectorLike,
    q_body_gimbal: VectorLike = Q_BODY_GIMBAL_DOWN,
    camera_in_body_m: VectorLike = CAMERA_IN_BODY_M,
) -> Vector3:
    """A point in camera coordinates, in body coordinates, metres. Quaternions are unit quaternions."""
    x, y, z = rotated(q_body_camera(q_body_gimbal), p_camera_m)
    return (x + float(camera_in_body_m[0]), y + float(camera_in_body_m[1]), z + float(camera_in_body_m[2]))


def ned_from_camera(
    p_camera_m: VectorLike,
    q_ned_body: VectorLike,
    q_body_gimbal: VectorLike = Q_BODY_GIMBAL_DOWN,
    camera_in_body_m: VectorLike = CAMERA_IN_BODY_M,
) -> Vector3:
    """A point in camera coordinates, from the body's origin in NED, metres (Eq. 1). Quaternions are unit quaternions."""
    return rotated(q_ned_body, body_from_camera(p_camera_m, q_body_gimbal, camera_in_body_m))


def camera_from_ned(
    p_ned_m: VectorLike,
    q_ned_body: VectorLike,
    q_body_gimbal: VectorLike = Q_BODY_GIMBAL_DOWN,
    camera_in_body_m: VectorLike = CAMERA_IN_BODY_M,
) -> Vector3:
    """The inverse of `ned_from_camera`: a point in NED from the body's origin, in camera coordinates, metres."""
    w, x, y, z = q_ned_body
    bx, by, bz = rotated((w, -x, -y, -z), p_ned_m)
    w, x, y, z = q_body_camera(q_body_gimbal)
    cx, cy, cz = camera_in_body_m
    return rotated((w, -x, -y, -z), (bx - cx, by - cy, bz - cz))
