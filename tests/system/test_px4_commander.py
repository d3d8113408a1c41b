"""The commander flies a real PX4 (SITL with its built-in quadrotor): ALIGHT_PX4_RUN names the script that starts one.

The estimates come from a feeder that knows where the pad is, so what is tested is commander and autopilot alone.
"""

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "services" / "commander"))
from landing_stage import START_NED_M, KnownPad, Person, Scribe, landed_and_holding, place
from px4_stage import Px4, WallStage
from pymavlink.dialects.v20 import development as mavlink

from alight.geometry.local import ned_between
from schemas.mission import Phase, Verb
from schemas.settings import Settings
from schemas.vehicle import FlightMode
from services.commander.node import CommanderNode

SCRIPT = os.environ.get("ALIGHT_PX4_RUN", "")
pytestmark = [
    pytest.mark.px4,
    pytest.mark.system,
    pytest.mark.skipif(not SCRIPT, reason="needs a PX4 SITL: set ALIGHT_PX4_RUN to a script that starts one"),
]
INSTANCE = int(os.environ.get("ALIGHT_PX4_INSTANCE", "5"))


class Px4Flight:
    """PX4, commander, feeder and person; the pad lies (10, 10) m from the point where the vehicle holds 20 m above it."""

    def __init__(
        self, folder: Path, start_ned_m: tuple[float, float, float] = START_NED_M, **commander: object
    ) -> None:
        self.settings = Settings.model_validate({"commander": commander})
        self.px4 = Px4(SCRIPT, INSTANCE, folder)
        self.pad, self.scribe = KnownPad(), Scribe()
        self.person = Person(start_ned_m=start_ned_m, land_at_start=False)
        self.stage = WallStage(
            self.settings, [CommanderNode(self.settings), self.pad, self.person, self.scribe], self.px4.onboard_port
        )

    def until(self, condition: Callable[[], bool], within_s: float) -> None:
        assert self.stage.run(within_s, condition), (self.person.codes, self.person.vehicle)

    def until_phase(self, phase: Phase, within_s: float) -> None:
        self.until(lambda: self.person.phase is phase, within_s)

    def to_start(self) -> None:
        self.until_phase(Phase.TAKEOFF, 30.0)
        assert self.pad.state is not None
        self.pad.pad = self.pad.state.position
        self.until_phase(Phase.HOLD, 60.0)
        assert self.person.codes[-1] == "hold:at_start"

    def ask(self, verb: Verb) -> None:
        self.person.wish(verb, self.stage.now_ns())
        self.stage.run(0.5)

    def above_pad(self) -> tuple[float, float]:
        assert self.pad.state is not None
        assert self.pad.pad is not None
        north, east, down = ned_between(self.pad.state.position, self.pad.pad).tolist()
        return float(down), float((north**2 + east**2) ** 0.5)

    def pilot_sets_mode(self, main: int, sub: int) -> None:
        message = mavlink.MAVLink_command_long_message(
            1 + INSTANCE, 1, mavlink.MAV_CMD_DO_SET_MODE, 0, 1, main, sub, 0, 0, 0, 0
        )
        self.stage.send(message.pack(mavlink.MAVLink(None, 255, 190)))

    def close(self) -> None:
        self.stage.close()
        self.px4.close()


@pytest.fixture
def fly(tmp_path: Path) -> Iterator[Callable[..., Px4Flight]]:
    flights: list[Px4Flight] = []

    def begin(**settings: object) -> Px4Flight:
        flights.append(Px4Flight(tmp_path / f"px4-{len(flights)}", **settings))
        return flights[-1]

    yield begin
    for flight in flights:
        flight.close()


def test_takeoff_transit_and_glide_onto_the_pad_twice_without_a_restart(fly: Callable[..., Px4Flight]) -> None:
    flight = fly()
    flight.to_start()
    height_m, beside_m = flight.above_pad()
    assert (height_m, beside_m) == pytest.approx((20.0, 14.1), abs=0.7)
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.LANDED, 60.0)
    assert flight.above_pad()[1] < 0.25
    flight.until(lambda: landed_and_holding(flight.person.vehicle), 5.0)
    flight.person.wish(Verb.TAKEOFF, flight.stage.now_ns(), start_ned_m=(3.0, 0.0, -6.0))
    flight.until_phase(Phase.HOLD, 60.0)
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.LANDED, 60.0)
    assert flight.above_pad()[1] < 0.25
    assert not any(code.startswith(("failed", "yielded", "aborted")) for code in flight.person.codes)


