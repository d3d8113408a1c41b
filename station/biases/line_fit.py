"""A straight line through points, and how much it explains."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Line:
    """`offset + slope * distance`; the offset and the slope have the unit of the error, and that per metre."""

    slope: float
    offset: float
    r2: float
    """Variance score (Eq. 23); 0 where the error does not vary."""


def fitted_line(distance_m: Array, error: Array) -> Line:
    """Least squares through points (N,).

    Raises:
        ValueError: If all points lie at one distance.
    """
    if np.ptp(distance_m) == 0.0:
        raise ValueError("a line needs points at two distances at least")
    slope, offset = np.polyfit(distance_m, error, 1)
    rest = error - (offset + slope * distance_m)
    variance = float(error.var())
    return Line(float(slope), float(offset), 1.0 - float(rest.var()) / variance if variance else 0.0)
