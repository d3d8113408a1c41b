"""One MCAP file, chunked and indexed: one part of a recording."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO, Any, cast

from mcap.writer import CompressionType, Writer

from schemas.settings.recorder import RecorderSettings
from services.recorder import layout
from services.recorder.channels import RecordedChannel
from services.recorder.whole_writes import WholeWrites

COMPRESSION = {"zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4, "none": CompressionType.NONE}
_ROOM_FOR_THE_END_BYTES = 1024 * 1024
_ROOM_FOR_A_CHUNKS_INDEX_BYTES = 1024


class PartFile:
    """Writes one file. After it is open nothing raises; `full` and `failure` say when to stop."""

    def __init__(self, path: Path, settings: RecorderSettings, channels: Iterable[RecordedChannel]) -> None:
        """Create the file and write its head.

        Raises:
            OSError: If it exists or cannot be created.
        """
        self.path = path
        self._disk = WholeWrites(path)
        self._room_bytes = settings.chunk_bytes + _ROOM_FOR_THE_END_BYTES
        self._disk.hold_back(self._room_bytes)
        self._writer: Any = Writer(
            cast(IO[Any], self._disk), chunk_size=settings.chunk_bytes, compression=COMPRESSION[settings.compression]
        )
        self._writer.start(profile="", library=layout.LIBRARY)
        self._ids: dict[str, int] = {}
        self.messages = 0
        self.begun_ns: int | None = None
        schemas: dict[str, int] = {}
        for channel in channels:
            schema = channel.schema
            if schema.name not in schemas:
                schemas[schema.name] = self._writer.register_schema(schema.name, schema.encoding, schema.data)
            self._ids[channel.name] = self._writer.register_channel(
                channel.key, channel.message_encoding, schemas[schema.name], channel.metadata
            )

    @property
    def full(self) -> OSError | None:
        """Why this file should end now, if so: it can still be ended in order."""
        return self._disk.full

    @property
    def failure(self) -> OSError | None:
        """Why nothing more can be written to this file, if so."""
        return self._disk.failure

    @property
    def size_bytes(self) -> int:
        """What has been handed to the operating system."""
        return self._disk.tell()

    def add_message(self, channel: str, data: bytes, sequence: int, logged_at_ns: int, stamp_ns: int) -> None:
        """Add one message to the chunk."""
        if self.begun_ns is None:
            self.begun_ns = logged_at_ns
        self._writer.add_message(self._ids[channel], logged_at_ns, data, stamp_ns, sequence)
        self.messages += 1

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add a record of names and values, at once."""
        self._writer.add_metadata(name, dict(values))

    def add_attachment(self, name: str, media_type: str, data: bytes, at_ns: int = 0) -> None:
        """Add a document, at once."""
        self._writer.add_attachment(at_ns, at_ns, name, media_type, data)

    def flush(self) -> None:
        """Close the chunk and hand it to the operating system, so that a crash of this process cannot lose it."""
        if self._disk.failure is None:
            self._writer.flush()
            self._room_bytes += _ROOM_FOR_A_CHUNKS_INDEX_BYTES
            self._disk.hold_back(-(-self._room_bytes // _ROOM_FOR_THE_END_BYTES) * _ROOM_FOR_THE_END_BYTES)

    def begin_sync(self) -> None:
        """Let the disk take what was flushed, without waiting for it."""
        if self._disk.failure is None:
            self._disk.begin_sync()

    def finish(self, endings: Iterable[tuple[str, Mapping[str, str]]]) -> None:
        """Write the last metadata and the index, and close; after a failure just close: a reader can do without."""
        if self._disk.failure is None:
            self._writer.flush()
            for name, values in endings:
                self.add_metadata(name, values)
            self._writer.finish()
        self._disk.close()
