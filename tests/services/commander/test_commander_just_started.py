"""A commander that has just started in the air: what is asked of it before its own first look at the vehicle is not lost."""

import pytest
from scripted_autopilot import HOLD, OFFBOARD, POSITION, ScriptedAutopilot

from schemas.mission import Phase, Verb


@pytest.mark.parametrize("mode", [HOLD, OFFBOARD, POSITION])
@pytest.mark.parametrize(("verb", "phase"), [(Verb.LAND, Phase.ACQUIRE), (Verb.HOLD, Phase.HOLD)])
def test_the_first_request_that_is_accepted_is_carried_out(mode: int, verb: Verb, phase: Phase) -> None:
    """It may come between the bytes that tell the commander enough to accept it and the tick that makes it look around."""
    autopilot = ScriptedAutopilot()
    autopilot.mode = mode
    autopilot.wait(1.0)
    autopilot.restart_commander()
    autopilot.stream()
    while not autopilot.try_asking(verb).accepted:
        autopilot.stream()
    assert autopilot.mission is not None
    assert (autopilot.phase, autopilot.mission.request_id) == (phase, autopilot.replies[-1].request_id)
    assert autopilot.mission.code == f"{verb}_asked"
