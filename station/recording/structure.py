"""Checks that an MCAP file is built as the specification says: every count, offset, time and checksum in it.

It reads the file front to back, keeps what it finds, and holds the index at the end against that.
"""

import struct
import zlib
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import lz4.frame
import zstandard
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, ChunkIndex, MessageIndex, MetadataIndex, Statistics
from mcap.writer import MCAP0_MAGIC

from station.recording.mcap_records import HEAD_BYTES, Placed, RecordError, records

_BEFORE_SUMMARY_CRC_BYTES = 8 + 8


@dataclass
class Structure:
    """What was found."""

    problems: list[str] = field(default_factory=list)
    """What is wrong, in words."""
    warnings: list[str] = field(default_factory=list)
    """What is odd but allowed."""
    schemas: dict[int, Any] = field(default_factory=dict)
    """The data section's, by id."""
    channels: dict[int, Any] = field(default_factory=dict)
    """The data section's, by id."""
    messages: list[Any] = field(default_factory=list)
    """All messages, in the order of the file."""
    chunk_indexes: dict[int, ChunkIndex] = field(default_factory=dict)
    """What the index should say of each chunk, by its offset."""
    attachments: dict[int, AttachmentIndex] = field(default_factory=dict)
    """What the index should say of each attachment, by its offset."""
    metadata: dict[int, MetadataIndex] = field(default_factory=dict)
    """What the index should say of each metadata record, by its offset."""
    latest_ns: int = 0


def examine(data: memoryview) -> Structure:
    """Check a whole file."""
    found = Structure()
    magic = len(MCAP0_MAGIC)
    if data[:magic] != MCAP0_MAGIC:
        found.problems.append("does not begin as an MCAP file")
        return found
    if data[-magic:] != MCAP0_MAGIC:
        found.problems.append("does not end as an MCAP file: it was not finished")
        return found
    try:
        walked = list(records(data[:-magic], magic))
        _Walk(found).through(walked)
        _check_ends(data, walked, found)
    except (RecordError, zstandard.ZstdError, RuntimeError, struct.error) as error:
        found.problems.append(str(error))
    return found


class _Walk:
    """Goes through the records and keeps what they should add up to."""

    def __init__(self, found: Structure) -> None:
        self._found = found
        self._chunk: ChunkIndex | None = None
        self._expected: dict[int, list[tuple[int, int]]] = {}
        self._in_summary = False
        self._indexes: dict[type[Any], dict[int, Any]] = {ChunkIndex: {}, AttachmentIndex: {}, MetadataIndex: {}}
        self._summary_schemas: dict[int, Any] = {}
        self._summary_channels: dict[int, Any] = {}
        self._statistics: list[Statistics] = []

    def through(self, walked: list[Placed]) -> None:
        """Take all records, then hold the summary against the data."""
        for placed in walked:
            self._take(placed)
        self._compare()

    def _take(self, placed: Placed) -> None:
        record = placed.parsed()
        if placed.opcode != Opcode.MESSAGE_INDEX:
            self._end_of_chunk()
        if placed.opcode == Opcode.DATA_END:
            self._in_summary = True
        elif self._in_summary:
            self._take_from_summary(record)
        elif placed.opcode == Opcode.CHUNK:
            self._take_chunk(placed, record)
        elif placed.opcode == Opcode.MESSAGE_INDEX:
            self._take_message_index(placed, record)
        elif placed.opcode == Opcode.ATTACHMENT:
            self._take_attachment(placed, record)
        elif placed.opcode == Opcode.METADATA:
            self._found.metadata[placed.offset] = MetadataIndex(placed.offset, placed.length, record.name)
        elif placed.opcode != Opcode.HEADER:
            self._problem(f"a record of kind {placed.opcode} outside the chunks at byte {placed.offset}")

    def _take_from_summary(self, record: Any) -> None:
        kind = type(record)
        if kind is Statistics:
            self._statistics.append(record)
        elif kind.__name__ == "Schema":
            self._summary_schemas[record.id] = record
        elif kind.__name__ == "Channel":
            self._summary_channels[record.id] = record
        elif kind in self._indexes:
            offset = record.chunk_start_offset if kind is ChunkIndex else record.offset
            if offset in self._indexes[kind]:
                self._problem(f"two indexes of what lies at byte {offset}")
            self._indexes[kind][offset] = record

    def _take_attachment(self, placed: Placed, record: Any) -> None:
        (crc,) = struct.unpack("<I", placed.content[-4:])
        if crc not in (0, zlib.crc32(placed.content[:-4])):
            self._problem(f"the attachment {record.name} at byte {placed.offset} has a wrong checksum")
        self._found.attachments[placed.offset] = AttachmentIndex(
            offset=placed.offset,
            length=placed.length,
            log_time=record.log_time,
            create_time=record.create_time,
            data_size=len(record.data),
            name=record.name,
            media_type=record.media_type,
        )

    def _take_chunk(self, placed: Placed, chunk: Any) -> None:
        content = _decompressed(chunk)
        if len(content) != chunk.uncompressed_size:
            self._problem(f"the chunk at byte {placed.offset} has another size than it says")
        if chunk.uncompressed_crc != zlib.crc32(content):
            self._problem(f"the chunk at byte {placed.offset} has a wrong checksum")
        self._expected = {}
        times = [self._take_inner(inner) for inner in records(memoryview(content))]
        logged_ns = [time for time in times if time is not None]
        span = (min(logged_ns, default=0), max(logged_ns, default=0))
        if span != (chunk.message_start_time, chunk.message_end_time):
            self._problem(f"the chunk at byte {placed.offset} says other times than its messages")
        self._chunk = self._found.chunk_indexes[placed.offset] = ChunkIndex(
            chunk_length=placed.length,
            chunk_start_offset=placed.offset,
            compression=chunk.compression,
            compressed_size=len(chunk.data),
            message_end_time=chunk.message_end_time,
            message_index_length=0,
            message_index_offsets={},
            message_start_time=chunk.message_start_time,
            uncompressed_size=chunk.uncompressed_size,
        )

    def _take_inner(self, placed: Placed) -> int | None:
        record = placed.parsed()
        if placed.opcode == Opcode.SCHEMA:
            self._define(self._found.schemas, record, "schema")
        elif placed.opcode == Opcode.CHANNEL:
            if record.schema_id not in (0, *self._found.schemas):
                self._problem(f"channel {record.topic} has a schema that comes later or never")
            self._define(self._found.channels, record, "channel")
        elif placed.opcode == Opcode.MESSAGE:
            if record.channel_id not in self._found.channels:
                self._problem(f"a message of channel {record.channel_id}, which comes later or never")
            if record.log_time < self._found.latest_ns:
                self._found.warnings.append(f"a message at {record.log_time} after one at {self._found.latest_ns}")
            self._found.latest_ns = max(self._found.latest_ns, record.log_time)
            self._found.messages.append(record)
            self._expected.setdefault(record.channel_id, []).append((record.log_time, placed.offset))
            return int(record.log_time)
        else:
            self._problem(f"a record of kind {placed.opcode} inside a chunk")
        return None

    def _define(self, known: dict[int, Any], record: Any, what: str) -> None:
        if record.id == 0 or known.setdefault(record.id, record) != record:
            self._problem(f"{what} {record.id} is defined twice, differently")

    def _take_message_index(self, placed: Placed, index: MessageIndex) -> None:
        if self._chunk is None:
            self._problem(f"an index of messages without a chunk at byte {placed.offset}")
            return
        if self._expected.pop(index.channel_id, None) != index.records:
            self._problem(f"the index of messages at byte {placed.offset} does not fit its chunk")
        self._chunk.message_index_offsets[index.channel_id] = placed.offset
        self._chunk.message_index_length += placed.length

    def _end_of_chunk(self) -> None:
        if self._chunk is not None and self._expected:
            self._problem(f"the chunk at byte {self._chunk.chunk_start_offset} lacks an index of its messages")
        self._chunk, self._expected = None, {}

    def _compare(self) -> None:
        found = self._found
        for what, kind, expected in (
            ("chunks", ChunkIndex, found.chunk_indexes),
            ("attachments", AttachmentIndex, found.attachments),
            ("metadata", MetadataIndex, found.metadata),
        ):
            if self._indexes[kind] != expected:
                self._problem(f"the index of {what} does not fit what is in the file")
        if self._summary_schemas != found.schemas or self._summary_channels != found.channels:
            self._problem("the summary's schemas or channels are not those of the data")
        if self._statistics != [_statistics(found)]:
            self._problem("the statistics do not fit what is in the file")

    def _problem(self, text: str) -> None:
        self._found.problems.append(text)


