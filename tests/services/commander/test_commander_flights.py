"""The commander flies the embedded simulator. Each test is one story; positions are the autopilot's own."""

import math
from itertools import pairwise

import pytest
from landing_stage import landed_and_holding
from simulated_flight import SimulatedFlight

from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.rotation import euler_from_quaternion
from schemas.mission import MissionRequest, Phase, Verb
from schemas.setpoint import SetpointKind
from schemas.vehicle import FlightMode

AUTO, RETURN = 4, 5


@pytest.fixture
def flight() -> SimulatedFlight:
    return SimulatedFlight()


def test_glide_lands_on_the_pad_and_leaves_the_vehicle_ready_for_the_next_flight(flight: SimulatedFlight) -> None:
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.LANDED)
    flight.run(2.0)
    assert flight.beside_m < 0.15
    assert flight.person.codes[-4:] == [
        "acquire:land_asked",
        "descend:acquired",
        "touchdown:low_over_pad",
        "landed:landed",
    ]
    assert landed_and_holding(flight.person.vehicle)
    assert all(setpoint.kind is SetpointKind.OFFBOARD for setpoint in flight.scribe.setpoints)


def test_the_nose_turns_to_the_azimuth_of_the_pad(flight: SimulatedFlight) -> None:
    flight.pad.azimuth_rad = 1.2
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.TOUCHDOWN)
    assert flight.pad.state is not None
    assert euler_from_quaternion(flight.pad.state.q_ned_body)[2] == pytest.approx(1.2, abs=math.radians(5))


def test_a_setpoint_follows_each_estimate_at_once_and_never_later_than_50_ms(flight: SimulatedFlight) -> None:
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.TOUCHDOWN)
    sent = [setpoint.sent_at_ns for setpoint in flight.scribe.setpoints]
    assert max(b - a for a, b in pairwise(sent)) <= 0.071e9  # 50 ms and one tick
    fresh = [setpoint for setpoint in flight.scribe.setpoints if setpoint.fresh]
    assert len(fresh) > 0.4 * len(sent)
    assert all(setpoint.hops[-1].service == "commander" for setpoint in fresh)
    assert all(setpoint.captured_at_ns < setpoint.sent_at_ns for setpoint in fresh)


@pytest.mark.parametrize("law", ["exponential", "linear"])
def test_reposition_comes_down_by_the_papers_algorithm(law: str) -> None:
    flight = SimulatedFlight(guidance="reposition", reposition={"law": law, "switching_height_m": 3.0})
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.TOUCHDOWN, 90.0)
    flight.until(lambda: flight.person.vehicle is not None and flight.person.vehicle.mode is FlightMode.LAND, 3.0)
    flight.until_phase(Phase.LANDED, 40.0)
    sent = [setpoint.sent_at_ns for setpoint in flight.scribe.setpoints]
    assert all(setpoint.kind is SetpointKind.REPOSITION for setpoint in flight.scribe.setpoints)
    assert min(b - a for a, b in pairwise(sent)) >= 1e9
    assert flight.beside_m < 0.3


def test_takeoff_flies_to_the_start_point_and_waits_there() -> None:
    flight = SimulatedFlight(from_pad_m=(0.5, 0.0, -2.0))
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.LANDED)
    flight.until(lambda: flight.person.vehicle is not None and flight.person.vehicle.ready_to_arm)
    flight.person.land_at_start = False
    flight.ask(Verb.TAKEOFF, start_ned_m=(3.0, -4.0, -6.0))
    flight.until_phase(Phase.HOLD)
    assert flight.person.codes[-3:] == ["takeoff:takeoff_asked", "transit:climbed", "hold:at_start"]
    assert flight.height_m == pytest.approx(6.0, abs=0.7)
    assert flight.beside_m == pytest.approx(5.0, abs=0.8)


def test_without_estimates_it_holds_and_goes_on_when_they_are_back(flight: SimulatedFlight) -> None:
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.height_m < 6.0)
    flight.pad.blind = True
    flight.until_phase(Phase.HOLD, flight.settings.commander.stale_after_s + 0.6)
    assert flight.person.codes[-1] == "hold:estimate_stale"
    flight.run(3.0)
    height_m = flight.height_m
    flight.run(3.0)
    assert flight.height_m == pytest.approx(height_m, abs=0.2)
    assert flight.person.vehicle is not None
    assert flight.person.vehicle.mode is FlightMode.HOLD
    flight.pad.blind = False
    flight.until_phase(Phase.LANDED)
    assert flight.beside_m < 0.2


