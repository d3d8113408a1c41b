"""Reads the MCAP files of one flight front to back, without trusting their index: a crash may have left none."""

import re
import struct
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Chunk, Footer, McapRecord, Metadata
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC
from pydantic import ValidationError
from zstandard import ZstdError

from alight.runtime.node import Pixels
from schemas import topics
from schemas.message import Message
from schemas.topics import Topic
from services.recorder import layout
from station.migration.chain import MigrationError, migrated, recorded_as
from station.part_story import PartStory, missing
from station.recorded_picture import decoded_picture

_LONGEST_RECORD_BYTES = 2**30
_RECORD_HEAD_BYTES = 9
DAMAGE = (McapError, ZstdError, struct.error, ValueError, EOFError, RuntimeError, OverflowError, MemoryError)
"""What the library and the decompressors raise on bytes that are not what they should be."""


class FlightRecordError(ValueError):
    """A recording that cannot be read: one line with the path and the remedy."""


class EmptyRecordingError(FlightRecordError):
    """A recording without a message: of a recorder that was ended before it wrote one, or of nothing that can be read."""

    def __init__(self, path: Path, defects: Iterable[str] = ()) -> None:
        why = "; ".join(defects)
        super().__init__(f"{path}: holds no messages" + (f" ({why})" if why else ""))


@dataclass(frozen=True)
class PicturePlace:
    """Where a picture lies: file, start of its chunk, number of the record in the chunk."""

    path: Path
    chunk_offset: int
    record: int


@dataclass(frozen=True, slots=True)
class StoredMessage:
    """One message as it lies in the file: which it is, but not yet what it says."""

    topic: Topic[Any]
    key: str
    """The key that it was published with."""
    stamp_ns: int
    """The time it speaks of, UTC ns."""
    logged_at_ns: int
    """When it reached the recorder, UTC ns."""
    data: bytes
    """Its JSON text."""
    number: int = 0
    """Counts what the recorder was given on this key since it was started: a gap is a loss in the recorder."""

    @property
    def sender(self) -> str:
        """The service that published it, for topics with a key for each; else empty."""
        return self.key.rsplit("/", 1)[-1] if self.topic.per_service else ""

    def message(self) -> Message:
        """Read it.

        Raises:
            ValidationError: If it is none of this version.
        """
        message: Message = self.topic.message.model_validate_json(self.data)
        return message


class PictureStore:
    """Finds and decodes the pictures of a recording."""

    def __init__(self, places: Mapping[int, PicturePlace] | None = None) -> None:
        self._places = dict(sorted((places or {}).items()))
        self._opened: tuple[tuple[Path, int] | None, list[McapRecord]] = (None, [])

    @property
    def times_ns(self) -> tuple[int, ...]:
        """Capture times, ascending, UTC ns."""
        return tuple(self._places)

    def picture(self, captured_at_ns: int) -> Pixels | None:
        """Decode one picture; None if there is none or it is damaged."""
        stored = self.stored(captured_at_ns)
        return None if stored is None else decoded_picture(stored)

    def stored(self, captured_at_ns: int) -> bytes | None:
        """One picture as it lies in the file, for `decoded_picture`; None if there is none."""
        place = self._places.get(captured_at_ns)
        if place is None:
            return None
        record = self._chunk(place.path, place.chunk_offset)[place.record]
        return bytes(record.data) if isinstance(record, McapMessage) else None

    def _chunk(self, path: Path, offset: int) -> list[McapRecord]:
        """The records of one chunk; the last one stays open, since pictures are mostly asked for in their order."""
        if self._opened[0] != (path, offset):
            with path.open("rb") as file:
                file.seek(offset + _RECORD_HEAD_BYTES)
                self._opened = ((path, offset), breakup_chunk(Chunk.read(ReadDataStream(file))))
        return self._opened[1]


