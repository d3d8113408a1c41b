"""Somebody takes the vehicle over while the commander hears nothing, or nothing new: no mode is asked for on what was known before."""

import pytest
from scripted_autopilot import (
    ACTIVE,
    CRITICAL,
    HOLD,
    IN_AIR,
    OFFBOARD,
    POSITION,
    RETURN,
    TAKEOFF,
    TICK_NS,
    ScriptedAutopilot,
)
from test_commander_lets_go import armed_for_takeoff, climbing, descending

from schemas.mission import Phase, Verb
from services.commander import flight_commands as commands
from services.commander.hearing import Hearing

MS = 1_000_000


class HeldUp:
    """What the autopilot says while the commander's process stands still; it reads all of it afterwards, in order."""

    def __init__(self, autopilot: ScriptedAutopilot) -> None:
        self._autopilot = autopilot
        self._datagrams: list[bytes] = []
        autopilot.say = lambda *messages: self._datagrams.append(  # type: ignore[method-assign]
            b"".join(message.pack(autopilot._encoder) for message in messages)
        )

    def goes_by(self, for_s: float) -> None:
        for _ in range(round(for_s * 1e9 / TICK_NS)):
            self._autopilot.stream()

    def ends(self) -> None:
        """As on a real link: datagram by datagram, and a look around whenever one is due."""
        autopilot = self._autopilot
        del autopilot.say  # type: ignore[attr-defined]
        for count, data in enumerate(self._datagrams):
            autopilot._take(autopilot.node.on_bytes("vehicle", data, autopilot.now_ns))
            if count % 20 == 0:
                autopilot._take(autopilot.node.on_tick(autopilot.now_ns))


@pytest.mark.parametrize("for_s", [1.8, 3.0, 10.0])
def test_a_process_that_stood_still_finds_out_who_flies_before_it_asks_for_a_mode(for_s: float) -> None:
    autopilot = descending()
    held_up = HeldUp(autopilot)
    held_up.goes_by(1.0)
    autopilot.mode, autopilot.system_status = RETURN, CRITICAL
    held_up.goes_by(0.3)
    autopilot.mode, autopilot.system_status = POSITION, ACTIVE
    held_up.goes_by(for_s - 1.3)
    held_up.ends()
    autopilot.wait(3.0)
    assert autopilot.phase is Phase.YIELDED
    assert autopilot.mode == POSITION
    assert not autopilot.commands(commands.SET_MODE)


def test_a_short_pause_ends_no_landing() -> None:
    autopilot = descending()
    held_up = HeldUp(autopilot)
    held_up.goes_by(0.7)
    held_up.ends()
    autopilot.wait(3.0)
    assert autopilot.phase is Phase.DESCEND
    assert autopilot.mode == OFFBOARD


@pytest.mark.parametrize("begin", [climbing, descending])
def test_a_pilot_who_takes_over_while_only_the_way_back_is_silent_keeps_the_vehicle(begin) -> None:
    autopilot = begin()
    autopilot.say = lambda *_: None
    autopilot.wait(0.3)
    autopilot.mode = POSITION
    autopilot.wait(5.0)
    assert autopilot.phase is Phase.YIELDED
    assert autopilot.mode == POSITION


def test_while_nothing_is_heard_the_descent_stands_still_on_its_setpoints() -> None:
    autopilot = descending()
    autopilot.wait(1.0)
    autopilot.sent.clear()
    autopilot.say = lambda *_: None  # type: ignore[method-assign]
    autopilot.wait(1.9)
    setpoints = [message for message in autopilot.sent if message.get_type().startswith("SET_POSITION_TARGET")]
    assert autopilot.phase is Phase.DESCEND
    assert len(setpoints) > 25
    assert setpoints[-1].alt == pytest.approx(setpoints[-10].alt, abs=0.01)
    assert setpoints[-1].vz == pytest.approx(0.0, abs=0.01)
    assert "since a silence" in "; ".join(autopilot.node.complaints(autopilot.now_ns))
    assert autopilot.node.counters()["times_deaf"] == 1


def test_a_clock_that_is_set_forward_is_no_silence_of_the_autopilot() -> None:
    autopilot = descending()
    autopilot.set_clock_back(-6.0)
    autopilot.wait(3.0)
    assert autopilot.phase is Phase.DESCEND
    assert autopilot.mode == OFFBOARD


