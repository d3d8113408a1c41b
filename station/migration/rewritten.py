"""A whole recording in the present version: for other programs, which know no steps."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from mcap.records import Attachment, Channel, Footer, Header, McapRecord, Metadata, Schema
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from schemas import topics
from schemas.message import SCHEMA_VERSION
from schemas.topics import Topic
from schemas.wire import encoding_of
from services.recorder import layout
from services.recorder.viewer_schema import viewer_schema
from station.mcap_parts import DAMAGE, begins_as_recording
from station.migration.chain import MigrationError, migrated, recorded_as
from station.out_folder import created

MIGRATED = "alight.migrated"
"""Name of the metadata record that says from which versions to which a recording was migrated."""


def rewritten(source: Path, target: Path) -> int:
    """Write `source` anew as `target`, every message as the present version writes it; all else is left as it is.

    Returns:
        How many messages there are.

    Raises:
        MigrationError: If the source is not there, cannot be read to its end, or is of an unknown version; then no target is left.
        FileExistsError: If the target exists.
        OSError: If the target cannot be written.
    """
    if not source.is_file():
        raise MigrationError(f"{source}: no such recording; give an .mcap file")
    with created(target, f"--out {target}") as file:
        try:
            return _Copy(file).take(_records(source))
        except DAMAGE as error:
            target.unlink()
            raise MigrationError(f"{source}: {_reason(error, source)}") from None


def _reason(error: Exception, source: Path) -> str:
    if isinstance(error, MigrationError):
        return str(error)
    if not begins_as_recording(source):
        return "not an MCAP recording"
    return "not finished, or damaged; `alight recording repair` first"


def _records(source: Path) -> Iterator[McapRecord]:
    with source.open("rb") as file:
        for record in StreamReader(file, validate_crcs=True).records:
            yield record
            if isinstance(record, Footer):
                return
    raise EOFError("it was not finished")


class _Copy:
    def __init__(self, file: IO[Any]) -> None:
        self._writer: Any = Writer(file)
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, tuple[int, Topic[Any] | None, int]] = {}
        self._versions: set[int] = set()
        self._messages = 0

    def take(self, records: Iterator[McapRecord]) -> int:
        """Copy all records; the number of messages."""
        for record in records:
            if isinstance(record, Header):
                self._writer.start(profile=record.profile, library=record.library)
            elif isinstance(record, Schema):
                self._schemas[record.id] = record
            elif isinstance(record, Channel) and record.id not in self._channels:
                self._channels[record.id] = self._channel(record)
            elif isinstance(record, McapMessage):
                self._message(record)
            elif isinstance(record, Metadata):
                self._writer.add_metadata(record.name, record.metadata)
            elif isinstance(record, Attachment):
                self._writer.add_attachment(
                    record.create_time, record.log_time, record.name, record.media_type, record.data
                )
        came_from = ",".join(str(version) for version in sorted(self._versions))
        self._writer.add_metadata(MIGRATED, {"from": came_from, "to": str(SCHEMA_VERSION)})
        self._writer.finish()
        return self._messages

    def _channel(self, channel: Channel) -> tuple[int, Topic[Any] | None, int]:
        """Its new id, the topic if it is one that may have changed, and the version that it was recorded with."""
        recorded = recorded_as(channel.metadata.get(layout.WIRE_ENCODING, ""))
        topic = topics.BY_NAME.get(channel.metadata.get(layout.TOPIC, ""))
        about, schema = dict(channel.metadata), self._schemas.get(channel.schema_id)
        if schema is None:
            raise MigrationError(f"{channel.topic} has no schema: this is no recording of Alight")
        name, text = schema.name, schema.data
        if recorded is None or topic is None or recorded[0] != topic.message.__name__:
            topic, version = None, SCHEMA_VERSION
        else:
            version = recorded[1]
            about[layout.WIRE_ENCODING] = encoding_of(topic)
            text = json.dumps(viewer_schema(topic.message)).encode()
            self._versions.add(version)
        made = self._writer.register_schema(name, schema.encoding, text)
        return self._writer.register_channel(channel.topic, channel.message_encoding, made, about), topic, version

    def _message(self, message: McapMessage) -> None:
        channel, topic, version = self._channels[message.channel_id]
        data = message.data if topic is None else migrated(topic.message.__name__, version, message.data)
        self._writer.add_message(channel, message.log_time, data, message.publish_time, message.sequence)
        self._messages += 1
