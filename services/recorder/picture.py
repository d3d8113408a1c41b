"""A frame as a compressed picture that MCAP viewers show (foxglove.CompressedImage in JSON)."""

from base64 import b64encode

import cv2

from alight.runtime.clock import NS_PER_S
from alight.runtime.node import Pixels
from schemas.frame import FrameHeader
from schemas.settings.recorder import RecorderSettings

_FASTEST_PNG = 1


class PictureError(Exception):
    """A frame that does not make a picture."""


class PictureEncoder:
    """Chooses the frames to keep and compresses them."""

    def __init__(self, settings: RecorderSettings) -> None:
        self._format = settings.frames
        self._rate_hz = settings.frame_rate_hz
        self._slot = -1
        quality = [cv2.IMWRITE_JPEG_QUALITY, settings.jpeg_quality]
        self._parameters = quality if settings.frames == "jpeg" else [cv2.IMWRITE_PNG_COMPRESSION, _FASTEST_PNG]

    def wants(self, header: FrameHeader) -> bool:
        """Whether this frame is kept: every one, or the first in each period of the rate limit."""
        if self._format == "none":
            return False
        if self._rate_hz == 0.0:
            return True
        slot = int(header.captured_at_ns * self._rate_hz / NS_PER_S)
        if slot == self._slot:
            return False
        self._slot = slot
        return True

    def encode(self, header: FrameHeader, pixels: Pixels) -> bytes:
        """The JSON text of the picture.

        Raises:
            PictureError: If the pixels are not a picture.
        """
        try:
            done, data = cv2.imencode(f".{self._format}", pixels, self._parameters)
        except cv2.error as error:
            raise PictureError(str(error)) from error
        if not done:
            raise PictureError(f"no {self._format} could be made of frame {header.sequence}")
        sec, nsec = divmod(header.captured_at_ns, NS_PER_S)
        start = f'{{"timestamp":{{"sec":{sec},"nsec":{nsec}}},"frame_id":"camera","format":"{self._format}","data":"'
        return start.encode() + b64encode(data.data) + b'"}'
