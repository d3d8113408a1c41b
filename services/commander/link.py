"""The MAVLink link to the autopilot, without sockets and clocks: bytes and the time in, bytes and typed states out."""

from collections import Counter, deque
from collections.abc import Callable, Mapping
from typing import Any

from alight.runtime.clock import nanoseconds, seconds
from schemas.settings.commander import CommanderSettings
from schemas.vehicle import GimbalState, VehicleState, VehicleStatus
from services.commander.autopilot_clock import AutopilotClock
from services.commander.autopilot_status import AutopilotStatus
from services.commander.command_queue import Command, CommandQueue, Outcome, Result, command_message
from services.commander.dialect import mavlink
from services.commander.framing import MavlinkFramer
from services.commander.gimbal_reports import GimbalReports
from services.commander.hearing import Hearing
from services.commander.parameters import Parameters, complaints_about
from services.commander.status_text import status_text
from services.commander.stream_requests import StreamRequests
from services.commander.vehicle_assembly import NS_PER_MS, VehicleAssembly

HEARTBEAT_PERIOD_NS = nanoseconds(1.0)
MAX_HEARTBEAT_GAP_NS = 5 * HEARTBEAT_PERIOD_NS
TIMESYNC_PERIOD_NS = nanoseconds(0.1)
AUTOPILOT_COMPONENT = mavlink.MAV_COMP_ID_AUTOPILOT1
DEAF_PART = 0.8
"""What is known of the autopilot counts as old a little before the vehicle's state does: what that calls for is a mode."""
REBOOT_MS = 1000
"""Boot time that runs backwards by more than this is a reboot; by less, packets that overtook each other."""


