"""How sure a place or a velocity is to the sides."""

import math


def horizontal_sigma(nn: float, ne: float, ee: float) -> float:
    """Standard deviation along the major axis of a horizontal covariance, in the root of its unit; NaN where it is no covariance.

    The larger eigenvalue of a symmetric 2x2 matrix is half its trace plus the length of its deviator.

    Args:
        nn: Variance north.
        ne: Covariance of north and east.
        ee: Variance east.
    """
    largest = (nn + ee) / 2 + math.hypot((nn - ee) / 2, ne)
    return math.sqrt(largest) if nn >= 0.0 and ee >= 0.0 else math.nan
