"""Whom a port hears and answers."""

import logging
from collections import Counter

import pytest

from alight.runtime.clock import nanoseconds
from alight.runtime.correspondent import Address, Correspondent

AUTOPILOT, STRANGER, THIRD = (Address("127.0.0.1", port) for port in (14580, 5000, 5001))


def test_the_first_who_writes_is_heard_as_long_as_he_writes_at_all() -> None:
    correspondent = Correspondent()
    for tenth in range(0, 600, 19):
        now_ns = nanoseconds(tenth / 10)
        assert correspondent.admits(AUTOPILOT, now_ns)
        assert not correspondent.admits(STRANGER, now_ns + nanoseconds(1.8))
        assert correspondent.address == AUTOPILOT
    assert correspondent.dropped == 32


@pytest.mark.parametrize(("silence_s", "taken_over"), [(1.9, False), (2.0, False), (2.1, True), (3600.0, True)])
def test_another_one_takes_over_after_two_seconds_of_silence(silence_s: float, taken_over: bool) -> None:
    correspondent = Correspondent()
    assert correspondent.admits(AUTOPILOT, nanoseconds(10.0))
    assert correspondent.admits(STRANGER, nanoseconds(10.0 + silence_s)) is taken_over
    assert correspondent.address == (STRANGER if taken_over else AUTOPILOT)


def test_others_do_not_lengthen_or_shorten_the_silence() -> None:
    correspondent = Correspondent()
    correspondent.admits(AUTOPILOT, 0)
    admitted = [correspondent.admits(STRANGER, nanoseconds(tenth / 10)) for tenth in range(1, 40)]
    assert admitted.index(True) == 20  # at 2.1 s
    assert all(admitted[20:])


def test_each_stranger_is_named_once(caplog: pytest.LogCaptureFixture) -> None:
    correspondent = Correspondent()
    correspondent.admits(AUTOPILOT, 0)
    with caplog.at_level(logging.WARNING, "alight"):
        for millisecond in range(1000):
            correspondent.admits(STRANGER, millisecond * 1_000_000)
        correspondent.admits(THIRD, nanoseconds(1.0))
    assert [record.__dict__["sender"] for record in caplog.records] == ["127.0.0.1:5000", "127.0.0.1:5001"]
    assert {record.__dict__["answered"] for record in caplog.records} == {"127.0.0.1:14580"}
    assert correspondent.dropped == 1001


def heard_of_the_autopilot(first_hz: float, autopilot_hz: float, for_s: float = 20.0) -> float:
    """The share of the autopilot's datagrams that are taken when somebody else wrote first and goes on."""
    correspondent = Correspondent()
    writings = [(n / first_hz, STRANGER) for n in range(round(for_s * first_hz))]
    writings += [(0.001 + n / autopilot_hz, AUTOPILOT) for n in range(round(for_s * autopilot_hz))]
    taken = Counter(sender for at_s, sender in sorted(writings) if correspondent.admits(sender, nanoseconds(at_s)))
    return taken[AUTOPILOT] / (for_s * autopilot_hz)


def test_a_ground_station_that_came_first_does_not_keep_the_autopilot_out() -> None:
    assert heard_of_the_autopilot(first_hz=1.0, autopilot_hz=50.0) > 0.75


def test_of_two_autopilots_the_first_stays() -> None:
    assert heard_of_the_autopilot(first_hz=50.0, autopilot_hz=50.0) == 0.0
