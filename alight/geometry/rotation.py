"""Rotations: elementary matrices, unit quaternions, Euler angles, rotation vectors.

Convention everywhere: active, column vectors. `R_a_b` (or `q_a_b`) takes coordinates in frame b to frame a, so that
`R_a_c = R_a_b @ R_b_c` and `q_a_c = quaternion_multiply(q_a_b, q_b_c)`. Quaternions are (w, x, y, z), Hamilton's product.

Quaternions are handled as tuples of floats: for four numbers that is several times faster than an array.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from schemas.message import Quaternion, Vector3

Matrix = NDArray[np.float64]
VectorLike = Sequence[float] | NDArray[np.float64]
"""Three numbers, or four for a quaternion."""

IDENTITY: Quaternion = (1.0, 0.0, 0.0, 0.0)
_SMALL_ANGLE_RAD = 1e-6
_SINE_OF_VERTICAL = 1.0 - 1e-14


def wrap_pi(angle_rad: float) -> float:
    """The same direction in (-pi, pi], rad."""
    wrapped = math.remainder(angle_rad, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


def R_x(angle_rad: float) -> Matrix:
    """Rotation by `angle_rad` about x, (3, 3)."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def R_y(angle_rad: float) -> Matrix:
    """Rotation by `angle_rad` about y, (3, 3)."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def R_z(angle_rad: float) -> Matrix:
    """Rotation by `angle_rad` about z, (3, 3)."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def quaternion_normalised(q: VectorLike) -> Quaternion:
    """The unit quaternion of the same rotation.

    Raises:
        ValueError: If `q` is zero or not finite, and so no rotation.
    """
    w, x, y, z = q
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if not 1e-6 < norm < math.inf:
        raise ValueError(f"no rotation: quaternion of length {norm:g}")
    return (float(w / norm), float(x / norm), float(y / norm), float(z / norm))


def quaternion_conjugate(q: VectorLike) -> Quaternion:
    """The inverse rotation of a unit quaternion."""
    w, x, y, z = q
    return (float(w), -float(x), -float(y), -float(z))


def quaternion_multiply(a: VectorLike, b: VectorLike) -> Quaternion:
    """Hamilton's product: the rotation `b`, then the rotation `a`."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        float(aw * bw - ax * bx - ay * by - az * bz),
        float(aw * bx + ax * bw + ay * bz - az * by),
        float(aw * by - ax * bz + ay * bw + az * bx),
        float(aw * bz + ax * by - ay * bx + az * bw),
    )


def rotated(q_a_b: VectorLike, vector_b: VectorLike) -> Vector3:
    """A vector in frame b, in coordinates of frame a; `q_a_b` is a unit quaternion."""
    w, x, y, z = q_a_b
    vx, vy, vz = vector_b
    tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
    return (
        float(vx + w * tx + y * tz - z * ty),
        float(vy + w * ty + z * tx - x * tz),
        float(vz + w * tz + x * ty - y * tx),
    )


def R_from_quaternion(q: VectorLike) -> Matrix:
    """The rotation matrix of a quaternion of any length, (3, 3).

    Raises:
        ValueError: If `q` is zero or not finite.
    """
    w, x, y, z = quaternion_normalised(q)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def quaternion_from_R(R: Matrix) -> Quaternion:
    """The unit quaternion of a rotation matrix, with w >= 0 (Shepperd's method: divides by the largest component)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R.tolist()
    trace = xx + yy + zz
    largest = max(trace, xx, yy, zz)
    if largest == trace:
        q = (1.0 + trace, zy - yz, xz - zx, yx - xy)
    elif largest == xx:
        q = (zy - yz, 1.0 + xx - yy - zz, xy + yx, zx + xz)
    elif largest == yy:
        q = (xz - zx, xy + yx, 1.0 + yy - xx - zz, yz + zy)
    else:
        q = (yx - xy, zx + xz, yz + zy, 1.0 + zz - xx - yy)
    w, x, y, z = quaternion_normalised(q)
    return (w, x, y, z) if w >= 0.0 else (-w, -x, -y, -z)


def quaternion_from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """Yaw about z, then pitch about the new y, then roll about the new x (ZYX, Eq. 10)."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def euler_from_quaternion(q: VectorLike) -> Vector3:
    """Roll, pitch and yaw (ZYX, Eq. 10), rad; pitch in [-pi/2, pi/2].

    Straight up or down, where only roll and yaw together are defined, roll is 0 and yaw carries both.
    """
    w, x, y, z = quaternion_normalised(q)
    sin_pitch = 2.0 * (w * y - x * z)
    if abs(sin_pitch) > _SINE_OF_VERTICAL:
        return (0.0, math.copysign(math.pi / 2, sin_pitch), wrap_pi(2.0 * math.atan2(z, w)))
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return (roll, math.asin(sin_pitch), math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def quaternion_from_rotation_vector(rotation_vector_rad: VectorLike) -> Quaternion:
    """The rotation about the vector's direction by its length in rad (exponential map)."""
    x, y, z = rotation_vector_rad
    angle = math.sqrt(x * x + y * y + z * z)
    scale = math.sin(angle / 2) / angle if angle > _SMALL_ANGLE_RAD else 0.5 - angle * angle / 48.0
    return (math.cos(angle / 2), float(x * scale), float(y * scale), float(z * scale))


def rotation_vector_from_quaternion(q: VectorLike) -> Vector3:
    """The rotation's axis times its angle in rad, of length at most pi (logarithmic map)."""
    w, x, y, z = quaternion_normalised(q)
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 * math.atan2(sine, w) / sine if sine > _SMALL_ANGLE_RAD else 2.0 + sine * sine / 3.0
    return (x * scale, y * scale, z * scale)


def slerp(q0: VectorLike, q1: VectorLike, fraction: float) -> Quaternion:
    """The rotation `fraction` of the way from `q0` (0) to `q1` (1) along the shorter arc, at constant rate."""
    step = rotation_vector_from_quaternion(quaternion_multiply(quaternion_conjugate(q0), q1))
    part = quaternion_from_rotation_vector((step[0] * fraction, step[1] * fraction, step[2] * fraction))
    return quaternion_normalised(quaternion_multiply(q0, part))
