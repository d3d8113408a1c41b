"""Takes what is whole out of a file that was cut short or damaged, and writes it as a whole one."""

import fcntl
import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mcap.records import Attachment, Channel, Chunk, DataEnd, Header, McapRecord, Metadata, Schema
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer

from alight.runtime.clock import NS_PER_S
from services.recorder import layout
from station.mcap_parts import DAMAGE, begins_as_recording

_LONGEST_RECORD_BYTES = 2**30
_CRC_BYTES = 4
_COMPRESSION = {"zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4, "": CompressionType.NONE}


class SalvageError(ValueError):
    """A file that cannot be mended: one line with the path and the reason."""


@dataclass
class Salvage:
    """What became of a file."""

    messages: int = 0
    """How many are whole."""
    last_ns: int = 0
    """Latest time of recording among them, UTC ns."""
    lost: list[str] = field(default_factory=list)
    """What could not be saved, in words; empty for a file that is whole."""


def look(source: Path) -> Salvage:
    """Find out what is whole.

    Raises:
        SalvageError: If it is no MCAP file, or is written at this moment.
    """
    found = Salvage()
    for record in _records(source, found):
        _count(record, found)
    return found


def salvage(source: Path, target: Path) -> Salvage:
    """Write what is whole in `source` as the new file `target`, indexed, with a record of what was lost.

    Raises:
        SalvageError: If `source` is no MCAP file, or is written at this moment.
        OSError: If `target` exists or cannot be written.
    """
    found = Salvage()
    with target.open("xb") as file:
        copy = _Copy(file)
        for record in _records(source, found):
            _count(record, found)
            copy.add(record)
        copy.finish(source, found)
        file.flush()
        os.fsync(file.fileno())
    return found


class _Copy:
    """Writes records into a new file; a chunk stays a chunk."""

    def __init__(self, file: Any) -> None:
        self._file = file
        self._made: Any = None
        self._library = layout.LIBRARY
        self._waiting: list[McapRecord] = []
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, int] = {}

    def add(self, record: McapRecord | list[McapRecord]) -> None:
        """Take one record from outside the chunks, or all of one chunk."""
        if isinstance(record, Header):
            self._library = record.library
        elif isinstance(record, Chunk):
            self._begin(record.compression)
        elif isinstance(record, list):
            for inner in record:
                self._inside(inner)
            self._made.flush()
        elif isinstance(record, Metadata | Attachment):
            self._waiting.append(record)
            if self._made is not None:
                self._outside()

    def finish(self, source: Path, found: Salvage) -> None:
        """Say what was lost, and complete the file."""
        self._begin("zstd")
        if found.lost:
            lost = "; ".join(found.lost)
            values = {"lost": lost, "from_bytes": str(source.stat().st_size), "messages": str(found.messages)}
            self._made.add_metadata(layout.REPAIR, values)
        self._made.finish()

    def _begin(self, compression: str) -> None:
        """The first chunk tells how the file was compressed; what came before it waits for that."""
        if self._made is None:
            chunk_size = _LONGEST_RECORD_BYTES  # a chunk ends where it ended
            self._made = Writer(self._file, chunk_size=chunk_size, compression=_COMPRESSION[compression])
            self._made.start(profile="", library=self._library)
            self._outside()

    def _outside(self) -> None:
        for record in self._waiting:
            if isinstance(record, Metadata):
                self._made.add_metadata(record.name, record.metadata)
            elif isinstance(record, Attachment):
                self._made.add_attachment(
                    record.create_time, record.log_time, record.name, record.media_type, record.data
                )
        self._waiting.clear()

    def _inside(self, record: McapRecord) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = self._made.register_schema(record.name, record.encoding, record.data)
        elif isinstance(record, Channel):
            self._channels[record.id] = self._made.register_channel(
                record.topic, record.message_encoding, self._schemas.get(record.schema_id, 0), record.metadata
            )
        elif isinstance(record, McapMessage) and record.channel_id in self._channels:
            channel = self._channels[record.channel_id]
            self._made.add_message(channel, record.log_time, record.data, record.publish_time, record.sequence)


def _records(source: Path, found: Salvage) -> Iterator[McapRecord | list[McapRecord]]:
    """What is whole: records from outside the chunks, chunks, and after each chunk what is in it."""
    with source.open("rb") as file:
        _refuse_if_written(source, file.fileno())
        reader = StreamReader(file, emit_chunks=True, record_size_limit=_LONGEST_RECORD_BYTES).records
        at, finished = 0, False
        while not finished:
            try:
                record = next(reader)
            except (*DAMAGE, StopIteration) as error:
                _note_end(source, at, found, error)
                return
            if isinstance(record, DataEnd):
                # What follows is the index, which is made anew; but it must be there for the file to be whole.
                finished = True
                found.lost += [] if _index_is_whole(file.read()) else ["its index"]
            yield record
            if isinstance(record, Chunk):
                yield from _inside(record, at, found)
            at = file.tell()


def _index_is_whole(rest: bytes) -> bool:
    """Whether what follows the data ends as it must, and its checksum, four bytes before the magic at the end, is right."""
    end = -len(MCAP0_MAGIC) - _CRC_BYTES
    if not rest.endswith(MCAP0_MAGIC) or len(rest) < -end:
        return False
    (crc,) = struct.unpack_from("<I", rest, len(rest) + end)
    return crc in (0, zlib.crc32(rest[:end]))


def _inside(chunk: Chunk, at: int, found: Salvage) -> Iterator[list[McapRecord]]:
    try:
        yield breakup_chunk(chunk, validate_crc=True)
    except DAMAGE:
        begin, end = _clock(chunk.message_start_time), _clock(chunk.message_end_time)
        found.lost.append(f"a damaged chunk at byte {at}, {begin} to {end}")


def _note_end(source: Path, at: int, found: Salvage, error: BaseException) -> None:
    size = source.stat().st_size
    if at == 0 and not begins_as_recording(source):
        raise SalvageError(f"{source}: not an MCAP recording") from error
    until = f"what came after {_clock(found.last_ns)}" if found.messages else "everything"
    torn = f" ({size - at} bytes at its end are no whole record)" if size > at else ""
    found.lost.append(f"{until}: the file was not finished{torn}")


def _count(record: McapRecord | list[McapRecord], found: Salvage) -> None:
    if isinstance(record, list):
        messages = [inner for inner in record if isinstance(inner, McapMessage)]
        found.messages += len(messages)
        found.last_ns = max([found.last_ns, *(message.log_time for message in messages)])


def _refuse_if_written(source: Path, descriptor: int) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        raise SalvageError(f"{source}: a recorder is still writing to it: stop the recorder first") from None
    except OSError:  # a file system without locks
        return


def _clock(at_ns: int) -> str:
    return f"{datetime.fromtimestamp(at_ns // NS_PER_S, UTC):%H:%M:%S}.{at_ns % NS_PER_S // 1_000_000:03d} UTC"
