"""The systematic error of the camera's installation, removed in cylindrical coordinates (Eq. 22-26)."""

import math

from alight.geometry.azimuth import azimuth_of
from alight.geometry.flat_matrix import Flat3
from alight.geometry.rotation import wrap_pi
from schemas.message import Vector3
from schemas.settings.geolocator import Correction


def corrected_vector(pad_ned_m: Vector3, correction: Correction) -> Vector3:
    """The vehicle-to-pad vector without its bias.

    Every bias is measured minus true and subtracted: theta' = theta - beta_theta, r' = r (1 - alpha_r) - beta_r,
    D' = D - beta_D (Eq. 24). Where the paper's Eq. 22 and Eq. 25-26 disagree, theta = atan2(E, N), an azimuth, both ways.
    A radius that the constant term would make negative becomes 0: the vector never flips.

    Args:
        pad_ned_m: From the vehicle to the pad, north, east, down, metres; D is the height above the pad.
        correction: The biases.
    """
    if correction.method == "none":
        return pad_ned_m
    north, east, down = pad_ned_m
    theta = azimuth_of(pad_ned_m) - math.radians(correction.theta_deg)
    radius_m = max(0.0, math.hypot(north, east) * (1.0 - correction.alpha_r) - correction.beta_r_m)
    return (radius_m * math.cos(theta), radius_m * math.sin(theta), down - correction.beta_d_m)


def correction_jacobian(pad_ned_m: Vector3, correction: Correction) -> Flat3:
    """How the corrected vector changes with the one that goes in, (3, 3).

    Along the horizontal direction of sight the factor is 1 - alpha_r, across it r'/r, and both are turned by the angle. Near the
    axis, where r is not much larger than beta_r, the direction of sight is mostly noise and r'/r says little: it is then held
    between half and twice 1 - alpha_r, so that neither certainty nor doubt is made of nothing.
    """
    north, east, _ = pad_ned_m
    radius_m = math.hypot(north, east)
    along = 1.0 - correction.alpha_r
    across = along - correction.beta_r_m / radius_m if radius_m > 0.0 else along
    across = min(max(across, 0.5 * along), 2.0 * along)
    n, e = (north / radius_m, east / radius_m) if radius_m > 0.0 else (1.0, 0.0)
    c, s = math.cos(math.radians(correction.theta_deg)), math.sin(math.radians(correction.theta_deg))
    # The direction of sight and the one to its right, after the turn by minus theta.
    tn, te = c * n + s * e, c * e - s * n
    return (
        along * tn * n + across * te * e, along * tn * e - across * te * n, 0.0,
        along * te * n - across * tn * e, along * te * e + across * tn * n, 0.0,
        0.0, 0.0, 1.0,
    )  # fmt: skip


def corrected_azimuth(azimuth_rad: float, correction: Correction) -> float:
    """The pad's azimuth without the bias, rad: a mount that is turned turns what it sees, too."""
    if correction.method == "none" or not correction.turn_azimuth:
        return azimuth_rad
    return wrap_pi(azimuth_rad - math.radians(correction.theta_deg))
