"""One entry of the window: a fix, or the result of the window before."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from schemas.fix import PadFix
from schemas.message import GlobalPosition


@dataclass(frozen=True)
class Entry:
    """A place and an azimuth of the pad."""

    position: GlobalPosition
    azimuth_rad: float
    covariance_ned_m2: NDArray[np.float64]
    """(3, 3), north, east, down, m^2; of the part of the error that averages out."""
    azimuth_variance_rad2: float


def entry_of(fix: PadFix) -> Entry | None:
    """The entry that an accepted fix makes.

    Returns:
        None if the fix lacks a part, or its covariance is none: it cannot say how sure it is.
    """
    if fix.corrected is None or fix.covariance_ned_m2 is None or fix.azimuth_variance_rad2 is None:
        return None
    covariance = np.array(fix.covariance_ned_m2).reshape(3, 3)
    covariance = 0.5 * (covariance + covariance.T)
    try:
        np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        return None
    return Entry(fix.corrected.position, fix.corrected.azimuth_rad, covariance, fix.azimuth_variance_rad2)
