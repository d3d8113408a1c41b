"""A fix as the Kalman filter takes it: a place in a local frame, fresh noise, and what it shares with its neighbours."""

import math
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from schemas.fix import FixVerdict, PadFix, SharedErrors
from schemas.message import Matrix3, Vector3
from schemas.settings.filter import FilterMethod
from services.filter.navigation_frame import NavigationFrame
from services.filter.pad_motion import SIZE

Array = NDArray[np.float64]

_LARGEST_VARIANCE_M2 = 1e8
_NOTHING = (0.0, 0.0, 0.0)
_PLACE_AND_DRIFT = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, *_NOTHING, *_NOTHING, *_NOTHING)
"""The first six columns of `Sighting.H`, one after the other."""


class Sighting(NamedTuple):
    """One fix."""

    captured_at_ns: int
    place_m: Vector3
    """The pad in continuous coordinates: the vehicle's coordinates at capture time plus the vector that was seen."""
    pad_ned_m: Vector3
    """That vector."""
    noise_m2: Array
    """(3, 3), covariance of the part of the error that is new in each fix."""
    H: Array
    """(3, 17), the place as it is seen, of the state: the place itself, nothing of its drift, and where one standard deviation of each
    lasting error puts the pad (see `SharedErrors`)."""
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
        turn, heading_rad = math.radians(settings.systematic_angle_deg), math.radians(settings.systematic_azimuth_deg)
        azimuth_noise, vectors = fix.azimuth_variance_rad2, _turned(seen.pad_ned_m, turn, heading_rad)
    else:
        azimuth_noise, heading_rad, vectors = fix.azimuth_noise_rad2, shared.heading_rad, _vectors(shared)
    return Sighting(
        captured_at_ns=fix.captured_at_ns,
        place_m=frame.continuous(seen.position, fix.captured_at_ns),
        pad_ned_m=seen.pad_ned_m,
        noise_m2=noise,
        H=np.fromiter(chain(_PLACE_AND_DRIFT, *vectors), np.float64, 3 * SIZE).reshape(SIZE, 3).T,
        azimuth_rad=seen.azimuth_rad,
        azimuth_noise_rad2=azimuth_noise,
        heading_rad=heading_rad,
    )


def _vectors(shared: SharedErrors) -> tuple[Vector3, ...]:
    return (
        shared.tilt_north_ned_m,
        shared.tilt_east_ned_m,
        shared.heading_ned_m,
        shared.range_ned_m,
        shared.principal_x_ned_m,
        shared.principal_y_ned_m,
        shared.timing_ned_m,
        shared.size_ned_m,
        shared.height_ned_m,
        shared.mount_roll_ned_m,
        shared.mount_pitch_ned_m,
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


def _turned(pad_ned_m: Vector3, turn: float, heading: float) -> tuple[Vector3, ...]:
    """What a fix shares that does not say so: turns about north, east and down; nothing of the others."""
    n, e, d = pad_ned_m
    return ((0.0, -turn * d, turn * e), (turn * d, 0.0, -turn * n), (-heading * e, heading * n, 0.0), *(_NOTHING,) * 8)
