"""How a message becomes bytes and back.

A message is pydantic JSON in the payload. A frame's payload is its raw pixels, the JSON header is the attachment.
The encoding names the message and the version of the schemas, so a reader knows what it cannot read before it tries.
"""

from enum import StrEnum
from functools import cache
from typing import Any, NamedTuple, TypeVar

from pydantic import ValidationError

from schemas.frame import FrameHeader
from schemas.message import SCHEMA_VERSION, Message
from schemas.topics import Topic

M = TypeVar("M", bound=Message)

MAX_JSON_BYTES = 256 * 1024
"""No message of ours comes near this; what is longer is refused before it is parsed."""


class Refusal(StrEnum):
    """Why input was refused; the keys of `InputHealth.refused`."""

    WRONG_VERSION = "wrong_version"
    WRONG_TYPE = "wrong_type"
    MALFORMED = "malformed"
    OVERSIZED = "oversized"
    WRONG_PIXEL_COUNT = "wrong_pixel_count"
    OUT_OF_ORDER = "out_of_order"
    TOO_OLD = "too_old"
    FROM_THE_FUTURE = "from_the_future"


class RefusedError(Exception):
    """A message that may not come in."""

    def __init__(self, refusal: Refusal, detail: str) -> None:
        super().__init__(f"{refusal}: {detail}")
        self.refusal = refusal
        self.detail = detail


class WireMessage(NamedTuple):
    """What Zenoh carries for one message."""

    payload: bytes
    attachment: bytes | None
    encoding: str


@cache
def encoding_of(topic: Topic[Any]) -> str:
    """The Zenoh encoding of a topic's messages, such as `application/json;alight.PadFix.v3`."""
    kind = "application/octet-stream" if topic.has_pixels else "application/json"
    return f"{kind};alight.{topic.message.__name__}.v{SCHEMA_VERSION}"


def encode(topic: Topic[M], message: M, pixels: bytes | None = None) -> WireMessage:
    """Bring a message into the form that travels.

    Raises:
        ValueError: If pixels are missing on a topic that has them, or given on one that has none.
    """
    if topic.has_pixels != (pixels is not None):
        raise ValueError(f"topic {topic.name} {'needs' if topic.has_pixels else 'has no'} pixels")
    header = message.__pydantic_serializer__.to_json(message)
    if pixels is None:
        return WireMessage(header, None, encoding_of(topic))
    return WireMessage(pixels, header, encoding_of(topic))


def decode(topic: Topic[M], payload: bytes, attachment: bytes | None, encoding: str) -> M:
    """Read one message of a topic; for a frame the header, whose `payload_bytes` the payload matches.

    Raises:
        RefusedError: With the reason, for anything that is not a valid message of this topic and version.
    """
    _check_encoding(topic, encoding)
    text = attachment if topic.has_pixels else payload
    if text is None:
        raise RefusedError(Refusal.MALFORMED, "no header beside the pixels")
    if len(text) > MAX_JSON_BYTES:
        raise RefusedError(Refusal.OVERSIZED, f"{len(text)} bytes, at most {MAX_JSON_BYTES}")
    try:
        message: M = topic.message.__pydantic_validator__.validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"]) or "message"
        raise RefusedError(Refusal.MALFORMED, f"{where}: {first['msg']}") from None
    if isinstance(message, FrameHeader) and message.payload_bytes != len(payload):
        detail = f"{len(payload)} bytes, the header says {message.payload_bytes}"
        raise RefusedError(Refusal.WRONG_PIXEL_COUNT, detail)
    return message


def _check_encoding(topic: Topic[Any], encoding: str) -> None:
    expected = encoding_of(topic)
    if encoding == expected:
        return
    stem = expected.rsplit(".v", 1)[0]
    if encoding.startswith(f"{stem}.v"):
        raise RefusedError(Refusal.WRONG_VERSION, f"got {encoding[:100]}, this process speaks {expected}")
    raise RefusedError(Refusal.WRONG_TYPE, f"got {encoding[:100]}, expected {expected}")