def test_a_hold_during_the_climb_is_the_pilots() -> None:
    """PX4 goes to HOLD by itself as well, at the height that was asked for."""
    autopilot = climbing()
    autopilot.mode, autopilot.landed = HOLD, IN_AIR
    autopilot.wait(1.0)
    assert autopilot.phase is Phase.YIELDED
    assert autopilot.mission is not None and autopilot.mission.code == "pilot_took_over"
    assert autopilot.sent == []


def test_a_takeoff_is_not_called_back_unheard() -> None:
    autopilot = armed_for_takeoff()
    autopilot.sent.clear()
    autopilot.say = lambda *_: None  # type: ignore[method-assign]
    autopilot.wait(5.0)
    assert autopilot.phase is Phase.YIELDED
    assert autopilot.sent == []


@pytest.mark.parametrize("for_s", [0.7, 1.4])
def test_an_abort_in_a_silence_is_carried_out_after_it(for_s: float) -> None:
    """The takeoff that was commanded before comes first: it was ours, and no pilot's."""
    autopilot = armed_for_takeoff()
    autopilot.linked = False
    autopilot.wait(0.46)
    autopilot.ask(Verb.ABORT)
    autopilot.wait(for_s - 0.46)
    autopilot.mode = TAKEOFF
    autopilot.linked = True
    autopilot.wait(3.0)
    assert autopilot.phase is Phase.ABORTED
    assert autopilot.mode == HOLD


def test_offboard_is_not_asked_for_again_once_it_was_accepted() -> None:
    """Where only the heartbeat tells the mode, a pilot's choice is heard up to a second late."""
    autopilot = ScriptedAutopilot()
    say = autopilot.say
    autopilot.say = lambda *messages: say(  # type: ignore[method-assign]
        *[message for message in messages if message.get_type() != "CURRENT_MODE"]
    )
    autopilot.sees_pad = True
    autopilot.ask(Verb.LAND)
    while autopilot.mode != OFFBOARD:
        autopilot.wait(0.02)
    autopilot.wait(0.1)
    autopilot.mode = HOLD
    autopilot.sent.clear()
    autopilot.wait(2.0)
    assert not autopilot.commands(commands.SET_MODE)
    assert autopilot.mode == HOLD


def hearing_at(now_ms: int) -> Hearing:
    hearing = Hearing(pause_s=0.4, fresh_s=0.5)
    hearing.look(now_ms * MS)
    hearing.heard(now_ms * MS)
    return hearing


def is_deaf(hearing: Hearing, now_ms: int) -> bool:
    return hearing.deaf_for_s(now_ms * MS) is not None


def test_who_looks_and_hears_often_enough_hears_well() -> None:
    hearing = hearing_at(0)
    for now_ms in range(300, 3000, 300):
        assert hearing.look(now_ms * MS) == 0
        hearing.heard(now_ms * MS)
        assert not is_deaf(hearing, now_ms)


@pytest.mark.parametrize("newest_ms", [300, 700, 990])
def test_after_a_silence_a_word_of_it_counts_once_a_sample_of_now_is_read(newest_ms: int) -> None:
    """The link held all back for 0.9 s, and it comes in order. The word was said at 0.25 s."""
    hearing = hearing_at(0)
    for now_ms in range(100, 1001, 100):
        hearing.look(now_ms * MS)
    assert is_deaf(hearing, 1000)
    hearing.sampled(240 * MS, 1000 * MS)
    hearing.told_mode(1000 * MS)
    assert is_deaf(hearing, 1000)
    hearing.sampled(newest_ms * MS, 1000 * MS)
    assert is_deaf(hearing, 1000) is (newest_ms < 500)


def test_after_this_process_stood_still_a_word_counts_that_was_said_since() -> None:
    hearing = hearing_at(0)
    assert hearing.look(3000 * MS) == 3000 * MS
    for said_ms in range(0, 3000, 100):
        hearing.sampled(said_ms * MS, 3000 * MS)
        hearing.told_mode(3000 * MS)
        assert is_deaf(hearing, 3000)
    hearing.sampled(3010 * MS, 3020 * MS)
    assert is_deaf(hearing, 3020)
    hearing.told_mode(3020 * MS)
    assert not is_deaf(hearing, 3020)


def test_where_nothing_but_the_mode_is_heard_the_second_word_counts() -> None:
    hearing = hearing_at(0)
    for now_ms in range(20, 2001, 20):
        hearing.look(now_ms * MS)
        if now_ms % 1000 == 0:
            hearing.heard(now_ms * MS)
            hearing.told_mode(now_ms * MS)
        assert is_deaf(hearing, now_ms) is (400 < now_ms < 2000)
