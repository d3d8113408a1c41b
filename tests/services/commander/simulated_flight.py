"""A commander and the embedded simulator on virtual time, with a feeder that knows where the pad is."""

from collections.abc import Callable
from typing import Any

from landing_stage import KnownPad, Person, Scribe
from pymavlink.dialects.v20 import development as mavlink

from alight.geometry.local import moved_by_ned, ned_between
from alight.runtime.clock import NS_PER_S, VirtualClock
from alight.runtime.lockstep import Lockstep
from schemas.mission import Phase, Verb
from schemas.settings import Settings
from services.commander.node import CommanderNode
from services.simulator.node import SimulatorNode


class SimulatedFlight:
    """Begins in the air, holding, `from_pad_m` (north, east, down) from the pad."""

    def __init__(self, from_pad_m: tuple[float, float, float] = (4.0, 3.0, -8.0), **commander: Any) -> None:
        north, east, down = from_pad_m
        self.settings = Settings.model_validate(
            {
                "commander": commander,
                "simulator": {"airborne": {"north_m": north, "east_m": east, "down_m": down}},
            }
        )
        self.clock = VirtualClock()
        self.simulator = SimulatorNode(self.settings)
        self.commander: CommanderNode | None = CommanderNode(self.settings)
        self.pad = KnownPad()
        self.person = Person(start_ned_m=None)
        self.scribe = Scribe()
        self.connect()
        self.run(4.0)
        assert self.pad.state is not None
        self.pad.pad = moved_by_ned(self.pad.state.position, (-north, -east, -down))

    def connect(self, linked: bool = True) -> None:
        """Put all nodes that are there on a new executor; not `linked`, nothing goes over the MAVLink link."""
        nodes = [self.simulator, self.commander, self.pad, self.person, self.scribe]
        self.executor = Lockstep([node for node in nodes if node is not None], self.settings, self.clock)
        if linked and self.commander is not None:
            self.executor.join(self.simulator, "vehicle", self.commander, "vehicle")

    def kill_commander(self) -> None:
        self.commander = None
        self.person.mission = None
        self.connect()

    def start_commander(self) -> None:
        self.commander = CommanderNode(self.settings)
        self.connect()

    def ask(self, verb: Verb, **more: Any) -> str:
        request_id = self.person.wish(verb, self.clock.now_ns(), **more)
        self.run(0.3)
        return request_id

    def run(self, for_s: float) -> None:
        self.executor.run(self.clock.now_ns() + round(for_s * NS_PER_S))

    def until(self, condition: Callable[[], bool], within_s: float = 60.0) -> None:
        assert self.executor.run(self.clock.now_ns() + round(within_s * NS_PER_S), condition), self.person.codes

    def until_phase(self, phase: Phase, within_s: float = 60.0) -> None:
        self.until(lambda: self.person.phase is phase, within_s)

    def other_client_sets_mode(self, main: int, sub: int = 0) -> None:
        """What a pilot's ground station does."""
        encoder = mavlink.MAVLink(None, 255, 190)
        message = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_DO_SET_MODE, 0, 1, main, sub, 0, 0, 0, 0)
        list(self.simulator.on_bytes("vehicle", message.pack(encoder), self.clock.now_ns()))

    def reset_estimator(self, jump_ned_m: tuple[float, float, float]) -> None:
        """The autopilot's navigation solution jumps: all coordinates mean another place now, the pad's with them."""
        assert self.pad.pad is not None
        estimate, (north, east, down) = self.simulator.vehicle.estimate, jump_ned_m
        spread = estimate._spread

        def spread_from_there() -> None:
            spread()
            estimate._dn, estimate._de, estimate._dd = estimate._dn + north, estimate._de + east, estimate._dd + down

        estimate._spread = spread_from_there  # type: ignore[method-assign]
        spread_from_there()
        self.pad.pad = moved_by_ned(self.pad.pad, jump_ned_m)

    @property
    def height_m(self) -> float:
        assert self.pad.state is not None
        assert self.pad.pad is not None
        return float(ned_between(self.pad.state.position, self.pad.pad)[2])

    @property
    def beside_m(self) -> float:
        assert self.pad.state is not None
        assert self.pad.pad is not None
        north, east, _ = ned_between(self.pad.state.position, self.pad.pad).tolist()
        return float((north**2 + east**2) ** 0.5)
