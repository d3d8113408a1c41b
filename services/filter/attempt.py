"""What a filter makes of one fix."""

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from schemas.fix import PadFix
from schemas.fusion import FilteredPad, FusionVerdict
from schemas.message import GlobalPosition, Vector3
from schemas.vehicle import VehicleState


class Filtered(NamedTuple):
    """A place and an azimuth of the pad, and how sure they are."""

    position: GlobalPosition
    pad_ned_m: Vector3
    """From the vehicle, north, east, down, metres."""
    azimuth_rad: float
    covariance_ned_m2: NDArray[np.float64]
    """(3, 3), of `pad_ned_m`, m^2."""
    azimuth_variance_rad2: float
    fixes_used: int
    velocity_ned_mps: Vector3 | None = None
    velocity_covariance_ned: NDArray[np.float64] | None = None
    """(3, 3), (m/s)^2."""
    position_at_ns: int | None = None
    """The time that `position` speaks of, UTC ns; None for the capture time."""

    def as_message(self) -> FilteredPad:
        """The form in which an estimate without authority travels."""
        return FilteredPad(
            position=self.position,
            pad_ned_m=self.pad_ned_m,
            azimuth_rad=self.azimuth_rad,
            covariance_ned_m2=tuple(self.covariance_ned_m2.ravel().tolist()),
            azimuth_variance_rad2=self.azimuth_variance_rad2,
        )


class Attempt(NamedTuple):
    """A verdict, and what led to it."""

    verdict: FusionVerdict
    innovation_ned_m: Vector3 | None = None
    innovation_variances_m2: Vector3 | None = None
    """Of the innovation's components, as the filter expects them."""
    nis: float | None = None
    estimate: Filtered | None = None

    @property
    def innovation_sigma_m(self) -> Vector3 | None:
        """Standard deviations of the innovation's components."""
        if self.innovation_variances_m2 is None:
            return None
        n, e, d = (math.sqrt(max(0.0, variance)) for variance in self.innovation_variances_m2)
        return (n, e, d)


class PadFilter(Protocol):
    """Turns fixes into estimates."""

    def take_fix(self, fix: PadFix) -> Attempt:
        """Take a fix."""

    def take_vehicle(self, state: VehicleState) -> None:
        """Take the vehicle's newest state."""

    def coasted(self) -> Filtered | None:
        """The estimate carried on, without a fix, to the vehicle's newest state; None if there is nothing to carry on."""

    def counters(self) -> dict[str, int]:
        """What became of the fixes, and how often the estimate was thrown away and why."""
