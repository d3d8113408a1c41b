"""What the recorder of a flight can have heard: nothing of a service that it had not found yet, all of it from then on."""

from types import SimpleNamespace

import pytest

from schemas import topics
from station.replay.life import Life
from station.replay.listening import Listening

T0_NS = 1_700_000_000_000_000_000


def at_ns(time_s):
    return T0_NS + round(time_s * 1e9)


def listening(heard_s, started_s=(0.0,)):
    """A recorder that listens from the beginning for a minute, and heard the commander's status at these times."""
    stored = [SimpleNamespace(logged_at_ns=at_ns(time_s)) for time_s in (-0.01, *sorted(heard_s), 60.0)]
    recording = SimpleNamespace(stored=stored, older=False, of=lambda _: stored[1:-1])
    lives = [Life("commander", at_ns(time_s), (), (), exact=True) for time_s in started_s]
    return Listening(recording, {"commander": lives})


@pytest.mark.parametrize("started_s", [(0.0,), (0.0, 20.0)])
def test_a_service_is_heard_from_its_first_recorded_message_on_and_after_two_seconds_in_any_case(started_s):
    began_s = started_s[-1]
    first, never = listening([1.0, began_s + 0.5], started_s), listening([], started_s)

    def heard(by, after_s):
        return by.heard(topics.VEHICLE_STATUS, at_ns(began_s + after_s))

    assert not heard(first, 0.1) and heard(first, 0.6) and heard(first, 2.5)
    assert not heard(never, 1.9) and heard(never, 2.1)
