"""What the camera saw at some moments, with the detection drawn in."""

import base64
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.runtime.node import Pixels
from schemas import topics
from schemas.detection import Detection, Marker
from station.flight_record import FlightRecord
from station.metrics.summary import FlightSummary, pad_marker
from station.report.flight_path import FlightPaths, since_s

_OUTLINE_BGR = (60, 220, 60)
_LABEL_BGR = (255, 255, 255)
_SHADOW_BGR = (0, 0, 0)
_SMALL_PX = 70.0
_LENS_SOURCE_PX = 48
_LENS_SHOWN_PX = 192
_JPEG_QUALITY = 82


@dataclass(frozen=True)
class Moment:
    """One picture of the report."""

    jpeg_base64: str
    caption: str


def moments(record: FlightRecord, summary: FlightSummary, paths: FlightPaths, count: int = 5) -> list[Moment]:
    """Choose moments evenly in height between the first and the last sight of the pad, and draw them."""
    kept = set(record.picture_times_ns)
    pad = pad_marker(record)
    seen = [d for d in record.messages(topics.DETECTION) if d.captured_at_ns in kept and pad.among(d) is not None]
    if summary.landing is not None:
        seen = [d for d in seen if summary.landing.looking_since_ns <= d.captured_at_ns <= summary.landing.ended_at_ns]
    drawn = []
    for detection in _evenly_in_height(seen, paths, count):
        picture, marker = record.picture(detection.captured_at_ns), pad.among(detection)
        if picture is not None and marker is not None:
            caption = _caption(detection, marker, paths)
            drawn.append(Moment(_jpeg(_annotated(picture, detection, marker)), caption))
    return drawn


def _evenly_in_height(seen: list[Detection], paths: FlightPaths, count: int) -> list[Detection]:
    if len(seen) <= count:
        return seen
    heights_m = np.array([_height_m(detection, paths) for detection in seen])
    wanted_m = np.linspace(heights_m[0], heights_m[-1], count)
    chosen = [0, *(int(np.argmin(np.abs(heights_m - height_m))) for height_m in wanted_m[1:-1]), len(seen) - 1]
    return [seen[index] for index in dict.fromkeys(sorted(chosen))]


def _height_m(detection: Detection, paths: FlightPaths) -> float:
    path = paths.true or paths.navigated
    if not path:
        return -since_s(detection.captured_at_ns, paths.origin_ns)
    return float(np.interp(since_s(detection.captured_at_ns, paths.origin_ns), path.t_s, path.height_m))


def _caption(detection: Detection, marker: Marker, paths: FlightPaths) -> str:
    side_px = _side_px(np.array(marker.corners_px))
    height = f"{_height_m(detection, paths):.1f} m up" if paths.true or paths.navigated else "height unknown"
    return f"{since_s(detection.captured_at_ns, paths.origin_ns):+.1f} s, {height}, marker {side_px:.0f} px wide"


def _annotated(picture: Pixels, detection: Detection, pad: Marker) -> Pixels:
    canvas = _coloured(picture)
    for marker in detection.markers:
        _outline(canvas, np.array(marker.corners_px), 1.0)
    corners_px = np.array(pad.corners_px)
    if _side_px(corners_px) < _SMALL_PX:
        _put_lens(canvas, picture, corners_px)
    _label(canvas, f"{pad.family} id {pad.id}", corners_px)
    return canvas


def _coloured(picture: Pixels) -> NDArray[np.uint8]:
    coloured = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture.copy()
    return np.asarray(coloured, np.uint8)


def _outline(canvas: NDArray[np.uint8], corners_px: NDArray[np.float64], scale: float) -> None:
    thickness = 2 if _side_px(corners_px) * scale > 30 else 1
    points = np.round(corners_px * scale * 8).astype(np.int32).reshape(-1, 1, 2)
    cv2.polylines(canvas, [points], True, _OUTLINE_BGR, thickness, cv2.LINE_AA, shift=3)
    first = (int(points[0, 0, 0]), int(points[0, 0, 1]))
    cv2.circle(canvas, first, 8 * (thickness + 1), (40, 60, 240), -1, cv2.LINE_AA, shift=3)


def _put_lens(canvas: NDArray[np.uint8], picture: Pixels, corners_px: NDArray[np.float64]) -> None:
    """A magnified cut-out in the corner farthest from the pad."""
    height_px, width_px = picture.shape[:2]
    half = max(_LENS_SOURCE_PX // 2, int(_side_px(corners_px)))
    centre = corners_px.mean(axis=0)
    left = int(np.clip(round(centre[0]) - half, 0, max(0, width_px - 2 * half)))
    top = int(np.clip(round(centre[1]) - half, 0, max(0, height_px - 2 * half)))
    cut = picture[top : top + 2 * half, left : left + 2 * half]
    shown = min(_LENS_SHOWN_PX, height_px // 2, width_px // 2)
    lens = _coloured(np.asarray(cv2.resize(cut, (shown, shown), interpolation=cv2.INTER_NEAREST), np.uint8))
    scale = shown / cut.shape[1]
    _outline(lens, corners_px - (left, top) + (0.5 - 0.5 / scale), scale)
    cv2.rectangle(lens, (0, 0), (shown - 1, shown - 1), _LABEL_BGR, 2)
    right = centre[0] < width_px / 2
    lower = centre[1] < height_px / 2
    x = width_px - shown - 8 if right else 8
    y = height_px - shown - 8 if lower else 8
    canvas[y : y + shown, x : x + shown] = lens


def _label(canvas: NDArray[np.uint8], text: str, corners_px: NDArray[np.float64]) -> None:
    height_px, width_px = canvas.shape[:2]
    (text_width, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.7, 2)
    x = int(np.clip(corners_px[:, 0].min(), 6, max(6, width_px - text_width - 6)))
    above = corners_px[:, 1].min() - 12
    y = int(above if above > 24 else min(height_px - 10, corners_px[:, 1].max() + 28))
    for colour, thickness in ((_SHADOW_BGR, 5), (_LABEL_BGR, 2)):
        cv2.putText(canvas, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, 0.7, colour, thickness, cv2.LINE_AA)


def _side_px(corners_px: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(corners_px - np.roll(corners_px, -1, axis=0), axis=1).mean())


def _jpeg(picture: Pixels) -> str:
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    return base64.b64encode(data.tobytes()).decode()
