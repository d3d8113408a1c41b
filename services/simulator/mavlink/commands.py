"""COMMAND_LONG and COMMAND_INT: what each does and how it is answered."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from services.simulator.autopilot.autopilot import Autopilot, Severity
from services.simulator.autopilot.mode import Mode
from services.simulator.autopilot.result import Result
from services.simulator.estimator import Estimate
from services.simulator.mavlink.dialect import Message, dialect
from services.simulator.mavlink.link import Link
from services.simulator.mavlink.telemetry import Telemetry
from services.simulator.world import World

INT_MAX = 2**31 - 1
FORCE_DISARM = 21196
CUSTOM_MODE_ENABLED = 1
CHANGE_MODE = 1
LARGEST_PARAMETER = 1e9
HIGHEST_M = 1e5
NO_ANSWER = frozenset({1000, 1001, 205})
"""Gimbal commands: with MNT_MODE_IN -1 nobody answers them."""
ONLY_SWITCHED_OFF = frozenset({29, 36, 105, 241, 290, 291, 331, 441, 514, 12901, 12904})
"""Streams of PX4 that do not exist here: switching them off succeeds."""


@dataclass(frozen=True)
class Command:
    """COMMAND_LONG and COMMAND_INT alike."""

    number: int
    param1: float
    param2: float
    param3: float
    param4: float
    latitude_deg: float
    """NaN for none."""
    longitude_deg: float
    z: float

    @classmethod
    def from_message(cls, message: Message) -> "Command":
        """Read either message."""
        if message.get_type() == "COMMAND_LONG":
            x, y, z = message.param5, message.param6, message.param7
        else:
            nowhere = INT_MAX in (message.x, message.y)
            x, y, z = (math.nan, math.nan, message.z) if nowhere else (message.x * 1e-7, message.y * 1e-7, message.z)
        first_four = (message.param1, message.param2, message.param3, message.param4)
        one, two, three, four = (sane(value, LARGEST_PARAMETER) for value in first_four)
        return cls(message.command, one, two, three, four, sane(x, 180.0), sane(y, 180.0), sane(z, HIGHEST_M))


def sane(value: float, bound: float) -> float:
    """The value, or NaN (not given) for what is infinite or beyond all reason."""
    return value if abs(value) <= bound else math.nan


def set_and_not_zero(*values: float) -> bool:
    """Whether any parameter that is not supported is used."""
    return any(not math.isnan(value) and value != 0.0 for value in values)


class Commands:
    """Carries out commands. A handler returns the result, or None where PX4 gives no answer."""

    def __init__(self, autopilot: Autopilot, estimate: Estimate, telemetry: Telemetry, world: World) -> None:
        self._autopilot = autopilot
        self._estimate = estimate
        self._telemetry = telemetry
        self._world = world
        self._handlers: dict[int, Callable[[Command, Link, list[Message]], Result | None]] = {
            dialect.MAV_CMD_COMPONENT_ARM_DISARM: self._arm_disarm,
            dialect.MAV_CMD_NAV_TAKEOFF: self._takeoff,
            dialect.MAV_CMD_NAV_LAND: self._land,
            dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: self._return,
            dialect.MAV_CMD_DO_SET_MODE: self._set_mode,
            dialect.MAV_CMD_DO_REPOSITION: self._reposition,
            dialect.MAV_CMD_DO_CHANGE_ALTITUDE: self._change_altitude,
            dialect.MAV_CMD_DO_CHANGE_SPEED: self._change_speed,
            dialect.MAV_CMD_DO_SET_HOME: self._set_home,
            dialect.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            dialect.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            dialect.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: self._request_capabilities,
        }

    def handle(self, message: Message, link: Link) -> list[Message]:
        """Everything to send back: what was asked for, then the acknowledgement."""
        return self.carry_out(Command.from_message(message), link, message.get_srcSystem(), message.get_srcComponent())

    def carry_out(self, command: Command, link: Link, system: int, component: int) -> list[Message]:
        """Carry out a command of the given sender."""
        if command.number in NO_ANSWER:
            return []
        handler = self._handlers.get(command.number)
        replies: list[Message] = []
        result = handler(command, link, replies) if handler else Result.UNSUPPORTED
        if result is not None:
            replies.append(dialect.MAVLink_command_ack_message(command.number, int(result), 0, 0, system, component))
        return replies

    def _arm_disarm(self, command: Command, _link: Link, _replies: list[Message]) -> Result | None:
        wanted = round(command.param1) if math.isfinite(command.param1) else -1
        if wanted not in (0, 1):
            self._autopilot.say(Severity.CRITICAL, f"Unsupported ARM_DISARM param: {command.param1:.3f}")
            return None
        if wanted:
            return self._autopilot.arm(self._estimate)
        return self._autopilot.disarm(forced=command.param2 == FORCE_DISARM)

    def _takeoff(self, command: Command, _link: Link, _replies: list[Message]) -> Result:
        if set_and_not_zero(command.param1, command.param2, command.param3):
            return Result.DENIED
        down_m = self._autopilot.origin_altitude_amsl_m - command.z
        return self._autopilot.take_off(down_m, self._estimate)

    def _land(self, command: Command, _link: Link, _replies: list[Message]) -> Result:
        if set_and_not_zero(command.param1, command.param3):
            return Result.DENIED
        return self._autopilot.request_mode(Mode.LAND, self._estimate)

    def _return(self, command: Command, _link: Link, _replies: list[Message]) -> Result:
        if set_and_not_zero(command.param1, command.param2, command.param3):
            return Result.DENIED
        self._autopilot.say(Severity.INFO, "Returning to launch")
        return self._autopilot.request_mode(Mode.RTL, self._estimate)

    def _set_mode(self, command: Command, _link: Link, _replies: list[Message]) -> Result:
        if not all(math.isfinite(value) for value in (command.param1, command.param2, command.param3)):
            return Result.TEMPORARILY_REJECTED
        if not int(command.param1) & CUSTOM_MODE_ENABLED:
            return Result.TEMPORARILY_REJECTED
        mode = Mode.from_main_and_sub(int(command.param2), int(command.param3))
        if mode is None:
            self._autopilot.say(Severity.CRITICAL, "Unsupported main mode")
            return Result.TEMPORARILY_REJECTED
        return self._autopilot.request_mode(mode, self._estimate)

    def _reposition(self, command: Command, _link: Link, _replies: list[Message]) -> Result:
        north, east = math.nan, math.nan
        if abs(command.latitude_deg) <= 90.0 and not math.isnan(command.longitude_deg):
            north, east = self._world.metres(command.latitude_deg, command.longitude_deg)
        change_mode = math.isfinite(command.param2) and bool(int(command.param2) & CHANGE_MODE)
        down = self._autopilot.origin_altitude_amsl_m - command.z
        speed = command.param1 if command.param1 > 0.0 else math.nan
        return self._autopilot.reposition((north, east, down), command.param4, speed, change_mode, self._estimate)

    def _change_altitude(self, command: Command, _link: Link, _replies: list[Message]) -> Result:
        down = self._autopilot.origin_altitude_amsl_m - command.param1
        nan = math.nan
        cruise = self._autopilot.guidance.cruise_mps
        return self._autopilot.reposition((nan, nan, down), nan, cruise, True, self._estimate)

    def _change_speed(self, command: Command, _link: Link, _replies: list[Message]) -> Result:
        self._autopilot.guidance.cruise_mps = command.param2 if command.param2 > 0.0 else math.nan
        return Result.ACCEPTED

    def _set_home(self, command: Command, _link: Link, _replies: list[Message]) -> Result:
        estimate = self._estimate
        if command.param1 == 1.0:
            self._autopilot.set_home((estimate.north, estimate.east, estimate.down), estimate.yaw)
            return Result.ACCEPTED
        if math.isnan(command.longitude_deg) or math.isnan(command.z) or not abs(command.latitude_deg) <= 90.0:
            return Result.DENIED
        north, east = self._world.metres(command.latitude_deg, command.longitude_deg)
        self._autopilot.set_home((north, east, self._autopilot.origin_altitude_amsl_m - command.z), estimate.yaw)
        return Result.ACCEPTED

    def _set_interval(self, command: Command, link: Link, _replies: list[Message]) -> Result:
        if not math.isfinite(command.param1):
            return Result.FAILED
        message_id = round(command.param1)
        if message_id in ONLY_SWITCHED_OFF and command.param2 < 0.0:
            return Result.ACCEPTED
        return (
            Result.ACCEPTED if link.set_interval(message_id, command.param2, self._autopilot.now_s) else Result.FAILED
        )

    def _get_interval(self, command: Command, link: Link, replies: list[Message]) -> Result:
        if not math.isfinite(command.param1):
            return Result.FAILED
        message_id = round(command.param1)
        replies.append(dialect.MAVLink_message_interval_message(message_id & 0xFFFF, link.interval_us(message_id)))
        return Result.ACCEPTED

    def _request_message(self, command: Command, link: Link, replies: list[Message]) -> Result:
        message_id = round(command.param1) if math.isfinite(command.param1) else -1
        stale = (
            message_id == dialect.MAVLINK_MSG_ID_HOME_POSITION
            and link.sent_home_version == self._autopilot.home_version
        )
        message = None if stale else self._telemetry.build(message_id, link)
        if message is None:
            # As in PX4: also when nothing new has come since the stream last sent it.
            return Result.DENIED
        replies.append(message)
        return Result.ACCEPTED

    def _request_capabilities(self, _command: Command, link: Link, replies: list[Message]) -> Result:
        message = self._telemetry.build(dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION, link)
        replies.extend([] if message is None else [message])
        return Result.ACCEPTED
