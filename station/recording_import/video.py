"""The frames of a video as the camera service would have published them."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from alight.runtime.clock import NS_PER_S, nanoseconds
from alight.runtime.node import Pixels
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.frame import FrameHeader, PixelFormat
from schemas.message import Hop
from services.camera.files import FilesError, listed_files, pictures_in
from station.recording_import.heard import Heard
from station.recording_import.source_error import SourceError

BUS_HOP_NS = 500_000
"""From the camera to whoever hears it."""


@dataclass(frozen=True)
class Film:
    """A video and what must be known of it."""

    paths: tuple[str, ...]
    """Videos, or pictures and folders of them; one after the other."""
    stamps_ns: Iterable[int]
    """Middle of each frame's exposure, UTC ns. The shorter of pictures and stamps ends the import."""
    calibration: CameraCalibration
    """Of the camera that took them."""
    latency_s: float
    """From exposure until a frame leaves the camera, seconds."""
    mirrored: bool = False
    """Flip left to right."""


def camera_heard(film: Film) -> Iterator[Heard]:
    """Frames with their pixels, and once a second the calibration, in order of arrival.

    Raises:
        SourceError: If a picture cannot be decoded, or is of another size than the calibration.
    """
    calibration_due_ns = 0
    for number, (pixels, source, captured_at_ns) in enumerate(_stamped(film)):
        _check_size(pixels, film.calibration, source)
        out_ns = captured_at_ns + nanoseconds(film.latency_s)
        if out_ns >= calibration_due_ns:
            calibration_due_ns = out_ns + NS_PER_S
            yield Heard(out_ns, topics.CALIBRATION, film.calibration.model_copy(update={"at_ns": out_ns}))
        yield Heard(out_ns + BUS_HOP_NS, topics.FRAME, _header(pixels, source, captured_at_ns, out_ns, number), pixels)


def rate_of(path: str) -> float:
    """Frames a second as the video's own head says.

    Raises:
        SourceError: If it does not.
    """
    video = cv2.VideoCapture(path)
    fps = float(video.get(cv2.CAP_PROP_FPS)) if video.isOpened() else 0.0
    video.release()
    if not 0.1 <= fps <= 1000.0:
        raise SourceError(f"{path}: does not say how many frames a second it has: give --fps or --stamps")
    return fps


def _stamped(film: Film) -> Iterator[tuple[Pixels, str, int]]:
    try:
        files = listed_files(film.paths)
    except FilesError as error:
        raise SourceError(f"--video {error}") from None
    pictures = (picture for file in files for picture in _decoded(file, film.mirrored))
    # Stamps first: zip must not take a picture for which there is no stamp.
    for captured_at_ns, (pixels, source) in zip(film.stamps_ns, pictures, strict=False):
        yield pixels, source, captured_at_ns


def _decoded(file: Path, mirrored: bool) -> Iterator[tuple[Pixels, str]]:
    for picture in pictures_in(file, mirrored=mirrored):
        if picture is None:
            raise SourceError(f"{file}: cannot be decoded: convert it, for example to H.264 in .mp4 or to pictures")
        yield picture.pixels, picture.name[:500]


def _check_size(pixels: Pixels, calibration: CameraCalibration, source: str) -> None:
    height_px, width_px = pixels.shape[:2]
    if (width_px, height_px) != (calibration.width_px, calibration.height_px):
        raise SourceError(
            f"{source} is {width_px}x{height_px} pixels, the calibration is for {calibration.width_px}x{calibration.height_px}: "
            "give the calibration of this camera at this size with --calibration FILE"
        )


def _header(pixels: Pixels, source: str, captured_at_ns: int, out_ns: int, number: int) -> FrameHeader:
    hop = Hop(service="camera", received_at_ns=captured_at_ns, handled_at_ns=captured_at_ns, published_at_ns=out_ns)
    colour = np.ndim(pixels) == 3
    return FrameHeader(
        captured_at_ns=captured_at_ns,
        hops=(hop,),
        sequence=number,
        width_px=pixels.shape[1],
        height_px=pixels.shape[0],
        pixel_format=PixelFormat.BGR8 if colour else PixelFormat.MONO8,
        source=source,
    )
