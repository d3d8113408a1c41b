"""What the autopilot says of itself, gathered from the messages that say a part of it each."""

from typing import Any

from schemas.message import GlobalPosition
from schemas.vehicle import FlightMode, LandedState, VehicleStatus
from services.commander.dialect import mavlink
from services.commander.px4_mode import mode_of
from services.commander.status_text import TextJoiner

_LANDED = {
    mavlink.MAV_LANDED_STATE_ON_GROUND: LandedState.ON_GROUND,
    mavlink.MAV_LANDED_STATE_IN_AIR: LandedState.IN_AIR,
    mavlink.MAV_LANDED_STATE_TAKEOFF: LandedState.TAKING_OFF,
    mavlink.MAV_LANDED_STATE_LANDING: LandedState.LANDING,
}


class AutopilotStatus:
    """The newest of everything. HEARTBEAT and CURRENT_MODE both name the mode; the later one counts."""

    def __init__(self) -> None:
        self._texts = TextJoiner()
        self.reset()

    def reset(self) -> None:
        """Forget all: another autopilot, or the same one booted anew."""
        self.armed = False
        self._custom_mode = 0
        self._intended: int | None = None
        self._landed = LandedState.UNDEFINED
        self._system_status = mavlink.MAV_STATE_UNINIT
        self._prearm_good = False
        self._home: GlobalPosition | None = None
        self._battery: float | None = None
        self._text = ""

    def take_heartbeat(self, message: Any) -> None:
        """Take the autopilot's HEARTBEAT."""
        self.armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        self._system_status = message.system_status
        if message.custom_mode != self._custom_mode and self._intended is not None and not self._in_failsafe:
            # Somebody chose it. What CURRENT_MODE said was intended before would make a failsafe of the pilot's choice.
            self._intended = message.custom_mode
        self._custom_mode = message.custom_mode

    def take_current_mode(self, message: Any) -> None:
        """Take CURRENT_MODE; an intended mode of 0 says nothing."""
        self._custom_mode = message.custom_mode
        self._intended = message.intended_custom_mode or None

    def take_extended_state(self, message: Any) -> None:
        """Take EXTENDED_SYS_STATE."""
        self._landed = _LANDED.get(message.landed_state, LandedState.UNDEFINED)

    def take_sys_status(self, message: Any) -> None:
        """Take SYS_STATUS: its pre-arm bit."""
        self._prearm_good = bool(message.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_PREARM_CHECK)

    def take_battery(self, message: Any) -> None:
        """Take the first battery's BATTERY_STATUS; -1 percent means unknown."""
        if message.id == 0:
            self._battery = message.battery_remaining / 100.0 if 0 <= message.battery_remaining <= 100 else None

    def take_home(self, home: GlobalPosition) -> None:
        """Take HOME_POSITION."""
        self._home = home

    def take_text(self, message: Any) -> None:
        """Take a STATUSTEXT."""
        self._text = self._texts.take(message) or self._text

    @property
    def _in_failsafe(self) -> bool:
        return bool(self._system_status >= mavlink.MAV_STATE_CRITICAL)

    @property
    def _ready_to_arm(self) -> bool:
        return self._system_status == mavlink.MAV_STATE_STANDBY and self._prearm_good

    def facts(self) -> tuple[object, ...]:
        """All that `snapshot` tells of the autopilot, quick to compare."""
        return (
            self.armed,
            self._custom_mode,
            self._intended,
            self._landed,
            self._in_failsafe,
            self._ready_to_arm,
            self._home,
            self._battery,
            self._text,
        )

    def snapshot(self, at_ns: int, connected: bool) -> VehicleStatus:
        """All of it, as of `at_ns`."""
        mode = mode_of(self._custom_mode)
        return VehicleStatus(
            at_ns=at_ns,
            connected=connected,
            armed=self.armed,
            mode=mode,
            intended_mode=FlightMode.UNKNOWN if self._intended is None else mode_of(self._intended),
            custom_mode=self._custom_mode,
            landed_state=self._landed,
            failsafe=self._in_failsafe,
            ready_to_arm=self._ready_to_arm,
            home=self._home,
            battery_remaining=self._battery,
            last_text=self._text,
        )
