"""Records of static hovers around the pad: what the error model is fitted to (Section 4.2)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StaticRecord:
    """One hover. Positions are the vehicle's from the pad's centre, north, east, down, metres."""

    true_ned_m: Array
    """(3,) where it hovered; the paper's reference."""
    measured_ned_m: Array
    """(N, 3) where vision had it."""
    navigated_ned_m: Array | None = None
    """(N, 3) where the autopilot had it; None if it was not logged."""

    @property
    def error_ned_m(self) -> Array:
        """(N, 3), measured minus true (Eq. 21), metres."""
        return self.measured_ned_m - self.true_ned_m

    @property
    def cylindrical_error(self) -> tuple[Array, Array]:
        """Errors of the azimuth (N,) in rad, wrapped, and of the radius (N,) in metres (Eq. 22, azimuth from north).

        At the pad's centre the azimuth means nothing: NaN where the true radius is 0.
        """
        measured, true = self.measured_ned_m, self.true_ned_m
        radius_m = float(np.hypot(true[0], true[1]))
        turned = np.arctan2(measured[:, 1], measured[:, 0]) - np.arctan2(true[1], true[0])
        wrapped = np.asarray((turned + np.pi) % (2 * np.pi) - np.pi, float)
        azimuth_rad = wrapped if radius_m > 0.0 else np.full(len(measured), np.nan)
        return azimuth_rad, np.asarray(np.hypot(measured[:, 0], measured[:, 1]) - radius_m, float)

    @property
    def distance_m(self) -> float:
        """True horizontal distance from the pad, metres."""
        return float(np.hypot(self.true_ned_m[0], self.true_ned_m[1]))
