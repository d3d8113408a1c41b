"""WGS84: geodetic coordinates to and from the earth-centred, earth-fixed frame (ECEF).

One formula serves single points (plain floats, a few microseconds) and arrays (NumPy, millions of points a second): the
functions it is made of are passed in.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from alight.geometry.rotation import Matrix
from schemas.message import Vector3

EQUATORIAL_RADIUS_M = 6378137.0
"""Semi-major axis a of WGS84."""
FLATTENING = 1.0 / 298.257223563
"""f of WGS84."""
POLAR_RADIUS_M = EQUATORIAL_RADIUS_M * (1.0 - FLATTENING)
"""Semi-minor axis b."""
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
"""e^2, first eccentricity."""
SECOND_ECCENTRICITY_SQUARED = ECCENTRICITY_SQUARED / (1.0 - FLATTENING) ** 2
"""e'^2."""
MIN_RADIUS_M = 50_000.0
"""Closer to the earth's centre the nearest point of the ellipsoid is not unique (its evolute reaches out to 43 km)."""

_CHUNK = 8192
"""Points handled at once, so that the intermediate results stay in the processor's cache."""


@dataclass(frozen=True)
class _Functions:
    """The elementary functions, for floats or for arrays."""

    sqrt: Callable[[Any], Any]
    cbrt: Callable[[Any], Any]
    sin: Callable[[Any], Any]
    cos: Callable[[Any], Any]
    arctan2: Callable[[Any, Any], Any]
    positive: Callable[[Any], Any]


_FLOATS = _Functions(math.sqrt, math.cbrt, math.sin, math.cos, math.atan2, lambda x: max(x, 0.0))
_ARRAYS = _Functions(np.sqrt, np.cbrt, np.sin, np.cos, np.arctan2, lambda x: np.maximum(x, 0.0))


def ecef_from_geodetic(latitude_deg: ArrayLike, longitude_deg: ArrayLike, height_m: ArrayLike) -> NDArray[np.float64]:
    """Geodetic to ECEF coordinates (Eq. 14-15).

    Args:
        latitude_deg: WGS84 latitude, degrees, any shape.
        longitude_deg: Longitude, degrees.
        height_m: Height above the ellipsoid, metres.

    Returns:
        ECEF coordinates in metres, shape (..., 3).
    """
    latitude, longitude, height = np.broadcast_arrays(
        np.asarray(latitude_deg, float), np.asarray(longitude_deg, float), np.asarray(height_m, float)
    )
    return np.stack(_ecef(latitude, longitude, height, _ARRAYS), axis=-1)


