"""MAVLink telemetry logs (`.tlog`): what a ground station heard, each packet behind the time of its arrival."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from station.recording_import.source_error import SourceError

STAMP_BYTES = 8
NS_PER_US = 1000
MAVLINK_1, MAVLINK_2 = 0xFE, 0xFD
"""The byte that a packet starts with."""
_HEADER_AND_CHECKSUM = {MAVLINK_1: 8, MAVLINK_2: 12}
"""Bytes of a packet beside its payload, by the byte that it starts with: MAVLink 1 and 2."""
_SIGNATURE_BYTES, _SIGNED = 13, 0x01


@dataclass(frozen=True)
class Packet:
    """One MAVLink packet of a log, undecoded."""

    received_at_ns: int
    """When the program that wrote the log heard or sent it, UTC ns; never before the packet ahead of it."""
    data: bytes
    """The whole packet."""

    @property
    def component(self) -> int:
        """Which part of the system sent it."""
        return self.data[6] if self.data[0] == MAVLINK_2 else self.data[4]

    @property
    def message_id(self) -> int:
        """Which message it is."""
        return int.from_bytes(self.data[7:10], "little") if self.data[0] == MAVLINK_2 else self.data[5]


def read_tlog(path: Path) -> Iterator[Packet]:
    """The packets of a log, first to last; what a crash left unfinished at the end is left out.

    Each packet stands behind 8 bytes of time, microseconds since the Unix epoch, most significant byte first.

    Raises:
        SourceError: If the file cannot be read or is no such log.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise SourceError(f"{path}: cannot be read ({error.strerror}): check the path") from None
    at, newest_ns = 0, 0
    while at + STAMP_BYTES + 3 <= len(data):
        start = at + STAMP_BYTES
        beside = _HEADER_AND_CHECKSUM.get(data[start])
        if beside is None:
            raise SourceError(f"{path}: no MAVLink packet at byte {start}: is this a .tlog, and undamaged?")
        signed = data[start] == MAVLINK_2 and data[start + 2] & _SIGNED
        end = start + data[start + 1] + beside + (_SIGNATURE_BYTES if signed else 0)
        if end > len(data):
            return
        newest_ns = max(newest_ns, int.from_bytes(data[at:start], "big") * NS_PER_US)
        yield Packet(newest_ns, data[start:end])
        at = end