class PartsReader:
    """Goes through the files of one flight, part after part."""

    def __init__(self, path: Path) -> None:
        """Find the parts.

        Raises:
            FlightRecordError: If there is no such file.
        """
        if not path.is_file():
            raise FlightRecordError(f"{path}: no such recording; give a flight's folder or its .mcap file")
        self.parts = [PartStory(file, number) for number, file in _parts(path)]
        """The files, in order; their stories are complete after `messages` or `stored` is through."""
        self._unreadable: Counter[str] = Counter()
        self.versions: dict[str, str] = {}
        self.settings: bytes | None = None
        self.pictures: dict[int, PicturePlace] = {}

    def messages(self) -> Iterator[tuple[str, Message, int]]:
        """Topic's name, message and time of recording (UTC ns) of everything that is whole, in file order."""
        for stored in self.stored():
            try:
                yield stored.topic.name, stored.message(), stored.logged_at_ns
            except ValidationError:
                self._unreadable[stored.key] += 1

    def stored(self) -> Iterator[StoredMessage]:
        """Everything that is whole, in file order, without reading what it says."""
        for part in self.parts:
            with part.path.open("rb") as file:
                channels: dict[int, Channel] = {}
                for offset, record in self._records(file, part):
                    if isinstance(record, Chunk):
                        yield from self._chunk(record, channels, part, offset)
                    else:
                        self._note(record, part)

    def defects(self) -> Iterator[str]:
        """What is wrong or missing, in words; complete after `messages` is through."""
        yield from missing(self.parts)
        for name, count in sorted(self._unreadable.items()):
            yield f"{count} messages of {name} cannot be read by this version"

    def _records(self, file: IO[bytes], part: PartStory) -> Iterator[tuple[int, McapRecord]]:
        reader = StreamReader(file, emit_chunks=True, record_size_limit=_LONGEST_RECORD_BYTES).records
        offset, finished = 0, False
        while not finished:
            try:
                record = next(reader)
            except (*DAMAGE, StopIteration) as error:
                if offset == 0 and not begins_as_recording(part.path):
                    raise FlightRecordError(f"{part.path}: not an MCAP recording") from error
                part.defects.append(f"{part.path.name} was not finished: what follows its last whole chunk is lost")
                return
            end = file.tell()
            yield offset, record
            offset, finished = end, isinstance(record, Footer)

    def _note(self, record: McapRecord, part: PartStory) -> None:
        if isinstance(record, Metadata):
            part.note_metadata(record.name, record.metadata)
            if record.name == layout.PROVENANCE:
                self.versions = record.metadata
        if isinstance(record, Attachment) and record.name == layout.SETTINGS_ATTACHMENT:
            self.settings = record.data

    def _chunk(
        self, chunk: Chunk, channels: dict[int, Channel], part: PartStory, offset: int
    ) -> Iterator[StoredMessage]:
        try:
            records = breakup_chunk(chunk, validate_crc=True)
        except DAMAGE:
            part.defects.append(f"{part.path.name} has a damaged chunk at byte {offset}")
            return
        part.note_chunk(chunk.message_start_time, chunk.message_end_time)
        for number, record in enumerate(records):
            if isinstance(record, Channel):
                _check_version(record, part.path)
                channels[record.id] = record
            elif isinstance(record, McapMessage) and record.channel_id in channels:
                channel = channels[record.channel_id]
                if channel.topic.endswith(f"/{layout.IMAGE}"):
                    self.pictures[record.publish_time] = PicturePlace(part.path, offset, number)
                else:
                    yield from self._message(channel, record)

    def _message(self, channel: Channel, record: McapMessage) -> Iterator[StoredMessage]:
        topic = topics.BY_NAME.get(channel.metadata.get(layout.TOPIC, ""))
        data = None if topic is None else _of_this_version(topic, channel, record.data)
        if topic is None or data is None:
            self._unreadable[channel.topic] += 1
            return
        yield StoredMessage(topic, channel.topic, record.publish_time, record.log_time, data, record.sequence)


def _check_version(channel: Channel, path: Path) -> None:
    try:
        recorded_as(channel.metadata.get(layout.WIRE_ENCODING, ""))
    except MigrationError as error:
        raise FlightRecordError(f"{path}: {error}") from None


def _of_this_version(topic: Topic[Any], channel: Channel, data: bytes) -> bytes | None:
    """The message's text as the present version writes it; None if it is no message of this topic."""
    recorded = recorded_as(channel.metadata.get(layout.WIRE_ENCODING, ""))
    if recorded is None or recorded[0] != topic.message.__name__:
        return None
    try:
        return migrated(*recorded, data)
    except ValueError:
        return None


def begins_as_recording(path: Path) -> bool:
    """Whether a file begins as an MCAP file does, as far as it goes: an empty one does."""
    with path.open("rb") as file:
        return MCAP0_MAGIC.startswith(file.read(len(MCAP0_MAGIC)))


def _parts(path: Path) -> list[tuple[int, Path]]:
    """The numbers and files of a recording that begins with `path`; a number that is missing was removed."""
    pattern = re.compile(rf"{re.escape(path.stem)}_(\d+)")
    beside = ((pattern.fullmatch(file.stem), file) for file in path.parent.glob(f"*{path.suffix}"))
    return sorted([(1, path), *((int(match[1]), file) for match, file in beside if match)])
