"""Commands on their way: sent again until answered, matched to their answers, given up after a while.

An ACK says that the autopilot took the command, not that it did it: what was done is seen in mode and landed state.
"""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from services.commander.dialect import mavlink


class Result(StrEnum):
    """How a command was answered (MAV_RESULT), or that it was not."""

    ACCEPTED = "accepted"
    TEMPORARILY_REJECTED = "temporarily_rejected"
    DENIED = "denied"
    UNSUPPORTED = "unsupported"
    FAILED = "failed"
    IN_PROGRESS = "in_progress"
    CANCELLED = "cancelled"
    NO_ANSWER = "no_answer"
    UNKNOWN = "unknown"


_RESULTS = (
    Result.ACCEPTED,
    Result.TEMPORARILY_REJECTED,
    Result.DENIED,
    Result.UNSUPPORTED,
    Result.FAILED,
    Result.IN_PROGRESS,
    Result.CANCELLED,
)


@dataclass(frozen=True)
class Command:
    """One MAV_CMD. With `position` it goes as COMMAND_INT, since COMMAND_LONG would round a position by up to 20 cm."""

    name: str
    """For people: `arm`, `set mode hold`."""
    id: int
    """MAV_CMD."""
    parameters: tuple[float, ...] = ()
    """From param1 on; what is missing is 0."""
    position: tuple[int, int, float] | None = None
    """Latitude and longitude in 1e-7 degrees, altitude AMSL in metres."""
    flight: bool = True
    """Whether it commands the flight, so that a change of plan calls it back."""


@dataclass(frozen=True)
class Outcome:
    """What became of a command."""

    command: Command
    result: Result
    at_ns: int


@dataclass
class _Entry:
    command: Command
    sent: int = 0
    due_ns: int = 0


@dataclass
class CommandQueue:
    """Keeps at most one command of each MAV_CMD under way, because an answer names nothing but the MAV_CMD."""

    tries: int
    timeout_ns: int
    _waiting: list[_Entry] = field(default_factory=list)

    def submit(self, command: Command) -> None:
        """Take a command in. A flight command takes the place of an earlier one of the same MAV_CMD."""
        if command.flight:
            self._waiting = [entry for entry in self._waiting if entry.command.id != command.id]
        self._waiting.append(_Entry(command))

    def recall_flight_commands(self) -> None:
        """Send none of the flight commands again."""
        self._waiting = [entry for entry in self._waiting if not entry.command.flight]

    def clear(self) -> None:
        """Forget all: the autopilot that they were meant for is gone."""
        self._waiting = []

    def is_waiting(self, command_id: int) -> bool:
        """Whether a command of this MAV_CMD has not been answered yet."""
        return any(entry.command.id == command_id for entry in self._waiting)

    def due(self, now_ns: int) -> tuple[list[tuple[Command, int]], list[Outcome]]:
        """What is to be sent now, each with its repetition number, and what is given up."""
        to_send: list[tuple[Command, int]] = []
        given_up: list[Outcome] = []
        under_way: set[int] = set()
        for entry in list(self._waiting):
            if entry.command.id in under_way:
                continue
            under_way.add(entry.command.id)
            if entry.sent and now_ns < entry.due_ns:
                continue
            if entry.sent >= self.tries:
                self._waiting.remove(entry)
                given_up.append(Outcome(entry.command, Result.NO_ANSWER, now_ns))
                continue
            to_send.append((entry.command, entry.sent))
            entry.sent += 1
            entry.due_ns = now_ns + self.timeout_ns
        return to_send, given_up

    def take_ack(self, ack: Any, now_ns: int) -> Outcome | None:
        """Match an answer; None for one that nobody waits for, or that only says that it takes time."""
        result = _RESULTS[ack.result] if ack.result < len(_RESULTS) else Result.UNKNOWN
        for entry in self._waiting:
            if entry.command.id == ack.command and entry.sent:
                if result is Result.IN_PROGRESS:
                    entry.due_ns = now_ns + self.timeout_ns
                    return None
                self._waiting.remove(entry)
                return Outcome(entry.command, result, now_ns)
        return None


def command_message(command: Command, repetition: int, system: int, component: int) -> Any:
    """The MAVLink message of a command."""
    p1, p2, p3, p4, p5, p6, p7 = (command.parameters + (0.0,) * 7)[:7]
    if command.position is None:
        return mavlink.MAVLink_command_long_message(
            system, component, command.id, repetition, p1, p2, p3, p4, p5, p6, p7
        )
    x, y, z = command.position
    frame = mavlink.MAV_FRAME_GLOBAL_INT
    return mavlink.MAVLink_command_int_message(system, component, frame, command.id, 0, 0, p1, p2, p3, p4, x, y, z)
