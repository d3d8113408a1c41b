"""The MAVLink station: takes what comes over the links and sends what is due."""

from collections.abc import Callable

from services.simulator.autopilot.autopilot import Autopilot
from services.simulator.estimator import Estimate
from services.simulator.mavlink import setpoints
from services.simulator.mavlink.commands import Command, Commands
from services.simulator.mavlink.dialect import Message, dialect
from services.simulator.mavlink.link import AUTOPILOT_COMPONENT, Link
from services.simulator.mavlink.parameter_protocol import ParameterProtocol
from services.simulator.mavlink.telemetry import Telemetry
from services.simulator.world import World

Sendings = list[tuple[str, bytes]]
"""Port and bytes."""

NAN = float("nan")


class Station:
    """The autopilot's end of its links."""

    def __init__(
        self, system_id: int, ports: tuple[str, ...], autopilot: Autopilot, estimate: Estimate, world: World
    ) -> None:
        self._system_id = system_id
        self._links = {port: Link(port, system_id) for port in ports}
        self._autopilot = autopilot
        self._estimate = estimate
        self._world = world
        self.telemetry = Telemetry(autopilot, estimate, world)
        self._commands = Commands(autopilot, estimate, self.telemetry, world)
        self._parameters = ParameterProtocol(autopilot.parameters)
        self._answers: dict[str, Callable[[Message, Link], list[Message]]] = {
            "COMMAND_LONG": self._commands.handle,
            "COMMAND_INT": self._commands.handle,
            "SET_MODE": self._set_mode,
            "PING": self._echo,
            "PARAM_REQUEST_READ": lambda message, _link: self._parameters.read(message),
            "PARAM_REQUEST_LIST": lambda _message, _link: self._parameters.read_all(),
            "PARAM_SET": lambda message, _link: self._parameters.set(message),
        }
        self.dropped_setpoints = 0
        """Setpoints of a frame or mask that PX4 drops without a word."""
        self.foreign = 0
        """Messages for other systems."""

    @property
    def refused_bytes(self) -> int:
        """What came over the links and was no MAVLink."""
        return sum(link.refused for link in self._links.values())

    def due(self) -> Sendings:
        """What is to be sent at the autopilot's present time."""
        autopilot = self._autopilot
        for severity, text in autopilot.texts:
            for link in self._links.values():
                link.say(severity, text)
        autopilot.texts.clear()
        now_s, build = autopilot.now_s, self.telemetry.build
        sendings = [(port, link.due(now_s, build)) for port, link in self._links.items()]
        return [(port, data) for port, data in sendings if data]

    def receive(self, port: str, data: bytes, clock_ns: int) -> Sendings:
        """Take bytes; returns the replies.

        Args:
            port: Where they came from.
            data: Any piece of the byte stream.
            clock_ns: Time since boot on the clock that TIMESYNC tells.
        """
        link = self._links[port]
        out: Sendings = []
        for message in link.receive(data):
            out += self._forward(link, message)
            replies = self._take(message, link, clock_ns)
            if replies:
                out.append((port, b"".join(link.encode(reply) for reply in replies)))
        return out

    def _forward(self, link: Link, message: Message) -> Sendings:
        """Other systems hear each other through the autopilot: a message goes on to every other link."""
        if len(self._links) == 1 or message.get_srcSystem() == self._system_id:
            return []
        if getattr(message, "target_system", 0) == self._system_id:
            return []
        return [(port, bytes(message.get_msgbuf())) for port in self._links if port != link.port]

    def _addressed(self, message: Message) -> bool:
        if message.get_srcSystem() == self._system_id and message.get_srcComponent() == AUTOPILOT_COMPONENT:
            return False
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        return system in (0, self._system_id) and component in (0, AUTOPILOT_COMPONENT)

    def _take(self, message: Message, link: Link, clock_ns: int) -> list[Message]:
        if not self._addressed(message):
            self.foreign += 1
            return []
        kind = message.get_type()
        if kind == "TIMESYNC":
            # tc1 = 0 asks for the time; anything else answers the autopilot's own question.
            return [dialect.MAVLink_timesync_message(clock_ns, message.ts1)] if message.tc1 == 0 else []
        answer = self._answers.get(kind)
        if answer is not None:
            return answer(message, link)
        self._listen(kind, message, link)
        return []

    def _echo(self, message: Message, _link: Link) -> list[Message]:
        """Answer a ping to everybody; one to somebody is an answer itself."""
        if message.target_system:
            return []
        sender = message.get_srcSystem(), message.get_srcComponent()
        return [dialect.MAVLink_ping_message(message.time_usec, message.seq, *sender)]

    def _listen(self, kind: str, message: Message, link: Link) -> None:
        """What changes something and is never answered."""
        autopilot = self._autopilot
        if kind == "HEARTBEAT":
            if message.type == dialect.MAV_TYPE_GCS:
                link.gcs_seen = True
                autopilot.hear_gcs()
        elif kind in ("SET_POSITION_TARGET_GLOBAL_INT", "SET_POSITION_TARGET_LOCAL_NED"):
            if kind == "SET_POSITION_TARGET_LOCAL_NED":
                setpoint = setpoints.from_local(message, self._estimate)
            else:
                setpoint = setpoints.from_global(message, autopilot, self._estimate, self._world)
            if setpoint is None:
                self.dropped_setpoints += 1
            else:
                autopilot.take_offboard_setpoint(setpoint)
        elif kind == "MANUAL_CONTROL" and message.target in (0, self._system_id):
            deflections = (message.x / 1000.0, message.y / 1000.0, message.z / 500.0 - 1.0, message.r / 1000.0)
            autopilot.sticks.take(*deflections, now_s=autopilot.now_s)

    def _set_mode(self, message: Message, link: Link) -> list[Message]:
        """The old SET_MODE message, answered as MAV_CMD_DO_SET_MODE."""
        main, sub = message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF
        command = Command(
            dialect.MAV_CMD_DO_SET_MODE, float(message.base_mode), float(main), float(sub), NAN, NAN, NAN, NAN
        )
        return self._commands.carry_out(command, link, message.get_srcSystem(), message.get_srcComponent())
