"""Commands that are late or lost when the commander lets go: what was asked for happens, and nobody is overridden afterwards."""

import math

import pytest
from pymavlink.dialects.v20 import development as mavlink
from scripted_autopilot import (
    ACTIVE,
    CRITICAL,
    HOLD,
    OFFBOARD,
    ON_GROUND,
    POSITION,
    RETURN,
    STANDBY,
    TAKEOFF,
    ScriptedAutopilot,
)

from schemas.mission import Phase, Verb
from services.commander import flight_commands as commands

SECONDS_OF_A_LINK_LOSS = 60.0


def descending(**commander: object) -> ScriptedAutopilot:
    autopilot = ScriptedAutopilot(**commander)
    autopilot.sees_pad = True
    autopilot.ask(Verb.LAND)
    autopilot.wait(3.0)
    assert autopilot.phase is Phase.DESCEND
    autopilot.sent.clear()
    return autopilot


def armed_for_takeoff(**commander: object) -> ScriptedAutopilot:
    """The takeoff has been commanded; the vehicle still stands on the ground."""
    autopilot = ScriptedAutopilot(**commander)
    autopilot.armed, autopilot.landed, autopilot.system_status = False, ON_GROUND, STANDBY
    autopilot.wait(6.0)
    autopilot.ask(Verb.TAKEOFF)
    autopilot.wait(0.3)
    autopilot.armed, autopilot.system_status = True, ACTIVE
    autopilot.wait(1.1)
    assert autopilot.commands(commands.TAKEOFF)
    return autopilot


def climbing(**commander: object) -> ScriptedAutopilot:
    autopilot = armed_for_takeoff(**commander)
    autopilot.mode, autopilot.landed = TAKEOFF, 3
    autopilot.wait(0.5)
    autopilot.sent.clear()
    return autopilot


def test_what_could_not_be_sent_while_the_link_was_away_is_not_sent_when_it_is_back() -> None:
    """A pilot has taken over meanwhile, as pilots do."""
    autopilot = climbing()
    autopilot.linked = False
    autopilot.wait(3.0)
    assert autopilot.phase is Phase.YIELDED
    autopilot.mode = POSITION
    autopilot.wait(SECONDS_OF_A_LINK_LOSS)
    autopilot.linked = True
    autopilot.wait(3.0)
    assert autopilot.sent == []


@pytest.mark.parametrize("mode", [POSITION, RETURN])
def test_after_an_abort_whoever_changes_the_mode_keeps_it(mode: int) -> None:
    autopilot = descending()
    autopilot.answers = False
    autopilot.ask(Verb.ABORT)
    autopilot.wait(0.2)
    autopilot.mode = mode
    autopilot.wait(0.2)
    autopilot.sent.clear()
    autopilot.wait(5.0)
    assert autopilot.sent == []


def test_an_abort_does_not_take_the_vehicle_out_of_a_failsafe_that_holds() -> None:
    autopilot = descending()
    autopilot.answers = autopilot.obeys = False
    autopilot.ask(Verb.ABORT)
    autopilot.mode, autopilot.system_status = HOLD, CRITICAL
    autopilot.wait(1.1)
    autopilot.sent.clear()
    autopilot.wait(5.0)
    assert autopilot.sent == []


def test_an_abort_is_repeated_until_the_vehicle_holds() -> None:
    """The radio swallows everything for longer than the three tries of one command last."""
    autopilot = descending()
    autopilot.answers = autopilot.obeys = False
    autopilot.ask(Verb.ABORT)
    autopilot.wait(1.8)
    autopilot.answers = autopilot.obeys = True
    autopilot.wait(1.0)
    assert autopilot.mode == HOLD


def test_an_abort_before_the_lift_off_keeps_the_vehicle_on_the_ground() -> None:
    autopilot = armed_for_takeoff()
    autopilot.mode = TAKEOFF
    autopilot.wait(0.3)
    autopilot.sent.clear()
    autopilot.ask(Verb.ABORT)
    autopilot.wait(0.5)
    assert autopilot.phase is Phase.ABORTED
    assert autopilot.mode == HOLD
    assert [message.param1 for message in autopilot.commands(commands.ARM_DISARM)] == [0.0]