def test_without_estimates_for_long_it_gives_up_and_holds() -> None:
    flight = SimulatedFlight(hold_patience_s=4.0)
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.height_m < 6.0)
    flight.pad.blind = True
    flight.until_phase(Phase.ABORTED, 10.0)
    assert flight.person.codes[-1] == "aborted:estimate_lost"
    flight.pad.blind = False
    flight.run(3.0)
    assert flight.person.phase is Phase.ABORTED
    assert flight.height_m > 3.0


def test_blind_below_the_switching_height_it_goes_on_down(flight: SimulatedFlight) -> None:
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.TOUCHDOWN)
    flight.pad.blind = True
    flight.until_phase(Phase.LANDED, 15.0)
    assert flight.beside_m < 0.15


def beside_at_contact_m(flight: SimulatedFlight, *, tells_drift: bool) -> float:
    """A landing whose last picture of the pad is taken at the switching height, while the pad's coordinates go on drifting."""
    flight.pad.drift_mps = (0.06, -0.06, 0.0)
    flight.pad.tells_drift = tells_drift
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.TOUCHDOWN)
    flight.pad.blind = True
    flight.until(lambda: flight.height_m < 0.25, 15.0)
    return flight.beside_m


def test_blind_it_lands_where_the_drift_has_taken_the_pads_coordinates() -> None:
    told, untold = (beside_at_contact_m(SimulatedFlight(), tells_drift=tells) for tells in (True, False))
    assert told < 0.07
    assert told < 0.5 * untold


def test_an_estimate_that_ages_does_not_let_it_go_down_blind(flight: SimulatedFlight) -> None:
    """At the switching height the funnel is 0.2 m wide: a place of which nobody knows where it drifts does not fit in for long."""
    flight.ask(Verb.LAND)
    flight.pad.tells_drift = False
    flight.until(lambda: flight.height_m < 2.0)
    flight.pad.blind = True
    flight.until_phase(Phase.HOLD, 5.0)
    assert "touchdown:low_over_pad" not in flight.person.codes
    assert flight.height_m > 0.7


def test_a_landing_may_begin_below_the_switching_height() -> None:
    flight = SimulatedFlight(from_pad_m=(0.05, 0.0, -0.9))
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.LANDED, 20.0)
    assert flight.beside_m < 0.15


def test_a_pilots_mode_change_ends_every_command_until_somebody_asks_again(flight: SimulatedFlight) -> None:
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.height_m < 6.0)
    flight.other_client_sets_mode(AUTO, RETURN)
    flight.until_phase(Phase.YIELDED, 0.4)
    assert flight.person.codes[-1] == "yielded:pilot_took_over"
    flight.run(5.0)
    assert flight.scribe.setpoints[-1].sent_at_ns <= flight.person.phases[-1].phase_since_ns
    assert flight.person.vehicle is not None
    assert flight.person.vehicle.mode is FlightMode.RETURN
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.LANDED)


def test_abort_stops_the_descent_and_the_vehicle_holds(flight: SimulatedFlight) -> None:
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.height_m < 6.0)
    flight.ask(Verb.ABORT)
    assert flight.person.phase is Phase.ABORTED
    flight.run(3.0)
    height_m = flight.height_m
    sent = len(flight.scribe.setpoints)
    flight.run(5.0)
    assert flight.height_m == pytest.approx(height_m, abs=0.2)
    assert len(flight.scribe.setpoints) == sent


def test_hold_stops_a_reposition_that_is_under_way() -> None:
    """HOLD is flown already then, so the mode alone would change nothing."""
    flight = SimulatedFlight(guidance="reposition")
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.height_m < 7.0)
    flight.ask(Verb.HOLD)
    flight.run(4.0)
    height_m, beside_m = flight.height_m, flight.beside_m
    flight.run(4.0)
    assert (flight.height_m, flight.beside_m) == pytest.approx((height_m, beside_m), abs=0.2)


