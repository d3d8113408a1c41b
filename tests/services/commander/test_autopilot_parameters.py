"""Parameters that are late, never come or change in flight."""

import struct

from pymavlink.dialects.v20 import development as mavlink
from scripted_autopilot import ScriptedAutopilot

from alight.runtime.clock import nanoseconds
from schemas.mission import Verb
from services.commander.parameters import WANTED, Parameters

GROUND_STATION, ONBOARD = mavlink.MAV_TYPE_GCS, mavlink.MAV_TYPE_ONBOARD_CONTROLLER


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
    parameters.take(integer("MPC_LAND_SPEED", 1))
    assert parameters.values["MPC_LAND_SPEED"] == 1.0
    assert all("MPC_LAND_SPEED" not in names for _, names in asked_within(parameters, 60, 100))


def test_what_may_be_changed_in_flight_is_asked_for_again_slowly() -> None:
    parameters = Parameters()
    for name in WANTED:
        parameters.take(integer(name, 0))
    rounds = asked_within(parameters, 1, 3601)
    assert rounds[0] == (5, ["NAV_DLL_ACT", "COM_OBL_RC_ACT"])
    assert len(rounds) == 360


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


def with_gcs_loss_action(value: int, **link: str) -> ScriptedAutopilot:
    autopilot = ScriptedAutopilot(link=link)
    autopilot.parameters["NAV_DLL_ACT"] = value
    autopilot.wait(5.0)
    return autopilot


def test_the_loss_of_the_ground_station_is_hidden_only_while_the_autopilot_does_nothing_on_it() -> None:
    autopilot = with_gcs_loss_action(0)
    assert autopilot.heartbeat_type == GROUND_STATION
    for value, heartbeat_type in ((2, ONBOARD), (0, GROUND_STATION), (1, ONBOARD)):
        autopilot.parameters["NAV_DLL_ACT"] = value
        autopilot.tell_parameter("NAV_DLL_ACT")
        autopilot.wait(1.1)
        assert autopilot.heartbeat_type == heartbeat_type
        assert "NAV_DLL_ACT" not in "".join(autopilot.node.complaints(autopilot.now_ns))


def test_a_change_whose_announcement_is_lost_is_followed_all_the_same() -> None:
    autopilot = with_gcs_loss_action(0)
    autopilot.parameters["NAV_DLL_ACT"] = 2
    autopilot.wait(12.0)
    assert autopilot.heartbeat_type == ONBOARD


def test_after_a_boot_it_passes_for_no_ground_station_until_the_parameter_is_read_anew() -> None:
    autopilot = with_gcs_loss_action(0)
    autopilot.parameters.clear()
    autopilot.reboot()
    autopilot.wait(3.0)
    assert autopilot.heartbeat_type == ONBOARD
    autopilot.parameters["NAV_DLL_ACT"] = 0
    autopilot.wait(5.0)
    assert autopilot.heartbeat_type == GROUND_STATION


def test_whoever_is_told_to_pass_for_a_ground_station_does_and_complains() -> None:
    autopilot = with_gcs_loss_action(2, heartbeat="gcs")
    assert autopilot.heartbeat_type == GROUND_STATION
    assert "NAV_DLL_ACT is set" in "".join(autopilot.node.complaints(autopilot.now_ns))
