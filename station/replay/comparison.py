"""Two messages of one topic and stamp, field by field."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from schemas.message import Message
from station.replay.tolerance import NOT_COMPARED, Tolerances


@dataclass(frozen=True)
class FieldDifference:
    """One field that is not the same."""

    path: str
    """Where it stands, such as `corrected.pad_ned_m[0]`."""
    recorded: Any
    replayed: Any
    tolerance: float
    """Absolute, in the field's own unit; 0 where it has to be the same, infinite where anything goes."""

    @property
    def within(self) -> bool:
        """Whether the difference is tolerated."""
        apart = self.apart
        return self.tolerance == NOT_COMPARED or (apart is not None and apart <= self.tolerance)

    @property
    def apart(self) -> float | None:
        """Absolute difference; None where one of the two is no number."""
        if isinstance(self.recorded, bool) or isinstance(self.replayed, bool):
            return None
        if isinstance(self.recorded, int | float) and isinstance(self.replayed, int | float):
            return abs(self.replayed - self.recorded)
        return None

    @property
    def ulps(self) -> int | None:
        """How many floating-point numbers lie between the two, plus one; None where they are none."""
        if isinstance(self.recorded, float) and isinstance(self.replayed, float):
            return abs(_place(self.replayed) - _place(self.recorded))
        return None

    def text(self) -> str:
        """In words."""
        line = f"{self.path}: recorded {_shown(self.recorded)}, replayed {_shown(self.replayed)}"
        if self.apart is None:
            return line
        distance = f"{self.apart:.3g} apart"
        if self.ulps is not None:
            distance = f"{self.ulps} ulp, {distance}"
        return f"{line} ({distance}; {f'{self.tolerance:g} tolerated' if self.tolerance else 'has to be the same'})"


def recorded_text(message: Message) -> bytes:
    """A message's JSON text as the recorder writes it: two messages with the same text are the same."""
    text: bytes = message.__pydantic_serializer__.to_json(message, exclude_none=True)
    return text


def differences(recorded: Message, replayed: Message, tolerances: Tolerances) -> tuple[FieldDifference, ...]:
    """Every field in which two messages differ, tolerated or not; 0.0 and -0.0 are the same."""
    if recorded == replayed:
        return ()
    return tuple(_walk("", recorded, replayed, tolerances))


def _walk(path: str, recorded: Any, replayed: Any, tolerances: Tolerances) -> Iterator[FieldDifference]:
    if isinstance(recorded, BaseModel) and type(recorded) is type(replayed):
        for name in type(recorded).model_fields:
            below = f"{path}.{name}" if path else name
            yield from _walk(below, getattr(recorded, name), getattr(replayed, name), tolerances)
    elif recorded == replayed:
        return
    elif _are_rows(recorded, replayed) and tolerances.of(path) != NOT_COMPARED:
        for number, (one, other) in enumerate(zip(recorded, replayed, strict=True)):
            yield from _walk(f"{path}[{number}]", one, other, tolerances)
    else:
        yield FieldDifference(path, recorded, replayed, tolerances.of(path))


def _are_rows(recorded: Any, replayed: Any) -> bool:
    return isinstance(recorded, tuple) and isinstance(replayed, tuple) and len(recorded) == len(replayed)


def _place(value: float) -> int:
    """The number's place on the line of all doubles."""
    bits: int = struct.unpack("<q", struct.pack("<d", value))[0]
    return bits if bits >= 0 else -(2**63) - bits


def _shown(value: Any) -> str:
    if isinstance(value, tuple):
        return f"{len(value)} of them"
    if isinstance(value, BaseModel):
        return "something"
    return "nothing" if value is None else repr(value.value if hasattr(value, "value") else value)