@pytest.mark.parametrize("outage_s", [0.05, 0.9])
def test_a_restarted_commander_waits_to_be_asked_and_then_lands(flight: SimulatedFlight, outage_s: float) -> None:
    """Around the autopilot's setpoint timeout of 1 s: it still flies OFFBOARD, or has just begun its failsafe."""
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.height_m < 6.0)
    flight.kill_commander()
    flight.run(outage_s)
    flight.start_commander()
    flight.run(1.5)
    assert flight.person.codes[-1] in ("hold:restarted_in_flight", "yielded:restarted_in_flight")
    sent = len(flight.scribe.setpoints)
    flight.run(1.0)
    assert len(flight.scribe.setpoints) == sent
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.LANDED, 90.0)
    assert flight.beside_m < 0.15


def test_after_a_long_outage_it_takes_the_vehicle_out_of_its_failsafe_only_when_asked(flight: SimulatedFlight) -> None:
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.height_m < 6.0)
    flight.kill_commander()
    flight.run(2.5)
    flight.start_commander()
    flight.run(2.0)
    assert flight.person.codes[-1] == "yielded:restarted_in_flight"
    assert flight.person.vehicle is not None
    assert flight.person.vehicle.failsafe
    assert flight.person.vehicle.mode is FlightMode.RETURN
    sent = len(flight.scribe.setpoints)
    flight.run(2.0)
    assert len(flight.scribe.setpoints) == sent
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.LANDED, 90.0)
    assert flight.beside_m < 0.15


def test_a_lost_link_ends_the_landing(flight: SimulatedFlight) -> None:
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.height_m < 6.0)
    flight.connect(linked=False)
    flight.run(4.0)
    assert "yielded:link_lost" in flight.person.codes
    flight.connect()
    sent = len(flight.scribe.setpoints)
    flight.run(3.0)
    assert len(flight.scribe.setpoints) == sent


def test_a_jump_of_the_estimate_is_not_followed_until_it_has_proved_true(flight: SimulatedFlight) -> None:
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.height_m < 7.5)
    assert flight.pad.pad is not None
    old = flight.pad.pad
    flight.pad.pad = moved_by_ned(old, (3.0, 0.0, 0.0))
    flight.run(0.8)
    assert flight.commander is not None
    assert flight.commander.counters()["estimates_jump"] > 10
    aimed = ned_between(old, flight.scribe.setpoints[-1].position)
    assert aimed[0] < 4.5
    flight.until_phase(Phase.LANDED)
    assert flight.beside_m < 0.2


def test_two_answers_to_one_request_but_one_deed(flight: SimulatedFlight) -> None:
    flight.ask(Verb.LAND)
    request = flight.person.replies[-1].request_id
    flight.ask(Verb.ABORT)
    flight.person.wishes.append(_land_again(flight, request))
    flight.run(0.5)
    assert [reply.accepted for reply in flight.person.replies] == [True, True, True]
    assert flight.person.phase is Phase.ABORTED


def _land_again(flight: SimulatedFlight, request_id: str) -> MissionRequest:
    return MissionRequest(at_ns=flight.clock.now_ns(), request_id=request_id, verb=Verb.LAND)


def test_requests_that_make_no_sense_are_refused_with_a_reason(flight: SimulatedFlight) -> None:
    flight.ask(Verb.TAKEOFF)
    assert flight.person.replies[-1].reason == "the vehicle is armed already"
    flight.ask(Verb.LAND)
    flight.until_phase(Phase.LANDED)
    flight.ask(Verb.LAND)
    assert flight.person.replies[-1].accepted is False
    assert "not in the air" in flight.person.replies[-1].reason
    flight.ask(Verb.TAKEOFF, start_ned_m=(0.0, 0.0, 5.0))
    assert "too low" in flight.person.replies[-1].reason


def test_when_the_process_ends_in_a_descent_it_leaves_the_vehicle_holding(flight: SimulatedFlight) -> None:
    flight.ask(Verb.LAND)
    flight.until(lambda: flight.height_m < 6.0)
    assert flight.commander is not None
    for output in flight.commander.on_stop(flight.clock.now_ns()):
        list(flight.simulator.on_bytes("vehicle", output.data, flight.clock.now_ns()))
    flight.kill_commander()
    flight.run(2.0)
    flight.start_commander()
    flight.run(1.5)
    assert flight.person.vehicle is not None
    assert flight.person.vehicle.mode is FlightMode.HOLD
    assert not flight.person.vehicle.failsafe
