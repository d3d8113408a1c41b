"""A commander that has just started in the air: what is asked of it before its own first look at the vehicle is not lost."""

import pytest
from scripted_autopilot import HOLD, OFFBOARD, POSITION, ScriptedAutopilot

from schemas.mission import Phase, Verb

PERIODS = 200
"""Of the streams, 20 ms each: every second comes what is rarest."""


@pytest.mark.parametrize("mode", [HOLD, OFFBOARD, POSITION])
@pytest.mark.parametrize(("verb", "phase"), [(Verb.LAND, Phase.ACQUIRE), (Verb.HOLD, Phase.HOLD)])
def test_the_first_request_that_is_accepted_is_carried_out(mode: int, verb: Verb, phase: Phase) -> None:
    """It may come between the bytes that tell the commander enough to accept it and the tick that makes it look around."""
    autopilot = ScriptedAutopilot()
    autopilot.mode = mode
    autopilot.wait(1.0)
    autopilot.restart_commander()
    for _ in range(PERIODS):
        autopilot.stream()
        if autopilot.try_asking(verb).accepted:
            break
    assert autopilot.replies[-1].accepted, autopilot.replies[-1].reason
    assert autopilot.mission is not None
    assert (autopilot.phase, autopilot.mission.request_id) == (phase, autopilot.replies[-1].request_id)
    assert autopilot.mission.code == f"{verb}_asked"
