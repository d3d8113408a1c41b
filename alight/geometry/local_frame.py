"""A north, east, down frame at a fixed origin, for points that are turned to and fro many times."""

from alight.geometry.flat_matrix import times, transposed_times
from alight.geometry.geodesy import ecef_of_point, geodetic_of_point, ned_axes_in_ecef
from schemas.message import GlobalPosition, Vector3


class LocalFrame:
    """`ned_between` and `moved_by_ned` of one origin, whose sines and cosines are taken once."""

    __slots__ = ("_R_ecef_ned", "_ecef", "_separation_m", "origin")

    def __init__(self, origin: GlobalPosition) -> None:
        """Anchor the frame; heights are ellipsoidal."""
        self.origin = origin
        self._ecef = ecef_of_point(origin.latitude_deg, origin.longitude_deg, origin.ellipsoidal_height_m)
        self._R_ecef_ned = ned_axes_in_ecef(origin.latitude_deg, origin.longitude_deg)
        self._separation_m = origin.altitude_amsl_m - origin.ellipsoidal_height_m

    def ned_of(self, point: GlobalPosition) -> Vector3:
        """A point in this frame, north, east, down, metres."""
        x0, y0, z0 = self._ecef
        x, y, z = ecef_of_point(point.latitude_deg, point.longitude_deg, point.ellipsoidal_height_m)
        return transposed_times(self._R_ecef_ned, (x - x0, y - y0, z - z0))

    def point_at(self, north_m: float, east_m: float, down_m: float) -> GlobalPosition:
        """The place of a point of this frame; the geoid separation is that of the origin.

        Raises:
            ValueError: If it is no place on or above the earth.
        """
        x0, y0, z0 = self._ecef
        dx, dy, dz = times(self._R_ecef_ned, (north_m, east_m, down_m))
        latitude_deg, longitude_deg, height_m = geodetic_of_point(x0 + dx, y0 + dy, z0 + dz)
        return GlobalPosition(
            latitude_deg=latitude_deg,
            longitude_deg=longitude_deg,
            altitude_amsl_m=height_m + self._separation_m,
            ellipsoidal_height_m=height_m,
        )
