"""The recorded flights of a real PX4: both directions of a link, with the time of each message."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

AUTOPILOT = (1, 1)


def log_folder() -> Path:
    """`ALIGHT_PX4_LOGS`, or `../shared/px4/logs` beside the repository."""
    named = os.environ.get("ALIGHT_PX4_LOGS")
    return Path(named) if named else Path(__file__).resolve().parents[4] / "shared" / "px4" / "logs"


LOGS = sorted(log_folder().glob("*.tlog"))
needs_logs = pytest.mark.skipif(not LOGS, reason="no recorded PX4 flights (set ALIGHT_PX4_LOGS)")


@dataclass(frozen=True)
class Frame:
    """One MAVLink frame of a log, undecoded."""

    at_ns: int
    data: bytes

    @property
    def source(self) -> tuple[int, int]:
        return (self.data[5], self.data[6]) if self.data[0] == 0xFD else (self.data[3], self.data[4])

    @property
    def message_id(self) -> int:
        return int.from_bytes(self.data[7:10], "little") if self.data[0] == 0xFD else self.data[5]


def frames(log: Path) -> Iterator[Frame]:
    """Every frame: 8 bytes of time (microseconds, big endian), then the frame."""
    data = log.read_bytes()
    at = 0
    while at + 8 < len(data):
        time_us = int.from_bytes(data[at : at + 8], "big")
        start = at + 8
        length = data[start + 1]
        if data[start] == 0xFD:
            end = start + length + 12 + (13 if data[start + 2] & 1 else 0)
        else:
            assert data[start] == 0xFE, "not the start of a MAVLink frame"
            end = start + length + 8
        yield Frame(time_us * 1000, data[start:end])
        at = end
