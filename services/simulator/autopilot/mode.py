"""Flight modes as PX4 numbers them."""

from enum import IntEnum

ARMED_FLAG = 128


class Mode(IntEnum):
    """The value is HEARTBEAT.custom_mode: main mode in bits 16 to 23, sub-mode in bits 24 to 31."""

    MANUAL = 0x00010000
    ALTCTL = 0x00020000
    POSCTL = 0x00030000
    TAKEOFF = 0x02040000
    LOITER = 0x03040000
    MISSION = 0x04040000
    RTL = 0x05040000
    LAND = 0x06040000
    PRECLAND = 0x09040000
    ACRO = 0x00050000
    OFFBOARD = 0x00060000
    STABILIZED = 0x00070000

    @classmethod
    def from_main_and_sub(cls, main: int, sub: int) -> "Mode | None":
        """The mode that MAV_CMD_DO_SET_MODE names, None for none such. Only AUTO (4) has sub-modes here."""
        try:
            return cls(main << 16 | (sub << 24 if main == 4 else 0))
        except ValueError:
            return None


AUTO_MODES = frozenset({Mode.TAKEOFF, Mode.LOITER, Mode.MISSION, Mode.RTL, Mode.LAND, Mode.PRECLAND})
STICK_MODES = frozenset({Mode.MANUAL, Mode.ALTCTL, Mode.POSCTL, Mode.ACRO, Mode.STABILIZED})

_BASE_MODE = {Mode.OFFBOARD: 17, Mode.MANUAL: 65, Mode.ACRO: 65}
_STANDARD_MODE = {Mode.POSCTL: 1, Mode.ALTCTL: 3, Mode.RTL: 5, Mode.MISSION: 6, Mode.LAND: 7, Mode.TAKEOFF: 8}


def base_mode(mode: Mode, armed: bool) -> int:
    """HEARTBEAT.base_mode: 29 in the automatic modes, 17 in OFFBOARD, 81 with sticks; 128 more when armed."""
    bits = 29 if mode in AUTO_MODES else _BASE_MODE.get(mode, 81)
    return bits | (ARMED_FLAG if armed else 0)


def standard_mode(mode: Mode) -> int:
    """CURRENT_MODE.standard_mode (MAV_STANDARD_MODE), 0 where there is none."""
    return _STANDARD_MODE.get(mode, 0)
