"""A camera that is there: stamps what its reading thread delivers, and says what is wrong with it."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.runtime.clock import nanoseconds, seconds
from alight.runtime.node import Outputs
from schemas.calibration import CameraCalibration
from schemas.settings.live_camera import LiveCamera
from services.camera.live_packet import LivePicture, Trouble, unpacked
from services.camera.node import CameraNode

Picture = NDArray[np.uint8]

PORT = "lens"
_TURNS: dict[int, Callable[[Picture], Picture]] = {
    0: lambda pixels: pixels,
    90: lambda pixels: np.asarray(cv2.rotate(pixels, cv2.ROTATE_90_CLOCKWISE), np.uint8),
    180: lambda pixels: np.asarray(cv2.rotate(pixels, cv2.ROTATE_180), np.uint8),
    270: lambda pixels: np.asarray(cv2.rotate(pixels, cv2.ROTATE_90_COUNTERCLOCKWISE), np.uint8),
}


class LiveCameraNode(CameraNode):
    """Publishes each picture when it comes. Without pictures it publishes none and complains: the landing holds."""

    ports = (PORT,)

    def __init__(self, settings: LiveCamera, calibration: CameraCalibration, name: str) -> None:
        """Take the camera in.

        Args:
            settings: How its pictures lie and how late their stamps are.
            calibration: The camera's.
            name: Device or address, for messages.
        """
        super().__init__(calibration)
        self._settings = settings
        self._delay_ns = nanoseconds(settings.delay_s)
        self._name = name[:500]
        self._newest_ns = -1
        self._last_at_ns: int | None = None
        self._trouble = ""
        self._wrong_size = ""
        self._counts = {"stamped_by_driver": 0, "not_later": 0, "troubles": 0}

    def on_bytes(self, port: str, data: bytes, now_ns: int) -> Outputs:  # noqa: ARG002
        """A picture, or words about why there is none."""
        what = unpacked(data)
        if isinstance(what, Trouble):
            self._trouble = what.text
            self._counts["troubles"] += 1
            return []
        self._trouble, self._last_at_ns = "", now_ns
        captured_at_ns = what.stamped_at_ns - self._delay_ns
        if captured_at_ns <= self._newest_ns:
            self._counts["not_later"] += 1
            return []
        self._newest_ns = captured_at_ns
        self._counts["stamped_by_driver"] += what.by_driver
        return [self._frame(self._upright(what), captured_at_ns, self._name)]

    def counters(self) -> dict[str, int]:
        """Frames, those that the driver stamped, those no later than the one before, and how often there was trouble."""
        return {**super().counters(), **self._counts}

    def complaints(self, now_ns: int) -> tuple[str, ...]:
        """No camera, a silent one, or a calibration for another size."""
        silent = ""
        if not self._trouble and self._last_at_ns is not None:
            silent_s = seconds(now_ns - self._last_at_ns)
            silent = f"{self._name} has been silent for {silent_s:.1f} s" if silent_s > self._settings.silent_s else ""
        return tuple(text[:500] for text in (self._trouble, silent, self._wrong_size) if text)

    def _upright(self, picture: LivePicture) -> Picture:
        flipped = np.asarray(cv2.flip(picture.pixels, 1), np.uint8) if self._settings.mirrored else picture.pixels
        pixels = _TURNS[self._settings.rotated_deg](flipped)
        height, width = pixels.shape[:2]
        believed = (self._calibration.width_px, self._calibration.height_px)
        self._wrong_size = (
            ""
            if (width, height) == believed
            else f"{self._name} gives {width}x{height}, the calibration is for {believed[0]}x{believed[1]}: calibrate at that size"
        )
        return pixels
