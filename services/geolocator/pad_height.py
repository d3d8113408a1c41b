"""The height above the pad by the vehicle's own altitude, beside what the picture says or in its place."""

import math
from typing import NamedTuple

from schemas.fix import FixInput, FixVerdict
from schemas.message import Vector3
from schemas.settings.geolocator import GeolocatorSettings
from services.geolocator.covariance import Spread
from services.geolocator.refusal import FixRefusedError
from services.geolocator.view import View

_LEAST_SINE = 0.1
"""Of the line of sight's angle below the horizon: at six degrees a metre of height is ten of distance."""
_LEAST_NOISE_M = 1e-3
"""No altitude is exact: without this a covariance could be singular."""


class Sighted(NamedTuple):
    """A vector to the pad, what it is made of, and how sure it is."""

    pad_ned_m: Vector3
    spread: Spread
    inputs: tuple[FixInput, ...]
    remark: str


class PadHeight:
    """The three ways to a fix, which differ in one thing: how far the picture's vector is pulled to the known height.

    The picture's vector v has the line of sight in it and the distance. `pnp` leaves it as it is. `bearing` slides it along the line of
    sight until its down component is the height h: v + k (h - v_d) with k = g / g_d, g being the vector from the camera. `fused` takes
    the k of least variance, P e_d / (P_dd + sigma^2) with the covariance P of v: both ways weighted by their covariances, with what
    they have in common (the same corners, the same attitude) counted once.
    """

    def __init__(self, settings: GeolocatorSettings) -> None:
        self._method = settings.method
        self._height = settings.height
        self._quick_m = max(settings.uncertainty.position_m, _LEAST_NOISE_M)

    def applied(self, pad_ned_m: Vector3, spread: Spread, view: View) -> Sighted:
        """The vector by the method of the settings.

        Args:
            pad_ned_m: From the vehicle to the pad by the picture, corrected, metres.
            spread: Of it.
            view: From where it was seen.

        Raises:
            FixRefusedError: NO_HEIGHT, TOO_FLAT or ABOVE_VEHICLE, for `bearing`; BAD_COVARIANCE for `fused`.
        """
        altitude_m = self._height.pad_altitude_amsl_m
        if self._method == "pnp":
            return Sighted(pad_ned_m, spread, (FixInput.PICTURE_POSE,), "")
        if self._method == "bearing":
            return self._by_bearing(altitude_m, pad_ned_m, spread, view)
        if altitude_m is None:
            return Sighted(pad_ned_m, spread, (FixInput.PICTURE_POSE,), "")
        return self._fused(view.vehicle.position.altitude_amsl_m - altitude_m, pad_ned_m, spread)

    def _by_bearing(self, altitude_m: float | None, pad_ned_m: Vector3, spread: Spread, view: View) -> Sighted:
        if altitude_m is None:
            raise FixRefusedError(FixVerdict.NO_HEIGHT, "geolocator.height.pad_altitude_amsl_m is not set")
        height_m = view.vehicle.position.altitude_amsl_m - altitude_m
        n, e, d = (a - b for a, b in zip(pad_ned_m, view.camera_ned_m, strict=True))
        if not d > _LEAST_SINE * math.hypot(n, e, d):
            raise FixRefusedError(FixVerdict.TOO_FLAT, f"{math.degrees(math.atan2(d, math.hypot(n, e))):.1f} deg down")
        if not height_m > max(0.0, view.camera_ned_m[2]):
            raise FixRefusedError(FixVerdict.ABOVE_VEHICLE, f"height above the pad {height_m:.2f} m")
        return self._pulled(height_m, (n / d, e / d, 1.0), pad_ned_m, spread, FixInput.LINE_OF_SIGHT)

    def _fused(self, height_m: float, pad_ned_m: Vector3, spread: Spread) -> Sighted:
        _, _, nd, _, _, ed, _, _, dd = spread.total_m2(0.0)
        variance = dd + self._height.sigma_m**2 + self._quick_m**2
        apart_m = height_m - pad_ned_m[2]
        if apart_m * apart_m > self._height.gate_sigma**2 * variance:
            remark = f", height {height_m:.2f} m against {pad_ned_m[2]:.2f} m left out"
            return Sighted(pad_ned_m, spread, (FixInput.PICTURE_POSE,), remark)
        gain = (nd / variance, ed / variance, dd / variance)
        return self._pulled(height_m, gain, pad_ned_m, spread, FixInput.PICTURE_POSE)

    def _pulled(self, height_m: float, gain: Vector3, pad_ned_m: Vector3, spread: Spread, used: FixInput) -> Sighted:
        n, e, d = pad_ned_m
        kn, ke, kd = gain
        apart_m = height_m - d
        return Sighted(
            (n + kn * apart_m, e + ke * apart_m, d + kd * apart_m),
            spread.pulled(gain, self._height.sigma_m, self._quick_m),
            (used, FixInput.HEIGHT),
            f", height {height_m:.2f} m taken by {kd:.3f}",
        )
