"""The few forms of Protocol Buffers' wire format that a picture needs (https://protobuf.dev/programming-guides/encoding)."""

from collections.abc import Iterator

VARINT, FIXED64, LENGTH, FIXED32 = 0, 1, 2, 5
_PAYLOAD_BITS = 7
_MORE = 0x80


class ProtobufError(ValueError):
    """Bytes that are no message."""


def varint(value: int) -> bytes:
    """A number of variable length, least significant seven bits first."""
    encoded = bytearray()
    while value >= _MORE:
        encoded.append(value & (_MORE - 1) | _MORE)
        value >>= _PAYLOAD_BITS
    encoded.append(value)
    return bytes(encoded)


def tag(number: int, kind: int) -> bytes:
    """What stands before a field."""
    return varint(number << 3 | kind)


def number_field(number: int, value: int) -> bytes:
    """A field with a number of variable length."""
    return tag(number, VARINT) + varint(value)


def fixed32_field(number: int, value: int) -> bytes:
    """A field with a number of four bytes."""
    return tag(number, FIXED32) + value.to_bytes(4, "little")


def bytes_field(number: int, value: bytes) -> bytes:
    """A field with text in UTF-8, bytes or a message."""
    return tag(number, LENGTH) + varint(len(value)) + value


def fields(data: memoryview) -> Iterator[tuple[int, int | memoryview]]:
    """The numbers and values of a message's fields.

    Raises:
        ProtobufError: If it ends in the middle of a field or has a form that is not known here.
    """
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        number, kind = key >> 3, key & 0b111
        if kind == VARINT:
            value, at = _varint(data, at)
            yield number, value
            continue
        if kind == LENGTH:
            length, at = _varint(data, at)
        else:
            length = {FIXED32: 4, FIXED64: 8}.get(kind, -1)
        if length < 0 or at + length > len(data):
            raise ProtobufError(f"field {number} of kind {kind} at byte {at} is not whole")
        piece = data[at : at + length]
        yield number, piece if kind == LENGTH else int.from_bytes(piece, "little")
        at += length


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    value = shift = 0
    while at < len(data):
        value |= (data[at] & (_MORE - 1)) << shift
        at += 1
        if data[at - 1] < _MORE:
            return value, at
        shift += _PAYLOAD_BITS
    raise ProtobufError("ends in the middle of a number")
