"""The records of an MCAP file and where they lie, read from its bytes alone (https://mcap.dev/spec)."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import Any

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

HEAD_BYTES = 9
"""What stands before the content of each record: opcode and length."""
_KINDS: dict[int, Any] = {
    Opcode.HEADER: Header,
    Opcode.FOOTER: Footer,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.CHUNK: Chunk,
    Opcode.MESSAGE_INDEX: MessageIndex,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.ATTACHMENT: Attachment,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
    Opcode.STATISTICS: Statistics,
    Opcode.METADATA: Metadata,
    Opcode.METADATA_INDEX: MetadataIndex,
    Opcode.SUMMARY_OFFSET: SummaryOffset,
    Opcode.DATA_END: DataEnd,
}


class RecordError(ValueError):
    """Bytes that are no record."""


@dataclass(frozen=True)
class Placed:
    """One record."""

    offset: int
    """Where it begins, bytes from the beginning of what was walked through."""
    opcode: int
    content: memoryview
    """Without opcode and length."""

    @property
    def length(self) -> int:
        """All its bytes."""
        return HEAD_BYTES + len(self.content)

    def parsed(self) -> Any:
        """The record; None for a kind that this program does not know.

        Raises:
            RecordError: If it is not whole, or longer than what it says.
        """
        stream = ReadDataStream(BytesIO(self.content))
        kind = _KINDS.get(self.opcode)
        try:
            if self.opcode == Opcode.MESSAGE:
                return Message.read(stream, len(self.content))
            record = None if kind is None else kind.read(stream)
        except Exception as error:  # the library raises many kinds on bytes that are no record
            raise RecordError(f"record of kind {self.opcode} at byte {self.offset} is damaged: {error}") from error
        if record is not None and stream.count != len(self.content):
            raise RecordError(f"record of kind {self.opcode} at byte {self.offset} is longer than what it says")
        return record


def records(data: memoryview, begin: int = 0) -> Iterator[Placed]:
    """The records from `begin` on, in order.

    Raises:
        RecordError: Where the last one is not whole.
    """
    at = begin
    while at < len(data):
        if at + HEAD_BYTES > len(data):
            raise RecordError(f"ends in the middle of a record at byte {at}")
        opcode, length = struct.unpack_from("<BQ", data, at)
        if at + HEAD_BYTES + length > len(data):
            raise RecordError(f"ends in the middle of a record at byte {at}")
        yield Placed(at, opcode, data[at + HEAD_BYTES : at + HEAD_BYTES + length])
        at += HEAD_BYTES + length
