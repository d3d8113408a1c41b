"""An outside client of the simulated autopilot: knows it through MAVLink bytes alone."""

import math
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import development as mavlink

from alight.runtime.clock import LOCKSTEP_EPOCH_NS
from alight.runtime.node import Publication, Transmission
from schemas.settings import Settings
from schemas.truth import GroundTruth
from services.simulator.node import SimulatorNode

TICK_NS = 4_000_000


class Client:
    """Drives the node in virtual time and keeps what it said, as (seconds since power-on, message)."""

    def __init__(
        self,
        settings: Settings | None = None,
        *,
        gcs: bool = True,
        heartbeat: bool = True,
        system: int = 245,
        component: int = 191,
    ) -> None:
        self.node = SimulatorNode(settings or Settings())
        self.now_ns = LOCKSTEP_EPOCH_NS
        self.log: list[tuple[float, Any]] = []
        self.newest: dict[str, Any] = {}
        self.truths: list[GroundTruth] = []
        self.raw = bytearray()
        self.sends_heartbeat = heartbeat
        self._mav = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self._parser = mavlink.MAVLink(None)
        self._parser.robust_parsing = True
        self._held: list[tuple[int, int, bytes]] = []
        self._heartbeat_type = mavlink.MAV_TYPE_GCS if gcs else mavlink.MAV_TYPE_ONBOARD_CONTROLLER
        self._ticks = 0
        self.every: list[tuple[int, Callable[[], None]]] = []
        """What to do at every nth tick: a setpoint stream, say."""

    @property
    def time_s(self) -> float:
        return (self.now_ns - LOCKSTEP_EPOCH_NS) * 1e-9

    def run(self, seconds: float) -> "Client":
        """Let time pass."""
        for _ in range(round(seconds / 0.004)):
            self._tick()
        return self

    def until(self, condition: Callable[[], Any], timeout_s: float) -> float:
        """Let time pass until something is so; how long it took."""
        start_s = self.time_s
        while not condition():
            assert self.time_s - start_s < timeout_s, f"not within {timeout_s} s"
            self._tick()
        return self.time_s - start_s

    def send(self, message: Any, system: int | None = None, component: int | None = None) -> None:
        self._mav.srcSystem, kept_system = (system or self._mav.srcSystem), self._mav.srcSystem
        self._mav.srcComponent, kept_component = (component or self._mav.srcComponent), self._mav.srcComponent
        data = message.pack(self._mav)
        self._mav.seq = (self._mav.seq + 1) % 256
        self._mav.srcSystem, self._mav.srcComponent = kept_system, kept_component
        self._keep(self.node.on_bytes("vehicle", data, self.now_ns))
        self._release()

    def command(self, number: int, *parameters: float, target: tuple[int, int] = (1, 1), **sender: int) -> int | None:
        """Send a COMMAND_LONG; the result, or None if no answer came within 0.1 s."""
        values = [*parameters, *[0.0] * (7 - len(parameters))]
        mark = len(self.log)
        self.send(mavlink.MAVLink_command_long_message(*target, number, 0, *values), **sender)
        return self._answer(number, mark)

    def command_int(self, number: int, parameters: list[float], x: int, y: int, z: float, frame: int = 0) -> int | None:
        mark = len(self.log)
        self.send(mavlink.MAVLink_command_int_message(1, 1, frame, number, 0, 0, *parameters, x, y, z))
        return self._answer(number, mark)

    def arm(self) -> int | None:
        return self.command(400, 1.0)

    def set_mode(self, main: int, sub: int = 0, **sender: int) -> int | None:
        return self.command(176, 1.0, float(main), float(sub), **sender)

    def take_off(self, height_m: float) -> "Client":
        """Ready, armed, up and holding."""
        self.until(lambda: self.status == 3, 10)
        assert self.arm() == 0
        nan = math.nan
        altitude_m = self.last("HOME_POSITION").altitude * 1e-3 + height_m
        assert self.command(22, nan, nan, nan, nan, nan, nan, altitude_m) == 0
        self.until(lambda: self.mode == 0x02040000, 3)
        self.until(lambda: self.mode == 0x03040000, 40)
        return self

    def reposition(
        self, north_m: float, east_m: float, altitude_amsl_m: float, yaw: float = math.nan, speed: float = -1.0
    ) -> int | None:
        x, y = self.degrees_1e7(north_m, east_m)
        return self.command_int(192, [speed, 1.0, 0.0, yaw], x, y, altitude_amsl_m)

    def offboard_position(
        self, north_m: float, east_m: float, altitude_amsl_m: float, vz: float | None = None, frame: int = 5
    ) -> None:
        x, y = self.degrees_1e7(north_m, east_m)
        mask = 0xDF8 if vz is None else 0xDD8
        self.send(
            mavlink.MAVLink_set_position_target_global_int_message(
                0, 1, 1, frame, mask, x, y, altitude_amsl_m, 0, 0, vz or 0.0, 0, 0, 0, 0, 0
            )
        )

    def degrees_1e7(self, north_m: float, east_m: float) -> tuple[int, int]:
        """A point given from the local origin."""
        origin = self.last("GPS_GLOBAL_ORIGIN") if "GPS_GLOBAL_ORIGIN" in self.newest else self._request_origin()
        north_deg = north_m / 111_170.0
        east_deg = east_m / (111_412.0 * math.cos(math.radians(origin.latitude * 1e-7)))
        return round(origin.latitude + north_deg * 1e7), round(origin.longitude + east_deg * 1e7)

    def messages(self, kind: str, since_s: float = 0.0) -> list[Any]:
        return [message for at_s, message in self.log if message.get_type() == kind and at_s >= since_s]

    def last(self, kind: str) -> Any:
        return self.newest[kind]

    def texts(self) -> str:
        return " | ".join(message.text.strip() for message in self.messages("STATUSTEXT"))

    @property
    def mode(self) -> int:
        return self._heartbeat().custom_mode

    @property
    def status(self) -> int:
        return self._heartbeat().system_status if "HEARTBEAT" in self.newest else -1

    @property
    def armed(self) -> bool:
        return bool(self._heartbeat().base_mode & 128)

    @property
    def truth(self) -> GroundTruth:
        return self.truths[-1]

    def _heartbeat(self) -> Any:
        return self.last("HEARTBEAT")

    def _request_origin(self) -> Any:
        assert self.command(512, 49.0) == 0
        return self.last("GPS_GLOBAL_ORIGIN")

    def _answer(self, number: int, mark: int) -> int | None:
        for _ in range(25):
            for _, message in self.log[mark:]:
                if message.get_type() == "COMMAND_ACK" and message.command == number:
                    return int(message.result)
            self._tick()
        return None

    def _tick(self) -> None:
        self.now_ns += TICK_NS
        self._ticks += 1
        if self.sends_heartbeat and self._ticks % 250 == 1:
            self.send(mavlink.MAVLink_heartbeat_message(self._heartbeat_type, 8, 0, 0, 4, 3))
        for period, action in self.every:
            if self._ticks % period == 0:
                action()
        self._keep(self.node.on_tick(self.now_ns))
        self._release()

    def _keep(self, outputs: Any) -> None:
        for output in outputs:
            if isinstance(output, Publication):
                assert isinstance(output.message, GroundTruth)
                self.truths.append(output.message)
            elif isinstance(output, Transmission):
                self._held.append((output.release_at_ns or self.now_ns, len(self._held), output.data))

    def _release(self) -> None:
        due = [item for item in self._held if item[0] <= self.now_ns]
        self._held = [item for item in self._held if item[0] > self.now_ns]
        for _, _, data in sorted(due):
            self.raw += data
            for message in self._parser.parse_buffer(data) or []:
                self.log.append((self.time_s, message))
                self.newest[message.get_type()] = message
