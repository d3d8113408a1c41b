"""Factors in polar form: wind by speed and direction, the start by distance, direction and height."""

import math
from collections.abc import Mapping
from typing import Any

SPEED, FROM = "wind.speed_mps", "wind.from_deg"
"""Steady wind, m/s, and where it blows from, degrees from north, clockwise (default 0)."""
DISTANCE, AZIMUTH, HEIGHT = "start.distance_m", "start.azimuth_deg", "start.height_m"
"""Where the landing starts: horizontal distance from the pad, metres (default 0), direction from it, degrees from north, clockwise
(default 0), and height above it, metres (default 20)."""
DEFAULT_HEIGHT_M = 20.0
_INSTEAD = {
    "wind": ("simulator.wind.north_mps", "simulator.wind.east_mps"),
    "start": ("simulator.airborne.north_m", "simulator.airborne.east_m", "simulator.airborne.down_m"),
}
KEYS = (SPEED, FROM, DISTANCE, AZIMUTH, HEIGHT)


def without_polar(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values by key of the settings only.

    Raises:
        ValueError: If a polar key is unknown, alone where it means nothing, or stands beside the settings that it replaces.
    """
    polar = {key: value for key, value in values.items() if key.partition(".")[0] in _INSTEAD}
    cartesian = {key: value for key, value in values.items() if key not in polar}
    for key, value in polar.items():
        _check(key, value, cartesian)
    if FROM in polar and SPEED not in polar:
        raise ValueError(f"{FROM}: a direction without a speed; add {SPEED}")
    if SPEED in polar:
        towards_rad = math.radians(polar.get(FROM, 0.0) + 180.0)
        cartesian["simulator.wind.north_mps"] = polar[SPEED] * math.cos(towards_rad)
        cartesian["simulator.wind.east_mps"] = polar[SPEED] * math.sin(towards_rad)
    if {DISTANCE, AZIMUTH, HEIGHT} & polar.keys():
        azimuth_rad, distance_m = math.radians(polar.get(AZIMUTH, 0.0)), polar.get(DISTANCE, 0.0)
        cartesian["simulator.airborne.north_m"] = distance_m * math.cos(azimuth_rad)
        cartesian["simulator.airborne.east_m"] = distance_m * math.sin(azimuth_rad)
        cartesian["simulator.airborne.down_m"] = -polar.get(HEIGHT, DEFAULT_HEIGHT_M)
    return cartesian


def _check(key: str, value: Any, cartesian: Mapping[str, Any]) -> None:
    if key not in KEYS:
        raise ValueError(f"{key} is no key; there are {', '.join(KEYS)}, and all keys of the settings")
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{key}: a number is needed (got {value!r})")
    doubled = [name for name in _INSTEAD[key.partition(".")[0]] if name in cartesian]
    if doubled:
        raise ValueError(f"{key} and {doubled[0]} say the same twice: leave one out")
