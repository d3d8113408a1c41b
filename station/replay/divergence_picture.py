"""A frame with what was detected in it then and now."""

import base64
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from schemas import topics
from schemas.detection import Detection
from station.replay.recording import ReplayRecording
from station.replay.result import ReplayResult

RECORDED_BGR = (60, 220, 60)
REPLAYED_BGR = (220, 60, 220)
_BITS = 4
_SHOWN_WIDTH_PX = 960
_JPEG_QUALITY = 85


def divergence_picture(recording: ReplayRecording, result: ReplayResult, captured_at_ns: int) -> str | None:
    """The frame with both detections drawn, as base64 of a JPEG; None if its picture was not kept."""
    picture = recording.picture(captured_at_ns)
    if picture is None:
        return None
    scale = max(1.0, _SHOWN_WIDTH_PX / picture.shape[1])
    canvas = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST)
    canvas = cv2.cvtColor(canvas, cv2.COLOR_GRAY2BGR) if canvas.ndim == 2 else canvas
    then = recording.message(topics.DETECTION, captured_at_ns)
    now = next((o.message for o in result.of(topics.DETECTION.name) if o.message.stamp_ns == captured_at_ns), then)
    for detection, colour, width in ((then, RECORDED_BGR, 5), (now, REPLAYED_BGR, 1)):
        if isinstance(detection, Detection):
            _outline(np.asarray(canvas, np.uint8), detection, scale, colour, width)
    _, data = cv2.imencode(".jpg", canvas, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    return base64.b64encode(data.tobytes()).decode()


def _outline(canvas: NDArray[np.uint8], detection: Detection, scale: float, colour: Sequence[int], width: int) -> None:
    for marker in detection.markers:
        # A pixel's centre stays its centre when magnified.
        corners_px = (np.array(marker.corners_px) + 0.5) * scale - 0.5
        points = np.round(corners_px * 2**_BITS).astype(np.int32).reshape(-1, 1, 2)
        cv2.polylines(canvas, [points], True, tuple(colour), width, cv2.LINE_AA, _BITS)
