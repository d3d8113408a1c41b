"""PX4 leaves OFFBOARD a second after the last setpoint, for a return by default: they go on until the mode that replaces it is flown."""

import pytest
from pymavlink.dialects.v20 import development as mavlink
from scripted_autopilot import HOLD, IN_AIR, LATITUDE_E7, LONGITUDE_E7, OFFBOARD, ON_GROUND, ScriptedAutopilot
from test_commander_lets_go import descending

from schemas.mission import Phase, Verb
from services.commander import flight_commands as commands

PAD_MM = 500_000
LONGEST_GAP = 0.5
"""Half of the second that PX4 waits."""


class Sinking(ScriptedAutopilot):
    """Goes down at 1 m/s and stays 0.9 m above the pad."""

    sinks = False
    knows_its_place = True
    _above_mm = 10_000

    def position(self, boot_ms: int | None = None):
        if not self.knows_its_place:
            return mavlink.MAVLink_ping_message(0, 0, 0, 0)
        down_mps = 1.0 if self.sinks and self._above_mm > 900 else 0.0
        self._above_mm -= round(20 * down_mps)
        at_ms = self.boot_ms if boot_ms is None else boot_ms
        place = (LATITUDE_E7, LONGITUDE_E7, PAD_MM + self._above_mm)
        return mavlink.MAVLink_global_position_int_message(at_ms, *place, 0, 0, 0, round(100 * down_mps), 0)


def sinking(for_s: float) -> Sinking:
    autopilot = Sinking()
    autopilot.sees_pad = True
    autopilot.ask(Verb.LAND)
    autopilot.wait(3.0)
    autopilot.sinks = True
    autopilot.wait(for_s)
    return autopilot


def touching_down() -> Sinking:
    autopilot = sinking(for_s=12.0)
    assert autopilot.phase is Phase.TOUCHDOWN
    autopilot.sees_pad = False
    autopilot.sent.clear()
    return autopilot


def setpoints_go_on(autopilot: ScriptedAutopilot, for_s: float) -> bool:
    for _ in range(round(for_s / LONGEST_GAP)):
        before = len(autopilot.sent)
        autopilot.wait(LONGEST_GAP)
        if not any(message.get_type().startswith("SET_POSITION_TARGET") for message in autopilot.sent[before:]):
            return False
    return True


def test_in_the_touchdown_until_the_landing_mode_is_flown() -> None:
    autopilot = touching_down()
    autopilot.knows_its_place = False
    autopilot.result[commands.LAND] = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    autopilot.wait(0.6)
    assert setpoints_go_on(autopilot, 3.0)
    assert autopilot.commands(commands.LAND)


def test_in_the_touchdown_when_the_clock_is_set_back() -> None:
    autopilot = touching_down()
    autopilot.set_clock_back(5.0)
    assert setpoints_go_on(autopilot, 3.0)


@pytest.mark.parametrize("step_s", [-0.35, 0.35])
def test_a_clock_that_is_set_while_it_sinks_is_no_jump_of_the_solution(step_s: float) -> None:
    """The autopilot's time is mapped anew, and by that the vehicle seems to have sunk for longer, or for less long, than it did."""
    autopilot = sinking(for_s=2.0)
    autopilot.set_clock_back(step_s)
    autopilot.wait(2.0)
    counters = autopilot.node.counters()
    assert counters["clock_restarts"] == 1
    assert "navigation_jumps" not in counters


@pytest.mark.parametrize("landed", [IN_AIR, ON_GROUND])
def test_in_a_hold_until_hold_is_flown_even_where_the_ground_is_believed_to_be_there(landed: int) -> None:
    autopilot = descending()
    autopilot.answers = autopilot.obeys = False
    autopilot.landed = landed
    autopilot.wait(0.3)
    autopilot.ask(Verb.ABORT)
    assert setpoints_go_on(autopilot, 2.0)
    assert autopilot.mode == OFFBOARD
    autopilot.answers = autopilot.obeys = True
    autopilot.wait(1.2)
    assert autopilot.mode == HOLD
    autopilot.sent.clear()
    autopilot.wait(2.0)
    assert autopilot.sent == []
