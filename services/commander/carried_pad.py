"""Where the pad is by now: the newest estimate, carried on by the drift that it tells, and less certain with every moment.

What an estimate names is the pad's place in the navigation solution as it was then. The solution drifts on (GNSS), and the
vehicle steers in the drifted one, so that in the last metre, where the pad may not fit the picture any more, a place that
stands still is missed by the drift.

    place(t) = place + drift * t        t: since the time that the place speaks of
    sigma(t) = sigma + sigma_drift * a  a: since capture; as if place and drift erred to the same side, the worst case

Whoever follows the place needs the drift besides, or stays behind by it.

An estimate is carried for `carry.for_s` after its capture and then stands where it was carried to: the descent holds anyway by
then (`stale_after_s`), and the touchdown, which goes on regardless, goes there. Its uncertainty grows on without end.
A drift that cannot be (faster than `carry.max_drift_mps`), that is not known well enough, or whose covariance is missing or
none carries nothing. The place is not refused for that; it ages as one of which no drift is told.
"""

import math
from dataclasses import dataclass

from alight.geometry.horizontal_sigma import horizontal_sigma
from alight.geometry.local import moved_by_ned
from alight.runtime.clock import nanoseconds, seconds
from schemas.estimate import PadEstimate
from schemas.message import GlobalPosition, Matrix3, Vector3
from schemas.settings.commander import CarrySettings

STILL: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class CarriedPad:
    """The pad as of one moment."""

    position: GlobalPosition
    """Its centre in the navigation solution of that moment."""
    azimuth_rad: float
    """Azimuth of the print's upward direction."""
    sigma_m: float
    """Horizontal standard deviation of the position (major axis), metres."""
    drift_ned_mps: Vector3 = STILL
    """How the position moves from here on."""


def carried(estimate: PadEstimate, settings: CarrySettings, now_ns: int) -> CarriedPad:
    """Carry an estimate on to now.

    Args:
        estimate: One that passed the gate.
        settings: What is believed of a drift, and for how long.
        now_ns: The time, UTC ns.
    """
    age_s = max(0.0, seconds(now_ns - estimate.captured_at_ns))
    since_ns = place_at_ns(estimate)
    until_ns = min(now_ns, estimate.captured_at_ns + nanoseconds(settings.for_s))
    position, told_mps = estimate.position, estimate.velocity_ned_mps
    drift_sigma_mps = believed_drift_sigma_mps(estimate, settings)
    if told_mps is None or drift_sigma_mps is None:
        told_mps, drift_sigma_mps = STILL, settings.unknown_drift_mps
    elif until_ns > since_ns:
        north, east, down = (speed * seconds(until_ns - since_ns) for speed in told_mps)
        position = moved_by_ned(position, (north, east, down))
    sigma_m = _to_the_sides(estimate.covariance_ned_m2) + drift_sigma_mps * age_s
    return CarriedPad(position, estimate.azimuth_rad, sigma_m, told_mps if until_ns == now_ns else STILL)


def place_at_ns(estimate: PadEstimate) -> int:
    """The time that the place of an estimate speaks of, UTC ns: never one before the picture."""
    return max(estimate.position_at_ns or 0, estimate.captured_at_ns)


def believed_drift_sigma_mps(estimate: PadEstimate, settings: CarrySettings) -> float | None:
    """How sure the estimate's drift is (horizontal standard deviation, m/s), or None if it is not believed or not told."""
    if estimate.velocity_ned_mps is None or estimate.velocity_covariance_ned is None:
        return None
    north, east, down = estimate.velocity_ned_mps
    sigma_mps = _to_the_sides(estimate.velocity_covariance_ned)
    if math.isnan(sigma_mps) or max(math.hypot(north, east), abs(down), sigma_mps) > settings.max_drift_mps:
        return None
    return sigma_mps


def _to_the_sides(covariance_ned: Matrix3) -> float:
    nn, ne, _, _, ee, *_ = covariance_ned
    return horizontal_sigma(nn, ne, ee)
