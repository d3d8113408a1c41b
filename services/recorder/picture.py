"""A frame as a picture that MCAP viewers show: foxglove.CompressedImage in JSON, or foxglove.RawImage."""

from base64 import b64encode

import cv2

from alight.runtime.clock import NS_PER_S
from alight.runtime.node import Pixels
from schemas.frame import FrameHeader
from schemas.settings.recorder import RecorderSettings
from services.recorder.raw_image import FRAME_ID, raw_image

_FASTEST_PNG = 1


class PictureError(Exception):
    """A frame that does not make a picture."""


class FrameChooser:
    """Chooses the frames to keep."""

    def __init__(self, settings: RecorderSettings) -> None:
        self._none = settings.frames == "none"
        self._rate_hz = settings.frame_rate_hz
        self._slot = -1

    def wants(self, header: FrameHeader) -> bool:
        """Whether this frame is kept: every one, or the first in each period of the rate limit."""
        if self._none:
            return False
        if self._rate_hz == 0.0:
            return True
        slot = int(header.captured_at_ns * self._rate_hz / NS_PER_S)
        if slot == self._slot:
            return False
        self._slot = slot
        return True


class PictureEncoder:
    """Makes pictures of frames."""

    def __init__(self, settings: RecorderSettings) -> None:
        self._format = settings.frames
        quality = [cv2.IMWRITE_JPEG_QUALITY, settings.jpeg_quality]
        self._parameters = quality if settings.frames == "jpeg" else [cv2.IMWRITE_PNG_COMPRESSION, _FASTEST_PNG]

    def encode(self, header: FrameHeader, pixels: Pixels) -> bytes:
        """The message: JSON text, or Protocol Buffers where the setting is `raw`.

        Raises:
            PictureError: If the pixels are not a picture.
        """
        try:
            if self._format == "raw":
                return raw_image(header, pixels)
            done, data = cv2.imencode(f".{self._format}", pixels, self._parameters)
        except (cv2.error, ValueError) as error:
            raise PictureError(str(error)) from error
        if not done:
            raise PictureError(f"no {self._format} could be made of frame {header.sequence}")
        sec, nsec = divmod(header.captured_at_ns, NS_PER_S)
        time = f'"timestamp":{{"sec":{sec},"nsec":{nsec}}}'
        return (
            f'{{{time},"frame_id":"{FRAME_ID}","format":"{self._format}","data":"'.encode()
            + b64encode(data.data)
            + b'"}'
        )