@pytest.mark.parametrize("law", ["exponential", "linear"])
def test_a_reposition_never_asks_for_a_change_of_mode(law: str) -> None:
    """So that one that is under way when the pilot takes over, or a failsafe begins, does not end it."""
    autopilot = descending(guidance="reposition", reposition={"law": law})
    autopilot.wait(3.0)
    sent = autopilot.commands(commands.REPOSITION)
    assert len(sent) >= 3
    assert {message.param2 for message in sent} == {0.0}


def test_a_reposition_that_an_older_px4_calls_unsupported_is_flown_all_the_same() -> None:
    autopilot = descending(guidance="reposition")
    autopilot.result[commands.REPOSITION] = mavlink.MAV_RESULT_UNSUPPORTED
    autopilot.wait(5.0)
    assert autopilot.phase is Phase.DESCEND
    assert len(autopilot.commands(commands.REPOSITION)) >= 4


def test_a_flight_to_the_start_point_that_is_put_off_is_asked_for_again() -> None:
    autopilot = climbing()
    autopilot.result[commands.REPOSITION] = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    autopilot.altitude_mm += 10_000
    autopilot.wait(0.1)
    autopilot.mode, autopilot.landed = HOLD, 2
    autopilot.wait(0.3)
    assert autopilot.phase is Phase.HOLD  # nobody named a start point
    assert not autopilot.commands(commands.REPOSITION)

    autopilot = ScriptedAutopilot()
    autopilot.armed, autopilot.landed, autopilot.system_status = False, ON_GROUND, STANDBY
    autopilot.wait(6.0)
    autopilot.ask(Verb.TAKEOFF, start_ned_m=(5.0, 0.0, -10.0))
    autopilot.wait(0.3)
    autopilot.armed, autopilot.system_status = True, ACTIVE
    autopilot.wait(1.1)
    autopilot.mode, autopilot.landed = TAKEOFF, 3
    autopilot.wait(0.5)
    autopilot.result[commands.REPOSITION] = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    autopilot.altitude_mm += 10_000
    autopilot.wait(0.1)
    autopilot.mode, autopilot.landed = HOLD, 2
    autopilot.wait(0.5)
    autopilot.result.clear()
    autopilot.wait(3.0)
    assert autopilot.phase is Phase.TRANSIT
    assert len(autopilot.commands(commands.REPOSITION)) == 2


def test_a_takeoff_that_is_put_off_is_asked_for_again_and_then_no_more() -> None:
    autopilot = armed_for_takeoff()
    autopilot.sent.clear()
    autopilot.wait(5.0)
    assert not autopilot.commands(commands.TAKEOFF)

    autopilot = ScriptedAutopilot()
    autopilot.armed, autopilot.landed, autopilot.system_status = False, ON_GROUND, STANDBY
    autopilot.result[commands.TAKEOFF] = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    autopilot.wait(6.0)
    autopilot.ask(Verb.TAKEOFF)
    autopilot.wait(0.3)
    autopilot.armed, autopilot.system_status = True, ACTIVE
    autopilot.wait(1.1)
    autopilot.result.clear()
    autopilot.wait(4.0)
    assert len(autopilot.commands(commands.TAKEOFF)) == 2
    assert all(math.isnan(message.param5) for message in autopilot.commands(commands.TAKEOFF))


@pytest.mark.parametrize(("system_status", "code"), [(ACTIVE, "pilot_took_over"), (CRITICAL, "autopilot_failsafe")])
def test_a_heartbeat_alone_tells_a_pilot_from_a_failsafe(system_status: int, code: str) -> None:
    """It may come a tenth of a second before CURRENT_MODE, which names the intended mode."""
    autopilot = descending()
    autopilot.say(mavlink.MAVLink_heartbeat_message(2, 12, 0x81, RETURN, system_status, 3))
    assert autopilot.mission is not None
    assert autopilot.mission.code == code


def test_offboard_is_never_asked_for_again_once_it_was_taken_away() -> None:
    autopilot = descending()
    assert autopilot.mode == OFFBOARD
    autopilot.mode = POSITION
    autopilot.wait(0.2)
    autopilot.sent.clear()
    autopilot.wait(5.0)
    assert autopilot.phase is Phase.YIELDED
    assert autopilot.sent == []
