"""A north, east, down frame at a fixed origin, for points that are turned to and fro many times."""

from alight.geometry.geodesy import R_ecef_ned, ecef_of_point, geodetic_of_point
from schemas.message import GlobalPosition, Vector3


class LocalFrame:
    """`ned_between` and `moved_by_ned` of one origin, whose sines and cosines are taken once."""

    def __init__(self, origin: GlobalPosition) -> None:
        """Anchor the frame; heights are ellipsoidal."""
        self.origin = origin
        self._ecef = ecef_of_point(origin.latitude_deg, origin.longitude_deg, origin.ellipsoidal_height_m)
        self._rows = R_ecef_ned(origin.latitude_deg, origin.longitude_deg).tolist()
        self._separation_m = origin.altitude_amsl_m - origin.ellipsoidal_height_m

    def ned_of(self, point: GlobalPosition) -> Vector3:
        """A point in this frame, north, east, down, metres."""
        x0, y0, z0 = self._ecef
        x, y, z = ecef_of_point(point.latitude_deg, point.longitude_deg, point.ellipsoidal_height_m)
        x, y, z = x - x0, y - y0, z - z0
        (xn, xe, xd), (yn, ye, yd), (zn, ze, zd) = self._rows
        return (xn * x + yn * y + zn * z, xe * x + ye * y + ze * z, xd * x + yd * y + zd * z)

    def point_at(self, north_m: float, east_m: float, down_m: float) -> GlobalPosition:
        """The place of a point of this frame; the geoid separation is that of the origin.

        Raises:
            ValueError: If it is no place on or above the earth.
        """
        x0, y0, z0 = self._ecef
        (xn, xe, xd), (yn, ye, yd), (zn, ze, zd) = self._rows
        latitude_deg, longitude_deg, height_m = geodetic_of_point(
            x0 + xn * north_m + xe * east_m + xd * down_m,
            y0 + yn * north_m + ye * east_m + yd * down_m,
            z0 + zn * north_m + ze * east_m + zd * down_m,
        )
        return GlobalPosition(
            latitude_deg=latitude_deg,
            longitude_deg=longitude_deg,
            altitude_amsl_m=height_m + self._separation_m,
            ellipsoidal_height_m=height_m,
        )
