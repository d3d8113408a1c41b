"""What the filters made of each fix: the log that explains an estimate."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from schemas.message import GlobalPosition, Matrix3, Nanoseconds, Part, ShortText, Stamped, Vector3


class FusionVerdict(StrEnum):
    """What became of a fix in one filter."""

    STARTED = "started"
    """The first of a new track, or still too few agree: nothing leaves yet."""
    FUSED = "fused"
    """It is in the estimate."""
    COLLECTED = "collected"
    """It is in a window that released nothing yet."""
    OUTLIER = "outlier"
    """Too far from what was expected, for what both claim to know: left out."""
    REINITIALISED = "reinitialised"
    """So many refused fixes in a row agreed with each other that the estimate was given up for them."""
    COASTED = "coasted"
    """There was no fix: the estimate went on by its own motion, less and less certain."""
    NOT_ACCEPTED = "not_accepted"
    """The geolocator had refused it."""
    INCOMPLETE = "incomplete"
    """It lacks a part, or its covariance is none."""
    OUT_OF_ORDER = "out_of_order"
    """Captured no later than one that was taken, or before everything that the filter remembers."""


class FilteredPad(Part):
    """An estimate without authority."""

    position: GlobalPosition
    """The pad's centre, in the vehicle's navigation solution."""
    pad_ned_m: Vector3
    """From the vehicle to the pad, north, east, down, metres: the vehicle at capture time of the fix, or as it was last heard of
    where there is none."""
    azimuth_rad: Annotated[float, Field(ge=-3.1415926536, le=3.1415926536)]
    """Azimuth of the print's upward direction, rad."""
    covariance_ned_m2: Matrix3
    """Covariance of `pad_ned_m`, north, east, down, m^2."""
    azimuth_variance_rad2: Annotated[float, Field(ge=0.0)]
    """Variance of the azimuth, rad^2."""


class FusionAttempt(Part):
    """What one filter made of one fix."""

    name: ShortText
    """Of the shadow filter; `active` is the one whose estimate steers."""
    method: ShortText
    """Its method."""
    verdict: FusionVerdict
    """What became of the fix."""
    innovation_ned_m: Vector3 | None = None
    """Fix minus expectation, north, east, down, metres; None where nothing was expected."""
    innovation_sigma_m: Vector3 | None = None
    """Standard deviation that the filter expects of it, on each axis, metres."""
    nis: Annotated[float, Field(ge=0.0)] | None = None
    """Normalised innovation squared of position and azimuth, four degrees of freedom."""
    estimate: FilteredPad | None = None
    """What a shadow filter releases, or what the active one coasts to."""


class Fusion(Stamped):
    """All filters' attempts at one fix; `at_ns` is when the filter service came to writing it down."""

    captured_at_ns: Nanoseconds | None = None
    """Capture time of the fix, UTC ns; None where there was none (coasting)."""
    fix_age_s: float | None = None
    """While coasting: for how long there has been no fix that the active filter took, seconds."""
    attempts: Annotated[tuple[FusionAttempt, ...], Field(min_length=1, max_length=17)]
    """The active filter's first, then the shadows'."""