class AutopilotLink:
    """One autopilot at the other end. Feed it with `receive` and `advance`, send what `outgoing` returns, take what has come."""

    def __init__(self, settings: CommanderSettings) -> None:
        self._settings = settings.link
        self._encoder = mavlink.MAVLink(None, settings.link.system_id, settings.link.component_id)
        self._commands = CommandQueue(settings.link.command_tries, nanoseconds(settings.link.command_timeout_s))
        self._streams = StreamRequests(settings.link)
        self._parameters = Parameters()
        self.clock = AutopilotClock()
        self._assembly = VehicleAssembly(self.clock)
        self._status = AutopilotStatus()
        self._told: tuple[tuple[object, ...], VehicleStatus] | None = None
        self._hears_gimbals = settings.gimbal == "heard"
        self._gimbals = GimbalReports(settings.fixed_gimbal_rpy_deg, self.clock, self._assembly)
        self._system: int | None = settings.link.autopilot_system_id or None
        self._heard = False
        self._hearing = Hearing(DEAF_PART * settings.state_stale_after_s, settings.state_stale_after_s)
        self.stood_still_ns = 0
        """By how much the time has gone on (or back) without this process, all in all."""
        self._heartbeat_ns = 0
        self._newest_boot_ms = 0
        self._next_heartbeat_ns = 0
        self._next_timesync_ns = 0
        self._out = bytearray()
        self._states: deque[VehicleState] = deque(maxlen=256)
        self._outcomes: deque[Outcome] = deque(maxlen=64)
        self._counts: Counter[str] = Counter()
        self.reboots = 0
        """How often the autopilot's boot time ran backwards."""
        self._takers: dict[str, Callable[[Any, int], None]] = {
            "GLOBAL_POSITION_INT": self._take_position,
            "ATTITUDE_QUATERNION": self._take_attitude,
            "TIMESYNC": self._take_timesync,
            "COMMAND_ACK": self._take_ack,
            "HOME_POSITION": self._take_home,
            "GPS_RAW_INT": lambda message, _: self._assembly.take_gps(message, self._status.armed),
            "CURRENT_MODE": self._take_current_mode,
            "EXTENDED_SYS_STATE": lambda message, _: self._status.take_extended_state(message),
            "SYS_STATUS": lambda message, _: self._status.take_sys_status(message),
            "BATTERY_STATUS": lambda message, _: self._status.take_battery(message),
            "STATUSTEXT": lambda message, _: self._status.take_text(message),
            "PARAM_VALUE": lambda message, _: self._parameters.take(message),
        }
        self._framer = MavlinkFramer({"HEARTBEAT", "GIMBAL_DEVICE_ATTITUDE_STATUS", *self._takers})

    # What comes in -------------------------------------------------------------------------------------------------

    def receive(self, data: bytes, now_ns: int) -> bool:
        """Take bytes from the autopilot's side, in chunks of any size. Never raises for what is in them.

        Returns:
            Whether there was anything in them but signs of life.
        """
        self._look(now_ns)
        messages = self._framer.feed(data)
        for message in messages:
            system, component = message.get_srcSystem(), message.get_srcComponent()
            kind = message.get_type()
            if kind == "HEARTBEAT" and component == AUTOPILOT_COMPONENT:
                self._take_heartbeat(message, system, now_ns)
            elif kind == "GIMBAL_DEVICE_ATTITUDE_STATUS" and system == self._system:
                if self._hears_gimbals:
                    self._gimbals.take(message, now_ns)
            elif self._heard and system == self._system and component == AUTOPILOT_COMPONENT:
                self._hearing.heard(now_ns)
                self._streams.heard(message.get_msgId(), now_ns)
                taker = self._takers.get(kind)
                if taker is not None:
                    taker(message, now_ns)
            else:
                self._counts["of_others"] += 1
        for sender in self._framer.unread:
            if self._heard and sender == (self._system, AUTOPILOT_COMPONENT):
                self._hearing.heard(now_ns)
            else:
                self._counts["of_others"] += 1
        return bool(messages)

    def advance(self, now_ns: int) -> None:
        """Do what is due: heartbeat, TIMESYNC, requests, repetitions."""
        self._look(now_ns)
        if now_ns >= self._next_heartbeat_ns:
            self._next_heartbeat_ns = now_ns + HEARTBEAT_PERIOD_NS
            self._send_heartbeat()
        if not self.connected(now_ns):
            self._commands.recall_flight_commands()
            return
        if now_ns >= self._next_timesync_ns:
            self._next_timesync_ns = now_ns + TIMESYNC_PERIOD_NS
            self._send(mavlink.MAVLink_timesync_message(0, now_ns))
        if not self.is_waiting(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL):
            # They queue up behind each other; an autopilot that answers none would let the queue grow for ever.
            for command in self._streams.due(now_ns):
                self._commands.submit(command)
        for message in self._parameters.due(now_ns, *self._target()):
            self._send(message)
        self._send_commands(now_ns)

    # What goes out -------------------------------------------------------------------------------------------------

    def outgoing(self) -> bytes:
        """The bytes to send now; empties the buffer."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def command(self, command: Command, now_ns: int) -> None:
        """Send a command now, and again until it is answered."""
        self._commands.submit(command)
        self._send_commands(now_ns)

    def recall_flight_commands(self) -> None:
        """Repeat none of the flight commands under way."""
        self._commands.recall_flight_commands()

    def is_waiting(self, command_id: int) -> bool:
        """Whether a command of this MAV_CMD waits for its answer."""
        return self._commands.is_waiting(command_id)

    def send_setpoint(self, message: Any) -> None:
        """Send a SET_POSITION_TARGET_GLOBAL_INT (nothing ever confirms one)."""
        message.target_system, message.target_component = self._target()
        self._send(message)

    def say(self, text: str, severity: int) -> None:
        """Send a STATUSTEXT, which the autopilot forwards to the ground stations."""
        self._send(status_text(f"Alight: {text}", severity))

    # What is known -------------------------------------------------------------------------------------------------

    def take_states(self) -> list[VehicleState]:
        """The vehicle states that have come since the last call."""
        states = list(self._states)
        self._states.clear()
        return states

    def take_outcomes(self) -> list[Outcome]:
        """What became of flight commands since the last call."""
        outcomes = list(self._outcomes)
        self._outcomes.clear()
        return outcomes

    def connected(self, now_ns: int) -> bool:
        """Whether anything came within the timeout, and a heartbeat not too long ago: it alone says whether the vehicle is armed.

        A link that loses packets, or a simulation that runs slowly, may miss a heartbeat or two while all else flows.
        """
        if self._hearing.heard_ns is None:
            return False
        silent = now_ns - self._hearing.heard_ns > nanoseconds(self._settings.timeout_s)
        return not silent and now_ns - self._heartbeat_ns <= MAX_HEARTBEAT_GAP_NS

    def deaf_for_s(self, now_ns: int) -> float | None:
        """For how long somebody may have changed the mode unheard, seconds; None if the mode is known as of now."""
        return self._hearing.deaf_for_s(now_ns)

    def silence_s(self, now_ns: int) -> float | None:
        """Since anything came from the autopilot, seconds; None if nothing ever did."""
        heard_ns = self._hearing.heard_ns
        return None if heard_ns is None else seconds(now_ns - heard_ns)

    def status(self, now_ns: int) -> VehicleStatus:
        """What the autopilot is doing; its time is that since when all of it has been so."""
        facts = self.facts(now_ns)
        if self._told is None or self._told[0] != facts:
            self._told = (facts, self._status.snapshot(now_ns, self.connected(now_ns)))
        return self._told[1]

    def facts(self, now_ns: int) -> tuple[object, ...]:
        """Changes whenever `status` would, but for its time."""
        return (self.connected(now_ns), *self._status.facts())

    def gimbal(self, now_ns: int) -> GimbalState:
        """How the camera is turned."""
        return self._gimbals.state(now_ns)

    @property
    def parameters(self) -> Mapping[str, float]:
        """The autopilot's parameters that have been read."""
        return self._parameters.values

    def complaints(self, now_ns: int) -> tuple[str, ...]:
        """What is wrong with the link or with the autopilot's settings."""
        if not self._heard:
            return ("no autopilot has been heard: check commander.vehicle_url and that the autopilot is running",)
        if not self.connected(now_ns):
            return (f"the autopilot has been silent for {self.silence_s(now_ns):.1f} s",)
        silence = "nobody has been heard to name the mode since a silence: none is asked for"
        deaf = () if self.deaf_for_s(now_ns) is None else (silence,)
        settings = (*self._parameters.complaints(), *complaints_about(self._parameters.values, self._passes_for_gcs))
        return (*deaf, *settings, *self.clock.complaints(now_ns), *self._gimbals.complaints(now_ns))

    def counters(self) -> Mapping[str, int]:
        """Everything counted since start."""
        return {
            **self._framer.counts,
            **self._counts,
            **self._gimbals.counters(),
            "states_dropped": self._assembly.dropped,
            "times_deaf": self._hearing.times_deaf,
            "stream_requests": self._streams.requests,
            "autopilot_reboots": self.reboots,
            "clock_restarts": self.clock.restarts,
            "clock_outliers": self.clock.outliers,
        }

    # Messages ------------------------------------------------------------------------------------------------------

    def _take_heartbeat(self, message: Any, system: int, now_ns: int) -> None:
        if message.autopilot == mavlink.MAV_AUTOPILOT_INVALID or self._system not in (None, system):
            self._counts["of_others"] += 1
            return
        self._system, self._heard = system, True
        self._heartbeat_ns = now_ns
        self._hearing.heard(now_ns)
        self._status.take_heartbeat(message)
        self._hearing.told_mode(now_ns)

    def _take_current_mode(self, message: Any, now_ns: int) -> None:
        self._status.take_current_mode(message)
        self._hearing.told_mode(now_ns)

    def _look(self, now_ns: int) -> None:
        """What goes by while this process stands still, or its clock is set, is no silence of the autopilot."""
        heard_well = self._hearing.deaf_for_s(now_ns) is None
        without_us_ns = self._hearing.look(now_ns)
        if heard_well and self._hearing.deaf_for_s(now_ns) is not None:
            # What was meant for the moment before must not go out when it ends: a pilot may fly by then. What is submitted from now on
            # is what a person asks for.
            self._commands.recall_flight_commands()
        if without_us_ns:
            self.stood_still_ns += without_us_ns
            self._heartbeat_ns += without_us_ns
            self._next_heartbeat_ns = self._next_timesync_ns = now_ns

    def _take_position(self, message: Any, now_ns: int) -> None:
        self._note_boot_time(message.time_boot_ms, now_ns)
        self._keep(self._assembly.take_position(message, now_ns), now_ns)

    def _take_attitude(self, message: Any, now_ns: int) -> None:
        self._note_boot_time(message.time_boot_ms, now_ns)
        self._keep(self._assembly.take_attitude(message, now_ns), now_ns)
        self._gimbals.join()

    def _keep(self, state: VehicleState | None, now_ns: int) -> None:
        if state is not None:
            self._states.append(state)
            self._hearing.sampled(state.at_ns, now_ns)

    def _take_timesync(self, message: Any, now_ns: int) -> None:
        if message.tc1 == 0:
            self._send(mavlink.MAVLink_timesync_message(now_ns, message.ts1))
        else:
            self.clock.take_reply(message.ts1, message.tc1, now_ns)

    def _take_ack(self, message: Any, now_ns: int) -> None:
        own = (self._settings.system_id, self._settings.component_id)
        if (message.target_system, message.target_component) not in (own, (0, 0)):
            self._counts["acks_of_others"] += 1
            return
        outcome = self._commands.take_ack(message, now_ns)
        if outcome is not None:
            self._note_outcome(outcome)

    def _take_home(self, message: Any, _: int) -> None:
        try:
            home = self._assembly.global_position(message.latitude, message.longitude, message.altitude)
        except ValueError:
            self._counts["malformed"] += 1
            return
        self._status.take_home(home)

    def _note_boot_time(self, boot_ms: int, now_ns: int) -> None:
        if boot_ms < self._newest_boot_ms - REBOOT_MS:
            self.reboots += 1
            self._forget_autopilot()
        self._newest_boot_ms = max(self._newest_boot_ms, boot_ms)
        self.clock.take_arrival(boot_ms * NS_PER_MS, now_ns)

    def _forget_autopilot(self) -> None:
        self._newest_boot_ms = 0
        self.clock.reset()
        self._status.reset()
        self._assembly.reset()
        self._gimbals.reset()
        self._streams.reset()
        self._parameters.reset()
        self._commands.clear()

    # Sending -------------------------------------------------------------------------------------------------------

    def _target(self) -> tuple[int, int]:
        return self._system or 0, AUTOPILOT_COMPONENT

    def _send(self, message: Any) -> None:
        self._out += message.pack(self._encoder)
        self._encoder.seq = (self._encoder.seq + 1) % 256

    @property
    def _passes_for_gcs(self) -> bool:
        """By what the autopilot said last: whoever sets NAV_DLL_ACT in flight relies from then on on the loss being noticed."""
        if self._settings.heartbeat == "auto":
            return self._parameters.values.get("NAV_DLL_ACT") == 0.0
        return self._settings.heartbeat == "gcs"

    def _send_heartbeat(self) -> None:
        kind = mavlink.MAV_TYPE_GCS if self._passes_for_gcs else mavlink.MAV_TYPE_ONBOARD_CONTROLLER
        invalid, active = mavlink.MAV_AUTOPILOT_INVALID, mavlink.MAV_STATE_ACTIVE
        self._send(mavlink.MAVLink_heartbeat_message(kind, invalid, 0, 0, active, 3))

    def _send_commands(self, now_ns: int) -> None:
        to_send, given_up = self._commands.due(now_ns)
        for command, repetition in to_send:
            self._send(command_message(command, repetition, *self._target()))
        for outcome in given_up:
            self._note_outcome(outcome)

    def _note_outcome(self, outcome: Outcome) -> None:
        if outcome.command.flight:
            self._outcomes.append(outcome)
        if outcome.result is not Result.ACCEPTED:
            self._counts[f"commands_{outcome.result}"] += 1
