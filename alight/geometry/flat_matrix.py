"""Small matrices as plain tuples of floats, row by row: the form in which messages carry them.

For so few numbers that is several times faster than an array, and stays so when the caches are cold.
"""

from collections.abc import Sequence

from alight.geometry.rotation import quaternion_normalised
from schemas.message import Quaternion, Vector3

Flat3 = tuple[float, float, float, float, float, float, float, float, float]
"""3x3 matrix, row by row."""


def flat_rotation(q: Quaternion) -> Flat3:
    """The rotation matrix of a quaternion of any length.

    Raises:
        ValueError: If `q` is zero or not finite.
    """
    w, x, y, z = quaternion_normalised(q)
    xx, yy, zz, xy, xz, yz, wx, wy, wz = x * x, y * y, z * z, x * y, x * z, y * z, w * x, w * y, w * z
    return (
        1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz), 2.0 * (xz + wy),
        2.0 * (xy + wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx),
        2.0 * (xz - wy), 2.0 * (yz + wx), 1.0 - 2.0 * (xx + yy),
    )  # fmt: skip


def times(M: Flat3, v: Vector3) -> Vector3:
    """M v."""
    a, b, c, d, e, f, g, h, i = M
    x, y, z = v
    return (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)


def transposed_times(M: Flat3, v: Vector3) -> Vector3:
    """M^T v."""
    a, b, c, d, e, f, g, h, i = M
    x, y, z = v
    return (a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z)


def congruent(M: Flat3, C: Flat3) -> Flat3:
    """M C M^T of a symmetric C: the covariance of M v if C is that of v. Symmetric to the last bit."""
    m0, m1, m2, m3, m4, m5, m6, m7, m8 = M
    c0, c1, c2, _, c4, c5, _, _, c8 = C
    x0, x1, x2 = m0 * c0 + m1 * c1 + m2 * c2, m0 * c1 + m1 * c4 + m2 * c5, m0 * c2 + m1 * c5 + m2 * c8
    y0, y1, y2 = m3 * c0 + m4 * c1 + m5 * c2, m3 * c1 + m4 * c4 + m5 * c5, m3 * c2 + m4 * c5 + m5 * c8
    z0, z1, z2 = m6 * c0 + m7 * c1 + m8 * c2, m6 * c1 + m7 * c4 + m8 * c5, m6 * c2 + m7 * c5 + m8 * c8
    xy, xz, yz = x0 * m3 + x1 * m4 + x2 * m5, x0 * m6 + x1 * m7 + x2 * m8, y0 * m6 + y1 * m7 + y2 * m8
    return (
        x0 * m0 + x1 * m1 + x2 * m2, xy, xz,
        xy, y0 * m3 + y1 * m4 + y2 * m5, yz,
        xz, yz, z0 * m6 + z1 * m7 + z2 * m8,
    )  # fmt: skip


def is_positive_definite(C: Sequence[float], size: int) -> bool:
    """Whether a symmetric matrix (size, size) is: all pivots of L D L^T are positive; NaN is not. The upper triangle is ignored."""
    A = list(C)
    for corner in range(0, size * size, size + 1):
        pivot = A[corner]
        if not pivot > 0.0:
            return False
        for below, row in enumerate(range(corner + size, size * size, size), 1):
            factor = A[row] / pivot
            for k in range(1, below + 1):
                A[row + k] -= factor * A[corner + k * size]
    return True
