"""What is asked in the moment when the commander gives up is refused, with the reason: `accepted` would promise what nobody does."""

import pytest
from scripted_autopilot import OFFBOARD, TICK_NS, ScriptedAutopilot

from schemas.mission import Phase, Verb
from schemas.settings.commander import CommanderSettings
from services.commander.transitions import asked_code

LINK_TIMEOUT_S = CommanderSettings().link.timeout_s


def landing(phase: Phase) -> ScriptedAutopilot:
    """A landing that has got so far."""
    autopilot = ScriptedAutopilot()
    autopilot.sees_pad = phase is Phase.DESCEND
    autopilot.ask(Verb.LAND)
    autopilot.wait(1.5)
    assert autopilot.phase is phase
    return autopilot


def fall_silent(autopilot: ScriptedAutopilot, for_s: float) -> None:
    """Nothing goes over the link any more, and the commander has not looked around since."""
    autopilot.linked = False
    for _ in range(round(for_s * 1e9 / TICK_NS)):
        autopilot.stream()


@pytest.mark.parametrize("phase", [Phase.ACQUIRE, Phase.DESCEND])
def test_an_abort_that_no_autopilot_would_hear_of_is_refused(phase: Phase) -> None:
    """The link has been silent for too long, and the abort comes before the tick that would have noticed."""
    autopilot = landing(phase)
    fall_silent(autopilot, LINK_TIMEOUT_S + 0.04)
    before = autopilot.mission
    assert before is not None
    reply = autopilot.try_asking(Verb.ABORT)
    assert (reply.accepted, autopilot.phase) == (False, Phase.YIELDED)
    assert autopilot.mission is not None
    assert reply.reason == f"yielded: {autopilot.mission.reason}" and autopilot.mission.code == "link_lost"
    assert (autopilot.mission.request_id, before.request_id) == ("", "1")


@pytest.mark.parametrize("silent_s", [0.02, 1.0, 1.9, 1.96, 1.98, 2.0, 2.02, 2.04, 3.0])
@pytest.mark.parametrize("verb", [Verb.LAND, Verb.HOLD, Verb.ABORT])
def test_what_is_accepted_is_what_is_done(verb: Verb, silent_s: float) -> None:
    """However long the link has been silent: the reply and the phase that follows say the same."""
    autopilot = landing(Phase.ACQUIRE)
    autopilot.ask(Verb.HOLD)
    fall_silent(autopilot, silent_s)
    reply = autopilot.try_asking(verb)
    assert autopilot.mission is not None
    done = autopilot.mission.code == asked_code(verb) and autopilot.mission.request_id == reply.request_id
    assert reply.accepted is done, reply.reason


def test_the_same_request_again_gets_the_same_answer() -> None:
    """A reply may be lost, and the commander must not abort, later, what it said it would not."""
    autopilot = landing(Phase.ACQUIRE)
    fall_silent(autopilot, LINK_TIMEOUT_S + 0.04)
    refused = autopilot.try_asking(Verb.ABORT)
    autopilot.linked, autopilot.mode = True, OFFBOARD
    autopilot.wait(0.5)
    again = autopilot.ask_again(Verb.ABORT)
    assert (again.accepted, again.reason) == (False, refused.reason)
    assert autopilot.phase is Phase.YIELDED
