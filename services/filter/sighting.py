"""A fix as the Kalman filter takes it: a place in a local frame, fresh noise, and what it shares with its neighbours."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from schemas.fix import FixVerdict, PadFix, PadPosition
from schemas.message import Matrix3, Vector3
from schemas.settings.filter import FilterMethod
from services.filter.navigation_frame import NavigationFrame

Array = NDArray[np.float64]

_LARGEST_VARIANCE_M2 = 1e8


@dataclass(frozen=True)
class Sighting:
    """One fix."""

    captured_at_ns: int
    place_m: Array
    """(3,), the pad in continuous coordinates: the vehicle's coordinates at capture time plus the vector that was seen."""
    pad_ned_m: Vector3
    """That vector."""
    noise_m2: Array
    """(3, 3), covariance of the part of the error that is new in each fix."""
    shared_m: Array
    """(3, 8), where one standard deviation of each lasting error puts the pad; see `SharedErrors`."""
    azimuth_rad: float
    azimuth_noise_rad2: float
    heading_rad: float
    """Standard deviation of the heading, which the azimuth shares."""


def sighting_of(fix: PadFix, frame: NavigationFrame, settings: FilterMethod) -> Sighting | None:
    """The sighting that an accepted fix makes; None if it lacks a part or does not say how sure it is."""
    seen = fix.corrected
    whole = fix.covariance_ned_m2 if fix.noise_covariance_ned_m2 is None else fix.noise_covariance_ned_m2
    if fix.verdict is not FixVerdict.ACCEPTED or seen is None or whole is None or fix.azimuth_variance_rad2 is None:
        return None
    noise = _covariance(whole)
    if noise is None:
        return None
    shared = fix.shared
    if shared is None or fix.azimuth_noise_rad2 is None:
        turn, azimuth_noise, heading = (
            math.radians(settings.systematic_angle_deg),
            fix.azimuth_variance_rad2,
            math.radians(settings.systematic_azimuth_deg),
        )
        shared_m = _turned(seen.pad_ned_m, turn, heading)
    else:
        azimuth_noise, heading = fix.azimuth_noise_rad2, shared.heading_rad
        shared_m = np.array(
            (
                shared.tilt_north_ned_m,
                shared.tilt_east_ned_m,
                shared.heading_ned_m,
                shared.range_ned_m,
                shared.principal_x_ned_m,
                shared.principal_y_ned_m,
                shared.timing_ned_m,
                shared.size_ned_m,
            )
        ).T
    return _sighting(fix, seen, frame, noise, shared_m, azimuth_noise, heading)


def _sighting(
    fix: PadFix,
    seen: PadPosition,
    frame: NavigationFrame,
    noise: Array,
    shared: Array,
    azimuth_noise: float,
    heading: float,
) -> Sighting:
    return Sighting(
        captured_at_ns=fix.captured_at_ns,
        place_m=frame.continuous(seen.position, fix.captured_at_ns),
        pad_ned_m=seen.pad_ned_m,
        noise_m2=noise,
        shared_m=shared,
        azimuth_rad=seen.azimuth_rad,
        azimuth_noise_rad2=azimuth_noise,
        heading_rad=heading,
    )


def _covariance(values: Matrix3) -> Array | None:
    """The matrix, if it is a covariance."""
    nn, ne, nd, en, ee, ed, dn, de, dd = values
    ne, nd, ed = 0.5 * (ne + en), 0.5 * (nd + dn), 0.5 * (ed + de)
    minor = nn * ee - ne * ne
    determinant = dd * minor - nn * ed * ed - ee * nd * nd + 2.0 * ne * nd * ed
    if not (nn > 0.0 and minor > 0.0 and determinant > 0.0 and max(nn, ee, dd) < _LARGEST_VARIANCE_M2):
        return None
    return np.array(((nn, ne, nd), (ne, ee, ed), (nd, ed, dd)))


def _turned(pad_ned_m: Vector3, turn: float, heading: float) -> Array:
    """What a fix shares that does not say so: turns about north, east and down, in the order of `SharedErrors`."""
    n, e, d = pad_ned_m
    shared = np.zeros((3, 8))
    shared[:, 0] = (0.0, -turn * d, turn * e)
    shared[:, 1] = (turn * d, 0.0, -turn * n)
    shared[:, 2] = (-heading * e, heading * n, 0.0)
    return shared
