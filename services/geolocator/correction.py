"""The systematic error of the camera's installation, removed in cylindrical coordinates (Eq. 22-26)."""

import math

from alight.geometry.azimuth import azimuth_of
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


def corrected_azimuth(azimuth_rad: float, correction: Correction) -> float:
    """The pad's azimuth without the bias, rad: a mount that is turned turns what it sees, too."""
    if correction.method == "none" or not correction.turn_azimuth:
        return azimuth_rad
    return wrap_pi(azimuth_rad - math.radians(correction.theta_deg))
