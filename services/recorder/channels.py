"""The channels of a recording: every topic that the recorder may read, and the pictures beside the frames."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from schemas import topics
from schemas.message import Message
from schemas.settings import Settings
from schemas.topics import Topic
from schemas.wire import encoding_of
from services.recorder import layout, raw_image
from services.recorder.viewer_schema import COMPRESSED_IMAGE, viewer_schema


@dataclass(frozen=True)
class RecordedSchema:
    """What messages look like, as the file says it."""

    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True)
class RecordedChannel:
    """One channel."""

    name: str
    """Below `alight/<vehicle>/`."""
    key: str
    """All of it: the key that the messages were published with."""
    message_encoding: str
    schema: RecordedSchema
    metadata: dict[str, str]


def channels(settings: Settings) -> Iterator[RecordedChannel]:
    """All channels of a recording, in the order of the table of topics."""
    for topic in topics.read_by("recorder"):
        yield from _of_messages(topic, settings.vehicle)
        if topic.has_pixels and settings.recorder.frames != "none":
            yield _of_pictures(topic, settings)


def channel_name(topic: Topic[Any], message: Message) -> str:
    """Where a message belongs."""
    return f"{topic.name}/{getattr(message, 'service', '')}" if topic.per_service else topic.name


def picture_channel_name(topic: Topic[Any]) -> str:
    """Where a frame's picture belongs."""
    return f"{topic.name}/{layout.IMAGE}"


def _of_messages(topic: Topic[Any], vehicle: str) -> Iterator[RecordedChannel]:
    about = {layout.TOPIC: topic.name, layout.WIRE_ENCODING: encoding_of(topic), "delivery": topic.delivery.value}
    text = json.dumps(viewer_schema(topic.message)).encode()
    schema = RecordedSchema(f"alight.{topic.message.__name__}", "jsonschema", text)
    for tail in [f"/{service}" for service in sorted(topic.publishers)] if topic.per_service else [""]:
        name = f"{topic.name}{tail}"
        yield RecordedChannel(name, f"alight/{vehicle}/{name}", "json", schema, about)


def _of_pictures(topic: Topic[Any], settings: Settings) -> RecordedChannel:
    name = picture_channel_name(topic)
    key = f"alight/{settings.vehicle}/{name}"
    if settings.recorder.frames == "raw":
        raw = RecordedSchema(raw_image.TYPE_NAME, "protobuf", raw_image.descriptor_set())
        return RecordedChannel(name, key, "protobuf", raw, {})
    text = json.dumps(COMPRESSED_IMAGE).encode()
    return RecordedChannel(name, key, "json", RecordedSchema("foxglove.CompressedImage", "jsonschema", text), {})
