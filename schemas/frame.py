"""The header of one camera frame. The pixels travel beside it as raw bytes."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from schemas.message import ShortText, Traced

MAX_SIDE_PX = 8192


class PixelFormat(StrEnum):
    """How the raw bytes beside a header are laid out, row by row, without padding."""

    MONO8 = "mono8"
    """One byte a pixel, grey."""
    BGR8 = "bgr8"
    """Three bytes a pixel: blue, green, red."""

    @property
    def bytes_per_pixel(self) -> int:
        """Bytes that one pixel takes."""
        return 1 if self is PixelFormat.MONO8 else 3


class FrameHeader(Traced):
    """One camera frame; `captured_at_ns` is the middle of its exposure, with a rolling shutter that of its middle row."""

    sequence: Annotated[int, Field(ge=0)]
    """Counts the frames of this camera since its process started."""
    width_px: Annotated[int, Field(gt=0, le=MAX_SIDE_PX)]
    """Pixels in a row."""
    height_px: Annotated[int, Field(gt=0, le=MAX_SIDE_PX)]
    """Rows."""
    pixel_format: PixelFormat = PixelFormat.MONO8
    """Layout of the raw bytes."""
    exposure_s: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    """Exposure time, seconds; 0 where unknown."""
    source: ShortText
    """Where the frame comes from: `simulated`, a file name, a device."""

    @property
    def payload_bytes(self) -> int:
        """How many raw bytes belong to this header."""
        return self.width_px * self.height_px * self.pixel_format.bytes_per_pixel
