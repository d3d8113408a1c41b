"""From one point on the earth to another in local north, east, down: exact, through ECEF (Eq. 2 and 12)."""

import numpy as np
from numpy.typing import NDArray

from alight.geometry.geodesy import R_ecef_ned, ecef_of_point, geodetic_of_point
from alight.geometry.rotation import VectorLike
from schemas.message import GlobalPosition


def ned_between(origin: GlobalPosition, point: GlobalPosition) -> NDArray[np.float64]:
    """The vector from `origin` to `point` in the NED frame at `origin`, metres, (3,).

    Heights are ellipsoidal. The down component is along the vertical of `origin`: the earth's curvature (8 cm at 1 km) is in it.
    """
    x, y, z = ecef_of_point(point.latitude_deg, point.longitude_deg, point.ellipsoidal_height_m)
    x0, y0, z0 = ecef_of_point(origin.latitude_deg, origin.longitude_deg, origin.ellipsoidal_height_m)
    return np.array((x - x0, y - y0, z - z0)) @ R_ecef_ned(origin.latitude_deg, origin.longitude_deg)


def moved_by_ned(origin: GlobalPosition, ned_m: VectorLike) -> GlobalPosition:
    """The point that lies `ned_m` (north, east, down, metres) from `origin`.

    The geoid separation of `origin` is carried along, which is right to a centimetre over a landing's distances.

    Raises:
        ValueError: If `ned_m` is not finite or leads out of the atmosphere or to the earth's centre
            (pydantic's ValidationError is a ValueError).
    """
    x0, y0, z0 = ecef_of_point(origin.latitude_deg, origin.longitude_deg, origin.ellipsoidal_height_m)
    dx, dy, dz = (R_ecef_ned(origin.latitude_deg, origin.longitude_deg) @ np.asarray(ned_m, float)).tolist()
    latitude_deg, longitude_deg, height_m = geodetic_of_point(x0 + dx, y0 + dy, z0 + dz)
    return GlobalPosition(
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_amsl_m=height_m + origin.altitude_amsl_m - origin.ellipsoidal_height_m,
        ellipsoidal_height_m=height_m,
    )
