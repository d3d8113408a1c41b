"""What the flight modes ask of the position controller."""

import math
from dataclasses import dataclass

NAN = math.nan


@dataclass(slots=True)
class Setpoint:
    """Position, velocity and acceleration in the local frame (north, east, down); NaN where nothing is asked."""

    north: float = NAN
    east: float = NAN
    down: float = NAN
    vn: float = NAN
    ve: float = NAN
    vd: float = NAN
    an: float = 0.0
    ae: float = 0.0
    ad: float = 0.0
    yaw: float = NAN
    """Azimuth of the nose, radians; NaN keeps the present one."""
    yaw_rate: float = 0.0
    """Feed-forward, rad/s."""


@dataclass(frozen=True, slots=True)
class OffboardSetpoint:
    """One SET_POSITION_TARGET message as understood; None where a part is not commanded."""

    position: tuple[float, float, float] | None
    """North, east, down in the local frame, metres."""
    velocity: tuple[float, float, float] | None
    """North, east, down, m/s; NaN on an axis that is not commanded."""
    yaw: float | None
    yaw_rate: float | None
