"""Commands are repeated until answered, answers find their commands, and nothing is repeated that was called back."""

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import development as mavlink

from alight.runtime.clock import NS_PER_S
from schemas.vehicle import FlightMode
from services.commander import flight_commands as commands
from services.commander.command_queue import Command, CommandQueue, Result, command_message

HALF = NS_PER_S // 2


def ack(command_id: int, result: int) -> SimpleNamespace:
    return SimpleNamespace(command=command_id, result=result)


def queue() -> CommandQueue:
    return CommandQueue(tries=3, timeout_ns=HALF)


def test_three_tries_and_then_it_is_given_up() -> None:
    waiting = queue()
    waiting.submit(commands.arm())
    assert [len(waiting.due(i * HALF)[0]) for i in range(3)] == [1, 1, 1]
    sent, given_up = waiting.due(3 * HALF)
    assert sent == []
    assert [outcome.result for outcome in given_up] == [Result.NO_ANSWER]


def test_the_repetition_is_counted_in_the_message() -> None:
    waiting = queue()
    waiting.submit(commands.arm())
    waiting.due(0)
    [(command, repetition)], _ = waiting.due(HALF)
    assert command_message(command, repetition, 1, 1).confirmation == 1


@pytest.mark.parametrize("result", range(7))
def test_an_answer_ends_the_waiting_unless_it_only_asks_for_patience(result: int) -> None:
    waiting = queue()
    waiting.submit(commands.arm())
    waiting.due(0)
    outcome = waiting.take_ack(ack(commands.ARM_DISARM, result), 5)
    in_progress = result == mavlink.MAV_RESULT_IN_PROGRESS
    assert (outcome is None) == in_progress
    assert waiting.is_waiting(commands.ARM_DISARM) == in_progress


@given(st.integers(0, 65535), st.integers(0, 255))
def test_answers_that_nobody_waits_for_do_nothing(command_id: int, result: int) -> None:
    assert queue().take_ack(ack(command_id, result), 0) is None


def test_a_newer_mode_takes_the_place_of_an_older_one() -> None:
    waiting = queue()
    waiting.submit(commands.set_mode(FlightMode.OFFBOARD))
    waiting.due(0)
    waiting.submit(commands.set_mode(FlightMode.HOLD))
    assert [command.name for command, _ in waiting.due(1)[0]] == ["set mode hold"]
    assert waiting.due(HALF - 1)[0] == []


def test_flight_commands_can_be_called_back_and_others_stay() -> None:
    waiting = queue()
    waiting.submit(commands.land_here())
    waiting.submit(Command("request message 30", 511, flight=False))
    waiting.due(0)
    waiting.recall_flight_commands()
    assert [command.id for command, _ in waiting.due(HALF)[0]] == [511]


def test_requests_of_one_kind_go_out_one_after_the_other() -> None:
    """An answer names the MAV_CMD alone."""
    waiting = queue()
    for message_id in (30, 31):
        waiting.submit(Command(f"request message {message_id}", 511, (message_id,), flight=False))
    assert len(waiting.due(0)[0]) == 1
    waiting.take_ack(ack(511, 0), 1)
    assert [command.parameters for command, _ in waiting.due(2)[0]] == [(31,)]
