"""The clocks of other hosts: offset and round trip from questions and answers, and when it is complained of."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.runtime.clock import NS_PER_S, nanoseconds
from alight.runtime.clock_offset import ClockOffset, Exchange
from alight.runtime.peer_clocks import FORGET_AFTER_NS, PeerClocks, peers_of
from schemas import topics
from schemas.clock import ClockReading

EPOCH = 1_767_225_600 * NS_PER_S
delays_s = st.floats(0.0, 0.2)


def exchange(offset_s: float, there_s: float, back_s: float, thought_s: float = 0.0, asked_ns: int = EPOCH) -> Exchange:
    """A question to a clock that is `offset_s` ahead of ours."""
    ahead_ns = nanoseconds(offset_s)
    received_ns = asked_ns + nanoseconds(there_s)
    answered_ns = received_ns + nanoseconds(thought_s)
    return Exchange(asked_ns, received_ns + ahead_ns, answered_ns + ahead_ns, answered_ns + nanoseconds(back_s))


def told(clocks: PeerClocks, peer: str, one: Exchange, host: str = "drone") -> None:
    """Give an exchange to the clocks as its answer."""
    reading = ClockReading(
        service=peer, host=host, received_at_ns=one.received_ns, answered_at_ns=one.answered_ns
    )  # fmt: skip
    clocks.take(peer, reading, one.asked_ns, one.came_ns)


@given(st.floats(-10.0, 10.0), delays_s, delays_s, st.floats(0.0, 0.1))
def test_the_true_offset_lies_within_half_of_the_round_trip(
    offset_s: float, there_s: float, back_s: float, thought_s: float
) -> None:
    one = exchange(offset_s, there_s, back_s, thought_s)
    assert abs(one.offset_ns - nanoseconds(offset_s)) <= one.round_trip_ns / 2 + 2
    assert one.round_trip_ns == pytest.approx(nanoseconds(there_s) + nanoseconds(back_s), abs=2)


@given(st.floats(-10.0, 10.0), st.lists(st.tuples(delays_s, delays_s), min_size=1, max_size=30))
def test_however_the_answers_are_delayed_the_quickest_of_the_last_decides(
    offset_s: float, ways: list[tuple[float, float]]
) -> None:
    offset = ClockOffset(NS_PER_S)
    for number, (there_s, back_s) in enumerate(ways):
        assert offset.take(exchange(offset_s, there_s, back_s, asked_ns=EPOCH + number * NS_PER_S))
    assert offset.best is not None
    assert offset.best.round_trip_ns <= min(nanoseconds(sum(way)) for way in ways[-8:]) + 2
    assert abs(offset.best.offset_ns - nanoseconds(offset_s)) <= offset.best.round_trip_ns / 2 + 2


def test_a_clock_that_is_set_is_followed_at_the_next_answer() -> None:
    offset = ClockOffset(NS_PER_S)
    for number in range(5):
        offset.take(exchange(0.3, 0.0001, 0.0001, asked_ns=EPOCH + number * NS_PER_S))
    offset.take(exchange(0.0, 0.002, 0.001, asked_ns=EPOCH + 6 * NS_PER_S))
    assert offset.best is not None and abs(offset.best.offset_ns) <= offset.best.round_trip_ns / 2


@pytest.mark.parametrize(
    "wrong",
    [
        Exchange(EPOCH, EPOCH, EPOCH, EPOCH - 1),  # our own clock was set back in between
        Exchange(EPOCH, EPOCH + 5, EPOCH, EPOCH + 10),  # answered before it was asked
        Exchange(EPOCH, EPOCH, EPOCH, EPOCH + 2 * NS_PER_S),  # too slow to tell anything
    ],
)
def test_an_impossible_answer_is_counted_and_left_out(wrong: Exchange) -> None:
    offset = ClockOffset(NS_PER_S)
    assert not offset.take(wrong)
    assert offset.best is None and offset.left_out == 1


def test_who_never_answers_is_shown_without_an_offset_and_not_complained_of() -> None:
    account = PeerClocks({"camera", "commander"}, 0.2).account(EPOCH)
    assert [(clock.of, clock.offset_s, clock.age_s) for clock in account.clocks] == [
        ("camera", None, None),
        ("commander", None, None),
    ]
    assert account.complaints == ()


def test_an_offset_beyond_the_limit_is_complained_of_once_a_host() -> None:
    clocks = PeerClocks({"camera", "detector", "commander"}, 0.2)
    for peer in ("camera", "detector"):
        told(clocks, peer, exchange(0.35, 0.001, 0.001))
    told(clocks, "commander", exchange(0.01, 0.001, 0.001), host="ground")
    account = clocks.account(EPOCH + NS_PER_S)
    assert {clock.of: clock.host for clock in account.clocks} == {
        "camera": "drone",
        "detector": "drone",
        "commander": "ground",
    }
    (complaint,) = account.complaints
    assert "host drone (camera, detector) is 0.350 s ahead of ours" in complaint
    assert "max_clock_skew_s is 0.2" in complaint and "NTP" in complaint


def test_a_host_that_answers_no_more_is_unknown_again() -> None:
    clocks = PeerClocks({"camera"}, 0.2)
    told(clocks, "camera", exchange(0.35, 0.001, 0.001))
    (clock,) = clocks.account(EPOCH + FORGET_AFTER_NS + NS_PER_S).clocks
    assert clock.offset_s is None and clock.age_s == pytest.approx(61.0, abs=0.1) and clock.answers == 1
    assert clocks.account(EPOCH + FORGET_AFTER_NS + NS_PER_S).complaints == ()


def test_an_answer_in_anothers_name_changes_nothing() -> None:
    clocks = PeerClocks({"camera"}, 0.2)
    one = exchange(9.0, 0.0, 0.0)
    reading = ClockReading(service="detector", host="x", received_at_ns=one.received_ns, answered_at_ns=one.answered_ns)
    clocks.take("camera", reading, one.asked_ns, one.came_ns)
    clocks.take("detector", reading, one.asked_ns, one.came_ns)
    assert clocks.account(EPOCH).clocks[0].answers == 0


def test_those_are_asked_whose_stamps_are_judged() -> None:
    assert peers_of("geolocator", (topics.DETECTION, topics.VEHICLE_STATE, topics.CALIBRATION)) == {
        "camera",
        "commander",
        "detector",
    }
    assert peers_of("filter", ()) == frozenset()
