"""An autopilot that says exactly what a test makes it say, and keeps what the commander sends to it."""

import struct
from typing import Any

from pymavlink.dialects.v20 import development as mavlink

from alight.runtime.node import Arrival, Outputs, Publication, Transmission
from schemas import topics
from schemas.estimate import PadEstimate
from schemas.message import GlobalPosition
from schemas.mission import MissionReply, MissionRequest, MissionStatus, Phase, Verb
from schemas.settings import Settings
from schemas.vehicle import GimbalState, VehicleState, VehicleStatus
from services.commander.framing import MavlinkFramer
from services.commander.node import CommanderNode

START_NS = 1_767_225_600_000_000_000
TICK_NS = 20_000_000
HOLD, TAKEOFF, RETURN, LAND, OFFBOARD, POSITION = 0x03040000, 0x02040000, 0x05040000, 0x06040000, 0x00060000, 0x00030000
ON_GROUND, IN_AIR = 1, 2
STANDBY, ACTIVE, CRITICAL = 3, 4, 5
ACCEPTED = 0
LATITUDE_E7, LONGITUDE_E7, ALTITUDE_MM = 470_000_000, 80_000_000, 510_000


class ScriptedAutopilot:
    """A vehicle in the air that holds, 10 m above a pad, with a commander at the other end of its link."""

    def __init__(self, **commander: Any) -> None:
        self.now_ns = START_NS
        self.mode, self.armed, self.landed, self.system_status = HOLD, True, IN_AIR, ACTIVE
        self.answers = True
        """Whether commands and TIMESYNC are answered."""
        self.obeys = True
        """Whether modes that are asked for are flown."""
        self.linked = True
        """Whether anything goes over the link, either way."""
        self.only_heartbeats = False
        self.result: dict[int, int] = {}
        """How a MAV_CMD is answered, where it is not ACCEPTED; it is not carried out then."""
        self.sees_pad = False
        self.altitude_mm = ALTITUDE_MM
        self.parameters: dict[str, int] = {}
        """What it tells when asked; of others it says nothing."""
        self.heartbeat_type: int | None = None
        """What the commander last said that it is."""
        self.sent: list[Any] = []
        """The commands and setpoints that reached the autopilot."""
        self.states: list[VehicleState] = []
        self.gimbals: list[GimbalState] = []
        self.replies: list[MissionReply] = []
        self.mission: MissionStatus | None = None
        self.vehicle: VehicleStatus | None = None
        self._settings = Settings.model_validate({"commander": commander})
        self.node = CommanderNode(self._settings)
        self._booted_ns = START_NS - 10_000_000_000
        self._encoder = mavlink.MAVLink(None, 1, 1)
        self._framer = MavlinkFramer()
        self._ticks = self._requests = 0
        self.wait(1.0)

    @property
    def phase(self) -> Phase | None:
        return None if self.mission is None else self.mission.phase

    @property
    def boot_ms(self) -> int:
        return (self.now_ns - self._booted_ns) // 1_000_000

    def say(self, *messages: Any) -> None:
        """Send messages in one datagram."""
        self.forward(self._encoder, *messages)

    def forward(self, sender: Any, *messages: Any) -> None:
        """Send on what another component says, in one datagram."""
        if self.linked:
            data = b"".join(message.pack(sender) for message in messages)
            self._take(self.node.on_bytes("vehicle", data, self.now_ns))

    def wait(self, for_s: float) -> None:
        """Let time pass; the usual streams come in."""
        for _ in range(round(for_s * 1e9 / TICK_NS)):
            self.stream()
            if self.sees_pad:
                self._deliver(topics.PAD_ESTIMATE, self._estimate())
            self._take(self.node.on_tick(self.now_ns))

    def stream(self) -> None:
        """Let one period pass: the usual streams come in, and the commander does not look around of its own accord."""
        self.now_ns += TICK_NS
        self._ticks += 1
        if self._ticks % 50 == 1:
            flags = 0x80 * self.armed + 1
            self.say(mavlink.MAVLink_heartbeat_message(2, 12, flags, self.mode, self.system_status, 3))
        if self.only_heartbeats:
            return
        if self._ticks % 50 == 1:
            home = (LATITUDE_E7, LONGITUDE_E7, ALTITUDE_MM - 10_000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)
            self.say(mavlink.MAVLink_home_position_message(*home))
        if self._ticks % 5 == 1:
            prearm_good = mavlink.MAV_SYS_STATUS_PREARM_CHECK
            self.say(
                mavlink.MAVLink_current_mode_message(0, self.mode, self.mode),
                mavlink.MAVLink_extended_sys_state_message(0, self.landed),
                mavlink.MAVLink_sys_status_message(0, 0, prearm_good, 0, 0, 0, -1, 0, 0, 0, 0, 0, 0),
                mavlink.MAVLink_gps_raw_int_message(0, 3, 0, 0, 500_000, 0, 0, 0, 0, 9, 547_000),
            )
        self.say(mavlink.MAVLink_attitude_quaternion_message(self.boot_ms, 1, 0, 0, 0, 0, 0, 0), self.position())

    def tell_parameter(self, name: str) -> None:
        """Send a PARAM_VALUE as PX4 does: the integer's bytes in the place of the float."""
        bytewise = struct.unpack("<f", struct.pack("<i", self.parameters[name]))[0]
        self.say(mavlink.MAVLink_param_value_message(name.encode(), bytewise, mavlink.MAV_PARAM_TYPE_INT32, 1, 0))

    def ask(self, verb: Verb, **more: Any) -> None:
        reply = self.try_asking(verb, **more)
        assert reply.accepted, reply.reason

    def try_asking(self, verb: Verb, **more: Any) -> MissionReply:
        """Ask for what may be refused."""
        self._requests += 1
        return self.ask_again(verb, **more)

    def ask_again(self, verb: Verb, **more: Any) -> MissionReply:
        """Ask once more under the last request's id, as one does who has seen no reply."""
        request = MissionRequest(at_ns=self.now_ns, request_id=f"{self._requests}", verb=verb, **more)
        self._deliver(topics.REQUEST, request)
        return self.replies[-1]

    def restart_commander(self) -> None:
        """Another process takes the commander's place and knows nothing yet."""
        self.node = CommanderNode(self._settings)

    def reboot(self) -> None:
        self._booted_ns = self.now_ns

    def set_clock_back(self, by_s: float) -> None:
        """The clock of the commander's computer; the autopilot's time since boot runs on."""
        self.now_ns -= round(by_s * 1e9)
        self._booted_ns -= round(by_s * 1e9)

    def commands(self, command: int) -> list[Any]:
        """Those of one MAV_CMD that arrived."""
        return [message for message in self.sent if getattr(message, "command", None) == command]

    def position(self, boot_ms: int | None = None) -> Any:
        at_ms = self.boot_ms if boot_ms is None else boot_ms
        return mavlink.MAVLink_global_position_int_message(
            at_ms, LATITUDE_E7, LONGITUDE_E7, self.altitude_mm, 0, 0, 0, 0, 0
        )

    def _estimate(self) -> PadEstimate:
        pad = GlobalPosition(
            latitude_deg=LATITUDE_E7 / 1e7,
            longitude_deg=LONGITUDE_E7 / 1e7,
            altitude_amsl_m=500.0,
            ellipsoidal_height_m=547.0,
        )
        return PadEstimate(
            captured_at_ns=self.now_ns - 30_000_000,
            position=pad,
            pad_ned_m=(0.0, 0.0, 10.0),
            azimuth_rad=0.0,
            covariance_ned_m2=(0.0001, 0, 0, 0, 0.0001, 0, 0, 0, 0.0001),
            azimuth_variance_rad2=0.0001,
            method="any",
            fixes_used=1,
        )

    def _deliver(self, topic: topics.Topic[Any], message: Any) -> None:
        self._take(self.node.on_message(Arrival(topic, message, self.now_ns, self.now_ns)))

    def _take(self, outputs: Outputs) -> None:
        for output in list(outputs):
            if isinstance(output, Transmission):
                if self.linked:
                    for message in self._framer.feed(output.data):
                        self._obey(message)
            elif isinstance(output, Publication):
                self._note(output.message)

    def _note(self, message: Any) -> None:
        if isinstance(message, MissionStatus):
            self.mission = message
        elif isinstance(message, VehicleStatus):
            self.vehicle = message
        elif isinstance(message, VehicleState):
            self.states.append(message)
        elif isinstance(message, GimbalState):
            self.gimbals.append(message)
        elif isinstance(message, MissionReply):
            self.replies.append(message)

    def _obey(self, message: Any) -> None:
        kind = message.get_type()
        if kind == "TIMESYNC" and message.tc1 == 0 and self.answers:
            self.say(mavlink.MAVLink_timesync_message(self.now_ns - self._booted_ns, message.ts1))
        if kind == "HEARTBEAT":
            self.heartbeat_type = message.type
        if kind == "PARAM_REQUEST_READ" and message.param_id in self.parameters:
            self.tell_parameter(message.param_id)
        if kind.startswith("SET_POSITION_TARGET"):
            self.sent.append(message)
        if kind not in ("COMMAND_LONG", "COMMAND_INT") or message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            return
        self.sent.append(message)
        result = self.result.get(message.command, ACCEPTED)
        if self.obeys and result == ACCEPTED and message.command == mavlink.MAV_CMD_DO_SET_MODE:
            main, sub = int(message.param2), int(message.param3)
            self.mode = main << 16 | sub << 24
        if self.answers:
            self.say(mavlink.MAVLink_command_ack_message(message.command, result, 0, 0, 245, 191))