def geodetic_from_ecef(
    p_ecef_m: ArrayLike,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """ECEF to geodetic coordinates by J. Zhu's closed form (Eq. 11; IEEE TAES 30(3), 1994).

    Where the paper prints an arctangent, `arctan2` is used: right in every quadrant, at the poles and on the antimeridian.

    Args:
        p_ecef_m: Points in metres, shape (..., 3).

    Returns:
        Latitude in degrees, longitude in degrees in [-180, 180], height above the ellipsoid in metres; each shape (...).

    Raises:
        ValueError: If a point is closer to the earth's centre than MIN_RADIUS_M, or not finite.
    """
    points = np.asarray(p_ecef_m, float)
    flat = points.reshape(-1, 3)
    result = np.empty((3, len(flat)))
    for start in range(0, len(flat), _CHUNK):
        x, y, z = np.ascontiguousarray(flat[start : start + _CHUNK].T)
        distance_squared = x * x + y * y + z * z
        if not np.all((distance_squared >= MIN_RADIUS_M**2) & (distance_squared < np.inf)):
            raise ValueError("a point is not finite or next to the earth's centre")
        result[:, start : start + _CHUNK] = _geodetic(x, y, z, _ARRAYS)
    latitude, longitude, height = result.reshape(3, *points.shape[:-1])
    return latitude, longitude, height


def ecef_of_point(latitude_deg: float, longitude_deg: float, height_m: float) -> Vector3:
    """`ecef_from_geodetic` for one point, as plain floats."""
    x, y, z = _ecef(latitude_deg, longitude_deg, height_m, _FLOATS)
    return (x, y, z)


def geodetic_of_point(x_ecef_m: float, y_ecef_m: float, z_ecef_m: float) -> Vector3:
    """`geodetic_from_ecef` for one point, as plain floats: latitude and longitude in degrees, height in metres.

    Raises:
        ValueError: If the point is closer to the earth's centre than MIN_RADIUS_M, or not finite.
    """
    if not MIN_RADIUS_M <= math.sqrt(x_ecef_m**2 + y_ecef_m**2 + z_ecef_m**2) < math.inf:
        raise ValueError("the point is not finite or next to the earth's centre")
    latitude, longitude, height = _geodetic(x_ecef_m, y_ecef_m, z_ecef_m, _FLOATS)
    return (latitude, longitude, height)


def R_ecef_ned(latitude_deg: float, longitude_deg: float) -> Matrix:
    """Takes local north, east, down to ECEF coordinates, (3, 3).

    Eq. 13 as printed has four rows; this is the matrix whose columns are the north, east and down axes in ECEF.
    """
    return np.array(ned_axes_in_ecef(latitude_deg, longitude_deg)).reshape(3, 3)


def ned_axes_in_ecef(
    latitude_deg: float, longitude_deg: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """`R_ecef_ned` as plain floats, row by row."""
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    sin_lon, cos_lon = math.sin(longitude), math.cos(longitude)
    return (
        -sin_lat * cos_lon, -sin_lon, -cos_lat * cos_lon,
        -sin_lat * sin_lon, cos_lon, -cos_lat * sin_lon,
        cos_lat, 0.0, -sin_lat,
    )  # fmt: skip


def _ecef(latitude_deg: Any, longitude_deg: Any, height_m: Any, functions: _Functions) -> tuple[Any, Any, Any]:
    to_rad = math.pi / 180.0
    sin_lat, cos_lat = functions.sin(latitude_deg * to_rad), functions.cos(latitude_deg * to_rad)
    sin_lon, cos_lon = functions.sin(longitude_deg * to_rad), functions.cos(longitude_deg * to_rad)
    prime_vertical = EQUATORIAL_RADIUS_M / functions.sqrt(1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat)
    horizontal = (prime_vertical + height_m) * cos_lat
    z = ((1.0 - ECCENTRICITY_SQUARED) * prime_vertical + height_m) * sin_lat
    return horizontal * cos_lon, horizontal * sin_lon, z


def _geodetic(x: Any, y: Any, z: Any, functions: _Functions) -> tuple[Any, Any, Any]:
    # Lengths in units of the equatorial radius: the sixth powers below stay near 1.
    a, e2 = EQUATORIAL_RADIUS_M, ECCENTRICITY_SQUARED
    b2 = 1.0 - e2
    r2, z2 = (x * x + y * y) / (a * a), z * z / (a * a)
    r = functions.sqrt(r2)
    F = 54.0 * b2 * z2
    G = r2 + b2 * z2 - e2 * e2
    c = e2 * e2 * F * r2 / (G * G * G)
    s = functions.cbrt(1.0 + c + functions.sqrt(c * (c + 2.0)))
    k = (s + 1.0 / s + 1.0) * G
    P = F / (3.0 * k * k)
    Q = functions.sqrt(1.0 + 2.0 * e2 * e2 * P)
    # Next to the poles the radicand is a difference of equal numbers, and rounding may push it below zero.
    radicand = 0.5 * (1.0 + 1.0 / Q) - P * b2 * z2 / (Q * (1.0 + Q)) - 0.5 * P * r2
    r0 = functions.sqrt(functions.positive(radicand)) - P * e2 * r / (1.0 + Q)
    inner2 = (r - e2 * r0) ** 2
    U = functions.sqrt(inner2 + z2)
    V = functions.sqrt(inner2 + b2 * z2)
    latitude = functions.arctan2(z / a * (1.0 + SECOND_ECCENTRICITY_SQUARED * b2 / V), r)
    height = a * U * (1.0 - b2 / V)
    to_deg = 180.0 / math.pi
    return latitude * to_deg, functions.arctan2(y, x) * to_deg, height
