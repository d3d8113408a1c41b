"""What passes from the thread that reads a camera to the node: a picture with its stamp, or words about what is wrong."""

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]

_HEAD = struct.Struct("<Bq?HHB")
_PICTURE, _TROUBLE = 0, 1


@dataclass(frozen=True)
class LivePicture:
    """A picture as the camera gave it."""

    stamped_at_ns: int
    """Its stamp, UTC ns; later than the middle of the exposure by the source's delay."""
    by_driver: bool
    """Whether the driver stamped it; otherwise the moment of reading did."""
    pixels: Picture
    """(height, width) grey or (height, width, 3) blue, green, red."""


@dataclass(frozen=True)
class Trouble:
    """The camera gives no pictures."""

    text: str
    """Why, for people."""


def packed(what: LivePicture | Trouble) -> bytes:
    """The bytes."""
    if isinstance(what, Trouble):
        return _HEAD.pack(_TROUBLE, 0, False, 0, 0, 0) + what.text.encode()
    height, width = what.pixels.shape[:2]
    channels = 1 if what.pixels.ndim == 2 else what.pixels.shape[2]
    head = _HEAD.pack(_PICTURE, what.stamped_at_ns, what.by_driver, height, width, channels)
    return head + np.ascontiguousarray(what.pixels).tobytes()


def unpacked(data: bytes) -> LivePicture | Trouble:
    """What was packed.

    Raises:
        ValueError: If the bytes are not what `packed` made.
    """
    if len(data) < _HEAD.size:
        raise ValueError(f"{len(data)} bytes, a head alone has {_HEAD.size}")
    kind, stamped_at_ns, by_driver, height, width, channels = _HEAD.unpack_from(data)
    if kind == _TROUBLE:
        return Trouble(data[_HEAD.size :].decode(errors="replace"))
    pixels = np.frombuffer(data, np.uint8, offset=_HEAD.size)
    if kind != _PICTURE or channels not in (1, 3) or pixels.size != height * width * channels:
        raise ValueError(f"{pixels.size} bytes of pixels, the head says {height}x{width}x{channels}")
    return LivePicture(
        stamped_at_ns, by_driver, pixels.reshape((height, width, 3) if channels == 3 else (height, width))
    )
