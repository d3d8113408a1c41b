"""How sure a place or a velocity is to the sides."""

import math

from schemas.message import Matrix3


def horizontal_sigma(covariance_ned: Matrix3) -> float:
    """Standard deviation along the major horizontal axis, in the root of the matrix's unit; NaN for a matrix that is no covariance.

    Args:
        covariance_ned: 3x3, north, east, down, row by row.
    """
    nn, ne, _, _, ee = covariance_ned[:5]
    largest = (nn + ee) / 2 + math.hypot((nn - ee) / 2, ne)
    return math.sqrt(largest) if nn >= 0.0 and ee >= 0.0 else math.nan