def test_reposition_comes_down_and_the_landing_mode_takes_over(fly: Callable[..., Px4Flight]) -> None:
    flight = fly(start_ned_m=(3.0, 3.0, -8.0), guidance="reposition", reposition={"law": "exponential"})
    flight.to_start()
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.TOUCHDOWN, 90.0)
    flight.until_phase(Phase.LANDED, 40.0)
    assert flight.above_pad()[1] < 0.4


def test_abort_and_a_pilots_mode_change_are_obeyed(fly: Callable[..., Px4Flight]) -> None:
    flight = fly(start_ned_m=(3.0, 3.0, -12.0))
    flight.to_start()
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.above_pad()[0] < 9.0, 20.0)
    flight.ask(Verb.ABORT)
    flight.stage.run(3.0)
    height_m = flight.above_pad()[0]
    flight.stage.run(3.0)
    # PX4 brakes from 1.5 m/s and then climbs back to where HOLD began.
    assert height_m - 0.2 < flight.above_pad()[0] < height_m + 1.0
    assert flight.person.phase is Phase.ABORTED

    flight.ask(Verb.LAND)
    flight.until(lambda: flight.above_pad()[0] < 6.0, 20.0)
    auto, return_home = 4, 5
    flight.pilot_sets_mode(auto, return_home)
    flight.until_phase(Phase.YIELDED, 1.0)
    assert flight.person.codes[-1] == "yielded:pilot_took_over"
    flight.stage.run(4.0)
    assert flight.scribe.setpoints[-1].sent_at_ns <= flight.person.phases[-1].phase_since_ns
    assert flight.person.vehicle is not None
    assert flight.person.vehicle.mode is FlightMode.RETURN
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.LANDED, 60.0)
    assert flight.above_pad()[1] < 0.25


@pytest.mark.parametrize("outage_s", [0.3, 2.5])
def test_a_killed_commander_comes_back_and_lands_when_asked(fly: Callable[..., Px4Flight], outage_s: float) -> None:
    """0.3 s: PX4 still flies OFFBOARD and is told to hold. 2.5 s: PX4 returns home by its failsafe, and is left to it until asked."""
    flight = fly(start_ned_m=(3.0, 3.0, -12.0))
    flight.to_start()
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.above_pad()[0] < 8.0, 20.0)
    flight.stage.remove("commander")
    flight.stage.run(outage_s)
    flight.stage.add(CommanderNode(flight.settings))
    flight.stage.run(2.5)
    assert flight.person.codes[-1] in ("hold:restarted_in_flight", "yielded:restarted_in_flight")
    sent = len(flight.scribe.setpoints)
    flight.stage.run(2.0)
    assert len(flight.scribe.setpoints) == sent
    flight.ask(Verb.LAND)
    assert flight.person.replies[-1].accepted, flight.person.replies[-1].reason
    flight.until_phase(Phase.LANDED, 90.0)
    assert flight.above_pad()[1] < 0.25


def test_without_estimates_it_holds_then_goes_on(fly: Callable[..., Px4Flight]) -> None:
    flight = fly(start_ned_m=(3.0, 3.0, -12.0))
    flight.to_start()
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.above_pad()[0] < 8.0, 20.0)
    flight.pad.blind = True
    flight.until_phase(Phase.HOLD, flight.settings.commander.stale_after_s + 1.0)
    flight.stage.run(4.0)
    assert flight.above_pad()[0] > 3.0
    flight.pad.blind = False
    # Meanwhile the pad was carried a metre away.
    assert flight.pad.pad is not None
    flight.pad.pad = place(flight.pad.pad, 0.9, 0.0)
    flight.until_phase(Phase.LANDED, 60.0)
    assert flight.above_pad()[1] < 0.25