def _decompressed(chunk: Any) -> bytes:
    if chunk.compression == "zstd":
        return zstandard.decompress(chunk.data, chunk.uncompressed_size)
    if chunk.compression == "lz4":
        return bytes(lz4.frame.decompress(chunk.data))
    if chunk.compression:
        raise RecordError(f"compression {chunk.compression} is not known")
    return bytes(chunk.data)


def _statistics(found: Structure) -> Statistics:
    times = [message.log_time for message in found.messages]
    return Statistics(
        attachment_count=len(found.attachments),
        channel_count=len(found.channels),
        channel_message_counts=dict(Counter(message.channel_id for message in found.messages)),
        chunk_count=len(found.chunk_indexes),
        message_count=len(found.messages),
        message_end_time=max(times, default=0),
        message_start_time=min(times, default=0),
        metadata_count=len(found.metadata),
        schema_count=len(found.schemas),
    )


def _check_ends(data: memoryview, walked: list[Placed], found: Structure) -> None:
    """Header first, data's end once, footer last, and what the footer and the groups of the summary say."""
    kinds = [placed.opcode for placed in walked]
    if kinds[:1] != [Opcode.HEADER] or kinds[-1:] != [Opcode.FOOTER] or kinds.count(Opcode.DATA_END) != 1:
        found.problems.append("header, end of the data and footer are not in their places")
        return
    summary = walked[kinds.index(Opcode.DATA_END) + 1 :]
    footer = summary[-1].parsed()
    checked = data[summary[0].offset : summary[-1].offset + HEAD_BYTES + _BEFORE_SUMMARY_CRC_BYTES]
    if footer.summary_start != summary[0].offset:
        found.problems.append("the footer says another beginning of the summary")
    if footer.summary_crc not in (0, zlib.crc32(checked)):
        found.problems.append("the summary has a wrong checksum")
    offsets = [placed for placed in summary if placed.opcode == Opcode.SUMMARY_OFFSET]
    if offsets and footer.summary_offset_start != offsets[0].offset:
        found.problems.append("the footer says another place of the summary's offsets")
    for offset in (placed.parsed() for placed in offsets):
        group = [placed for placed in summary if placed.opcode == offset.group_opcode]
        begin = group[0].offset if group else offset.group_start
        if offset.group_start != begin or offset.group_length != sum(placed.length for placed in group):
            found.problems.append(f"the summary's offset of the records of kind {offset.group_opcode} is wrong")
