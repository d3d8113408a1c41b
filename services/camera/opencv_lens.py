"""Cameras through OpenCV: V4L2 devices, and streams through FFmpeg or GStreamer."""

import math
import os

import cv2
import numpy as np

from alight.runtime.port import PortError
from schemas.settings.camera import CameraSettings
from services.camera.grabber import LensError
from services.camera.live_packet import Picture

_STREAMS = ("rtsp://", "rtsps://", "udp://", "tcp://", "http://", "https://", "srt://")
_MANUAL, _AUTOMATIC = 1.0, 3.0
"""V4L2's values of `exposure_auto`."""
_LITTLE_DELAY = "fflags;nobuffer|flags;low_delay"
"""FFmpeg's own buffering is seconds long otherwise."""


def checked(camera: CameraSettings) -> None:
    """Look whether the settings can work at all, before a thread tries for ever.

    Raises:
        PortError: In one line with key and remedy.
    """
    live = camera.live
    if camera.source != "stream":
        return
    if live.via == "gstreamer":
        if not cv2.videoio_registry.hasBackend(cv2.CAP_GSTREAMER):
            raise PortError(
                "camera.live.via = gstreamer: this OpenCV was built without it; install your distribution's python3-opencv, "
                "or take camera.live.via = ffmpeg with a URL"
            )
    elif not live.url.startswith(_STREAMS):
        raise PortError(
            f"camera.live.url = {live.url!r}: not an address; camera.source = stream needs one that begins with {', '.join(_STREAMS)}"
        )


class OpenCvLens:
    """One opened camera."""

    def __init__(self, camera: CameraSettings, width_px: int, height_px: int) -> None:
        """Open it.

        Args:
            camera: Source, rate and section `live`.
            width_px: Width to ask of a device, pixels.
            height_px: Height to ask of it, pixels.

        Raises:
            LensError: If it cannot be opened.
        """
        self.name = name_of(camera)
        self._video = (
            _opened_device(camera, width_px, height_px) if camera.source == "device" else _opened_stream(camera)
        )
        if not self._video.isOpened():
            self._video.release()
            raise LensError(f"{self.name} cannot be opened: is it there, and does no other program hold it?")

    def read(self) -> tuple[Picture, float]:
        """See `Lens.read`."""
        there, picture = self._video.read()
        if not there or picture is None:
            raise LensError(f"{self.name} gives no more pictures")
        return np.asarray(picture, np.uint8), float(self._video.get(cv2.CAP_PROP_POS_MSEC))

    def close(self) -> None:
        """See `Lens.close`."""
        self._video.release()


def name_of(camera: CameraSettings) -> str:
    """Device or address, without a password that the address may hold."""
    if camera.source == "device":
        return camera.live.device
    scheme, _, rest = camera.live.url.partition("://")
    return f"{scheme}://{rest.rsplit('@', 1)[-1]}" if rest else "pipeline"


def _opened_device(camera: CameraSettings, width_px: int, height_px: int) -> cv2.VideoCapture:
    live = camera.live
    # OpenCV's own limit is 10 s; it is read once, when the first device is opened.
    os.environ.setdefault("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", str(math.ceil(live.silent_s)))
    target = int(live.device) if live.device.isdigit() else live.device
    video = cv2.VideoCapture(target, cv2.CAP_V4L2)
    if live.pixel_format:
        video.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*live.pixel_format))
    video.set(cv2.CAP_PROP_FRAME_WIDTH, width_px)
    video.set(cv2.CAP_PROP_FRAME_HEIGHT, height_px)
    video.set(cv2.CAP_PROP_FPS, camera.rate_hz)
    video.set(cv2.CAP_PROP_BUFFERSIZE, 1)
    video.set(cv2.CAP_PROP_AUTO_EXPOSURE, _AUTOMATIC if live.exposure_ms is None else _MANUAL)
    if live.exposure_ms is not None:
        video.set(cv2.CAP_PROP_EXPOSURE, live.exposure_ms * 10.0)  # V4L2 counts in 0.1 ms
    return video


def _opened_stream(camera: CameraSettings) -> cv2.VideoCapture:
    if camera.live.via == "gstreamer":
        return cv2.VideoCapture(camera.live.url, cv2.CAP_GSTREAMER)
    os.environ.setdefault("OPENCV_FFMPEG_CAPTURE_OPTIONS", _LITTLE_DELAY)
    silent_ms = round(1e3 * camera.live.silent_s)
    limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, silent_ms, cv2.CAP_PROP_READ_TIMEOUT_MSEC, silent_ms]
    return cv2.VideoCapture(camera.live.url, cv2.CAP_FFMPEG, limits)
