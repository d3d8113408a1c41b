"""Bytes to MAVLink messages: whatever comes in, nothing is raised and everything that is refused is counted."""

import struct
from collections import Counter
from collections.abc import Collection
from typing import Any

from pymavlink.generator.mavcrc import x25crc

from services.commander.dialect import mavlink

MARKER_V1, MARKER_V2 = 0xFE, 0xFD
SIGNED = 0x01
SIGNATURE_BYTES = 13
MAX_FRAME_BYTES = 280 + SIGNATURE_BYTES


class MavlinkFramer:
    """Cuts a stream of bytes, in chunks of any size, into messages of the known dialect.

    After a frame with a wrong checksum the search goes on one byte later, so that a stray start marker costs no good message.
    """

    def __init__(self, wanted: Collection[str] | None = None) -> None:
        """Begin with nothing pending.

        Args:
            wanted: Names of the messages to decode; all if None. An autopilot sends twice as many as anybody takes, and decoding is
                what costs.
        """
        self._wanted = {
            message_id for message_id, kind in mavlink.mavlink_map.items() if wanted is None or kind.msgname in wanted
        }
        self._pending = b""
        self._decoder = mavlink.MAVLink(None)
        self.counts: Counter[str] = Counter()
        """`frames`, `bad_checksum`, `unknown_message`, `stray_bytes`, `malformed`."""
        self.unread: list[tuple[int, int]] = []
        """System and component that sent each good frame of the last chunk whose message is not wanted."""

    def feed(self, data: bytes) -> list[Any]:
        """Take the next chunk; returns the wanted messages that are complete now, in order."""
        self.unread = []
        buffer = self._pending + data
        messages: list[Any] = []
        at = 0
        while True:
            start = _next_marker(buffer, at)
            self.counts["stray_bytes"] += start - at
            end = start + _frame_length(buffer, start)
            if end > len(buffer) or start == len(buffer):
                break
            followed = end == len(buffer) or buffer[end] in (MARKER_V1, MARKER_V2)
            at = end if self._take(buffer[start:end], followed, messages) else start + 1
        self._pending = buffer[start:]
        return messages

    def _take(self, frame: bytes, followed: bool, messages: list[Any]) -> bool:
        """Decode one frame; whether the search goes on behind it (otherwise one byte after its start)."""
        message_id = frame[5] if frame[0] == MARKER_V1 else int.from_bytes(frame[7:10], "little")
        known = mavlink.mavlink_map.get(message_id)
        if known is None:
            # Its checksum cannot be judged without the definition; newer autopilots send such all the time.
            self.counts["unknown_message"] += 1
            return followed
        if not _checksum_fits(frame, known.crc_extra):
            self.counts["bad_checksum"] += 1
            return False
        if message_id not in self._wanted:
            self.unread.append((frame[3], frame[4]) if frame[0] == MARKER_V1 else (frame[5], frame[6]))
            self.counts["frames"] += 1
            return True
        try:
            messages.append(self._decoder.decode(bytearray(frame)))
            self.counts["frames"] += 1
        except (mavlink.MAVError, struct.error, ValueError, TypeError):
            self.counts["malformed"] += 1
        return True


def _next_marker(buffer: bytes, at: int) -> int:
    while at < len(buffer) and buffer[at] not in (MARKER_V1, MARKER_V2):
        at += 1
    return at


def _frame_length(buffer: bytes, start: int) -> int:
    """Bytes of the frame that begins at `start`; more than can be there while its header is incomplete."""
    if len(buffer) < start + 3:
        return MAX_FRAME_BYTES
    if buffer[start] == MARKER_V1:
        return buffer[start + 1] + 8
    return buffer[start + 1] + 12 + (SIGNATURE_BYTES if buffer[start + 2] & SIGNED else 0)


def _checksum_fits(frame: bytes, crc_extra: int) -> bool:
    end = len(frame) - 2
    if frame[0] == MARKER_V2 and frame[2] & SIGNED:
        end -= SIGNATURE_BYTES
    crc = x25crc(frame[1:end] + bytes((crc_extra,)))
    return bool(crc.crc == int.from_bytes(frame[end : end + 2], "little"))
