"""The recorder's edge to the disk: one MCAP file, chunked and indexed."""

import json
from pathlib import Path
from typing import IO, Any, cast

from mcap.writer import CompressionType, Writer

from schemas import topics
from schemas.frame import FrameHeader
from schemas.message import Message
from schemas.settings import Settings
from schemas.topics import Topic
from schemas.wire import encoding_of
from services.recorder import layout
from services.recorder.provenance import provenance, recorded_settings
from services.recorder.viewer_schema import COMPRESSED_IMAGE, viewer_schema
from services.recorder.whole_writes import WholeWrites

_COMPRESSION = {"zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4, "none": CompressionType.NONE}
_MAX_PARTS = 1000


class FlightFileError(ValueError):
    """A recording that cannot be begun: one line with the path, the key and the remedy."""


class FlightFile:
    """Writes messages into an MCAP file. After it is open nothing raises: what fails is counted in `lost`.

    The file depends on nothing but the settings and what is added, in that order: no clock, no process id.
    """

    def __init__(self, settings: Settings) -> None:
        """Create the file and write its head.

        Raises:
            FlightFileError: If the file cannot be created.
        """
        self.path, self._disk = _create(settings.recorder.directory / settings.recorder.file_name)
        self.written = 0
        self.lost = 0
        self._writer: Any = Writer(
            cast(IO[Any], self._disk),
            chunk_size=settings.recorder.chunk_bytes,
            compression=_COMPRESSION[settings.recorder.compression],
        )
        self._writer.start(profile="", library="alight")
        self._writer.add_metadata(layout.PROVENANCE, provenance(settings))
        self._writer.add_attachment(0, 0, layout.SETTINGS_ATTACHMENT, "application/json", recorded_settings(settings))
        self._channels: dict[str, int] = {}
        for topic in topics.read_by("recorder"):
            self._register(topic, settings.vehicle)
        self._sequences = dict.fromkeys(self._channels.values(), 0)

    @property
    def failure(self) -> str | None:
        """Why nothing more is recorded, if so."""
        error = self._disk.failure
        return None if error is None else (error.strerror or str(error))

    def add(self, topic: Topic[Any], message: Message, now_ns: int) -> None:
        """Write one message. Fields without a value are left out: absent means None."""
        name = f"{topic.name}/{getattr(message, 'service', '')}" if topic.per_service else topic.name
        data = message.__pydantic_serializer__.to_json(message, exclude_none=True)
        self._add(name, data, now_ns, message.stamp_ns)

    def add_picture(self, topic: Topic[Any], header: FrameHeader, data: bytes, now_ns: int) -> None:
        """Write a frame's picture, as JSON text of a foxglove.CompressedImage."""
        self._add(f"{topic.name}/{layout.IMAGE}", data, now_ns, header.captured_at_ns)

    def flush(self) -> None:
        """Close the chunk and hand it to the operating system, so that a crash of this process cannot lose it."""
        if self._disk.failure is None:
            self._writer.flush()

    def finish(self) -> None:
        """Write the index and close; after a failure just close: what is there can be read without an index."""
        if self._disk.failure is None:
            self._writer.finish()
        self._disk.close()

    def _add(self, name: str, data: bytes, now_ns: int, stamp_ns: int) -> None:
        channel = self._channels.get(name)
        if channel is None or self._disk.failure is not None:
            self.lost += 1
            return
        self._writer.add_message(channel, now_ns, data, stamp_ns, self._sequences[channel])
        self._sequences[channel] += 1
        self.written += 1

    def _register(self, topic: Topic[Any], vehicle: str) -> None:
        about = {layout.TOPIC: topic.name, layout.WIRE_ENCODING: encoding_of(topic), "delivery": topic.delivery.value}
        schema = self._schema(f"alight.{topic.message.__name__}", viewer_schema(topic.message))
        for tail in [f"/{service}" for service in sorted(topic.publishers)] if topic.per_service else [""]:
            self._channel(f"{topic.name}{tail}", vehicle, schema, about)
        if topic.has_pixels:
            image = self._schema("foxglove.CompressedImage", COMPRESSED_IMAGE)
            self._channel(f"{topic.name}/{layout.IMAGE}", vehicle, image, {})

    def _schema(self, name: str, schema: dict[str, Any]) -> int:
        return int(self._writer.register_schema(name, "jsonschema", json.dumps(schema).encode()))

    def _channel(self, name: str, vehicle: str, schema: int, about: dict[str, str]) -> None:
        self._channels[name] = self._writer.register_channel(f"alight/{vehicle}/{name}", "json", schema, about)


def _create(path: Path) -> tuple[Path, WholeWrites]:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        for number in range(1, _MAX_PARTS + 1):
            try:
                return layout.part(path, number), WholeWrites(layout.part(path, number))
            except FileExistsError:
                continue
    except OSError as error:
        raise FlightFileError(
            f"recorder.directory: {path} cannot be written ({error.strerror or error}): "
            "choose another folder with --set recorder.directory=DIR"
        ) from error
    raise FlightFileError(
        f"recorder.directory: {path.parent} holds {_MAX_PARTS} recordings already: "
        "choose another folder with --set recorder.directory=DIR"
    )
