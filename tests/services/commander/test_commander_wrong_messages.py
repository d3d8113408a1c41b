"""Messages of the autopilot that are well-formed and wrong: each costs no more than itself."""

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import development as mavlink
from scripted_autopilot import ScriptedAutopilot

from schemas.mission import Phase, Verb
from schemas.vehicle import FlightMode, LandedState
from services.commander.dialect import mavlink as dialect

FAR_AHEAD_MS = 50_000_000
NANOSECONDS = 10**9


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_rate_that_is_no_number_costs_that_attitude_alone(number: float) -> None:
    autopilot = ScriptedAutopilot()
    before = len(autopilot.states)
    autopilot.now_ns += 20_000_000
    wrong = mavlink.MAVLink_attitude_quaternion_message(autopilot.boot_ms, 1, 0, 0, 0, number, 0, 0)
    autopilot.say(autopilot.position(), wrong, mavlink.MAVLink_current_mode_message(0, 0x00030000, 0x00030000))
    autopilot.landed = 1
    assert autopilot.vehicle is not None
    assert autopilot.vehicle.mode is FlightMode.POSITION  # it came in the same datagram
    autopilot.wait(0.1)
    assert len(autopilot.states) >= before + 4


def test_a_position_from_the_future_does_not_shut_out_those_that_come_after_it() -> None:
    autopilot = ScriptedAutopilot()
    boot_ms = autopilot.boot_ms + FAR_AHEAD_MS
    attitude = mavlink.MAVLink_attitude_quaternion_message(boot_ms, 1, 0, 0, 0, 0, 0, 0)
    autopilot.say(attitude, autopilot.position(boot_ms))
    autopilot.wait(3.0)
    assert all(state.at_ns < autopilot.now_ns + NANOSECONDS for state in autopilot.states)
    assert autopilot.states[-1].at_ns > autopilot.now_ns - NANOSECONDS // 2


def test_when_the_clock_is_set_back_the_vehicle_holds() -> None:
    """What is known then seems to be of the future, and would seem fresh for long."""
    autopilot = ScriptedAutopilot()
    autopilot.sees_pad = True
    autopilot.ask(Verb.LAND)
    autopilot.wait(3.0)
    assert autopilot.phase is Phase.DESCEND
    autopilot.sent.clear()
    autopilot.sees_pad = False
    autopilot.set_clock_back(30.0)
    autopilot.wait(0.4)
    assert all_stand(autopilot.sent)
    autopilot.wait(0.8)
    assert autopilot.phase is Phase.HOLD
    assert autopilot.mode == 0x03040000


def all_stand(sent: list[Any]) -> bool:
    """Setpoints go on, all at one place, so that the autopilot does not fall back on a failsafe meanwhile."""
    setpoints = [message for message in sent if message.get_type().startswith("SET_POSITION_TARGET")]
    places = {(message.lat_int, message.lon_int, round(message.alt, 3)) for message in setpoints}
    return len(setpoints) >= 5 and len(places) == 1


def test_streams_that_never_come_and_are_never_answered_do_not_fill_the_memory() -> None:
    autopilot = ScriptedAutopilot()
    autopilot.answers = False
    autopilot.only_heartbeats = True
    autopilot.wait(300.0)
    requests = autopilot.node.counters()["stream_requests"]
    autopilot.wait(10.0)
    # Three tries of half a second each: not more than one request in 1.5 s.
    assert autopilot.node.counters()["stream_requests"] - requests <= 8
    assert requests < 8 + 300.0 / 1.5


def test_an_autopilot_that_boots_anew_is_not_believed_what_it_said_before() -> None:
    autopilot = ScriptedAutopilot()
    autopilot.wait(3.0)
    assert autopilot.vehicle is not None
    assert autopilot.vehicle.home is not None
    autopilot.only_heartbeats = True
    autopilot.reboot()
    attitude = dialect.MAVLink_attitude_quaternion_message(autopilot.boot_ms, 1, 0, 0, 0, 0, 0, 0)
    autopilot.say(attitude)
    autopilot.wait(0.5)
    assert autopilot.vehicle.home is None
    assert autopilot.vehicle.landed_state is LandedState.UNDEFINED
