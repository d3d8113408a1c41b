"""The filtered position of the pad."""

from typing import Annotated

from pydantic import Field

from schemas.message import GlobalPosition, Matrix3, Nanoseconds, ShortText, Traced, Vector3


class PadEstimate(Traced):
    """Where the filter believes the pad to be; `captured_at_ns` is that of the newest fix in it."""

    position: GlobalPosition
    """The pad's centre, in the vehicle's navigation solution; where a drift is known, as that solution is now."""
    pad_ned_m: Vector3
    """From the vehicle (as it was at capture time of the newest fix) to the pad, north, east, down, metres."""
    azimuth_rad: Annotated[float, Field(ge=-3.1415926536, le=3.1415926536)]
    """Azimuth of the print's upward direction, rad."""
    covariance_ned_m2: Matrix3
    """Covariance of `pad_ned_m` and so of the position, north, east, down, m^2."""
    azimuth_variance_rad2: Annotated[float, Field(ge=0.0)]
    """Variance of the azimuth, rad^2."""
    method: ShortText
    """Name of the filter."""
    fixes_used: Annotated[int, Field(ge=1)]
    """How many entries of the window, or fixes of the track, made this estimate."""
    velocity_ned_mps: Vector3 | None = None
    """How the position moves in the vehicle's navigation solution (its drift, and the pad's own motion), north, east, down, m/s;
    None where the filter does not say."""
    velocity_covariance_ned: Matrix3 | None = None
    """Covariance of that velocity, north, east, down, (m/s)^2; None where the filter does not say."""
    position_at_ns: Nanoseconds | None = None
    """The time that `position` speaks of, UTC ns; None where it is the capture time."""
