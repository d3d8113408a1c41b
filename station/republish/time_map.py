"""Recorded times brought to now: every time in a message by the same map, so that they keep fitting to each other."""

from dataclasses import dataclass
from typing import Any, TypeVar

from schemas.message import Message

M = TypeVar("M", bound=Message)


@dataclass(frozen=True)
class TimeMap:
    """A straight line from recorded times to times of the replay. At speed 1 it is one common offset, exact to the nanosecond.

    At another speed the stamps run as fast as the messages come: what kept its own pace would soon speak of the future, or of
    what is long past, and no node would take it.
    """

    recorded_ns: int
    """A time of the recording, UTC ns."""
    now_ns: int
    """What it becomes, UTC ns."""
    speed: float = 1.0
    """Recorded seconds in one second of the replay."""

    def moved_ns(self, at_ns: int) -> int:
        """Where a recorded time falls, UTC ns."""
        since_ns = at_ns - self.recorded_ns
        return self.now_ns + (since_ns if self.speed == 1.0 else round(since_ns / self.speed))


def restamped(message: M, times: TimeMap) -> M:
    """The same message with every time in it moved; 0, which stands for none, stays. Durations stay as they were measured."""
    return type(message).model_validate(_moved(message.model_dump(), times))


def _moved(value: Any, times: TimeMap) -> Any:
    if isinstance(value, dict):
        return {
            key: times.moved_ns(inner)
            if key.endswith("_ns") and isinstance(inner, int) and inner > 0
            else _moved(inner, times)
            for key, inner in value.items()
        }
    if isinstance(value, (list, tuple)):
        return tuple(_moved(inner, times) for inner in value) if value and not isinstance(value[0], float) else value
    return value
