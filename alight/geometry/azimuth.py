"""Azimuths: directions in the horizontal plane, from north, clockwise, rad in (-pi, pi]."""

import math

from alight.geometry.rotation import VectorLike, rotated, wrap_pi


def azimuth_of(ned: VectorLike) -> float:
    """The azimuth of a vector's horizontal part; 0 for a vertical one."""
    return wrap_pi(math.atan2(ned[1], ned[0]))


def yaw_of(q_ned_body: VectorLike) -> float:
    """The azimuth of the body's forward axis: the vehicle's heading."""
    return azimuth_of(rotated(q_ned_body, (1.0, 0.0, 0.0)))


def pad_azimuth(q_ned_marker: VectorLike) -> float:
    """The azimuth of the print's upward direction, the marker's y axis projected to the horizontal."""
    return azimuth_of(rotated(q_ned_marker, (0.0, 1.0, 0.0)))


def azimuth_from_body(yaw_ned_rad: float, azimuth_in_body_rad: float) -> float:
    """The azimuth of a direction known relative to the vehicle's heading, wrapped (Eq. 16)."""
    return wrap_pi(yaw_ned_rad + azimuth_in_body_rad)
