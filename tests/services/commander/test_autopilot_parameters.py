"""Parameters that are late, never come or change in flight."""

import struct

from pymavlink.dialects.v20 import development as mavlink
from scripted_autopilot import ScriptedAutopilot

from alight.runtime.clock import nanoseconds
from schemas.mission import Verb
from services.commander.parameters import WANTED, Parameters


def integer(name: str, value: int) -> mavlink.MAVLink_param_value_message:
    """A PARAM_VALUE as PX4 sends one: the integer's bytes in the place of the float."""
    bytewise = struct.unpack("<f", struct.pack("<i", value))[0]
    return mavlink.MAVLink_param_value_message(name.encode(), bytewise, mavlink.MAV_PARAM_TYPE_INT32, 1, 0)


def asked_within(parameters: Parameters, from_s: float, to_s: float) -> list[tuple[int, list[str]]]:
    """The seconds in which something was asked for, and what."""
    rounds = [(second, parameters.due(nanoseconds(second), 1, 1)) for second in range(round(from_s), round(to_s))]
    return [(second, [message.param_id for message in asked]) for second, asked in rounds if asked]


def test_what_is_never_answered_is_asked_for_quickly_at_first_and_slowly_for_ever() -> None:
    parameters = Parameters()
    rounds = asked_within(parameters, 1, 3601)
    assert [second for second, _ in rounds[:7]] == [1, 2, 3, 4, 5, 15, 25]
    assert rounds[-1][0] > 3590
    assert all(names == list(WANTED) for _, names in rounds)


def test_an_answer_that_comes_after_a_minute_is_the_last_that_was_asked_for() -> None:
    parameters = Parameters()
    asked_within(parameters, 1, 60)
    parameters.take(integer("COM_OBL_RC_ACT", 5))
    assert parameters.values["COM_OBL_RC_ACT"] == 5.0
    assert all("COM_OBL_RC_ACT" not in names for _, names in asked_within(parameters, 60, 100))


def test_an_unknown_reaction_to_lost_setpoints_is_complained_of_and_refuses_no_landing() -> None:
    autopilot = ScriptedAutopilot()
    autopilot.wait(60.0)
    complaints = [text for text in autopilot.node.complaints(autopilot.now_ns) if "COM_OBL_RC_ACT" in text]
    assert len(complaints) == 1
    assert "when setpoints stop" in complaints[0]
    assert autopilot.try_asking(Verb.LAND).accepted


def test_the_complaint_ends_with_the_answer_and_comes_again_after_a_boot() -> None:
    autopilot = ScriptedAutopilot()
    autopilot.wait(60.0)
    autopilot.say(integer("COM_OBL_RC_ACT", 5))
    assert "COM_OBL_RC_ACT" not in "".join(autopilot.node.complaints(autopilot.now_ns))
    autopilot.reboot()
    autopilot.wait(5.0)
    assert "COM_OBL_RC_ACT" in "".join(autopilot.node.complaints(autopilot.now_ns))


def test_a_dangerous_reaction_that_is_known_only_after_a_minute_refuses_the_landing() -> None:
    autopilot = ScriptedAutopilot()
    autopilot.wait(60.0)
    autopilot.say(integer("COM_OBL_RC_ACT", 7))
    reply = autopilot.try_asking(Verb.LAND)
    assert not reply.accepted
    assert "COM_OBL_RC_ACT" in reply.reason
