"""PX4's custom_mode: which flight mode it means, and which one to ask for."""

from schemas.vehicle import FlightMode

MAIN_AUTO = 4

_MAIN = {
    1: FlightMode.MANUAL,
    2: FlightMode.ALTITUDE,
    3: FlightMode.POSITION,
    6: FlightMode.OFFBOARD,
}
_AUTO_SUB = {
    2: FlightMode.TAKEOFF,
    3: FlightMode.HOLD,
    4: FlightMode.MISSION,
    5: FlightMode.RETURN,
    6: FlightMode.LAND,
    9: FlightMode.PRECISION_LAND,
}
_ASKABLE = {FlightMode.HOLD: (MAIN_AUTO, 3), FlightMode.LAND: (MAIN_AUTO, 6), FlightMode.OFFBOARD: (6, 0)}


def mode_of(custom_mode: int) -> FlightMode:
    """The flight mode: main mode in bits 16-23, sub-mode of AUTO in bits 24-31."""
    main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
    if main == MAIN_AUTO:
        return _AUTO_SUB.get(sub, FlightMode.OTHER)
    if custom_mode == 0:
        return FlightMode.UNKNOWN
    return _MAIN.get(main, FlightMode.OTHER) if sub == 0 else FlightMode.OTHER


def main_and_sub(mode: FlightMode) -> tuple[int, int]:
    """Main and sub-mode for DO_SET_MODE.

    Raises:
        KeyError: For a mode that the commander never asks for.
    """
    return _ASKABLE[mode]
