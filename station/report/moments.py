"""What the camera saw at some moments, with the detection drawn in."""

import base64
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.runtime.node import Pixels
from schemas import topics
from schemas.detection import Detection
from station.flight_record import FlightRecord
from station.metrics.summary import FlightSummary, pad_markers
from station.report.flight_path import FlightPaths, since_s
from station.report.overlay import Corners, Overlay, marker_places

DETECTED_BGR = (60, 220, 60)
ESTIMATED_BGR = (255, 150, 40)
TRUE_BGR = (60, 210, 255)
_FIRST_CORNER_BGR = (40, 60, 240)
_LABEL_BGR = (255, 255, 255)
_SMALL_PX = 70.0
_LENS_SOURCE_PX = 48
_LENS_SHOWN_PX = 208
_JPEG_QUALITY = 80
_SUBPIXEL_BITS = 3


@dataclass(frozen=True)
class Moment:
    """One picture of the report."""

    jpeg_base64: str
    caption: str
    off_px: tuple[float | None, float | None]
    """How far the pad's centre by the estimate, and by the truth, is from the detected one; None where there is none."""


def moments(record: FlightRecord, summary: FlightSummary, paths: FlightPaths, count: int = 5) -> list[Moment]:
    """Choose moments evenly in height between the first and the last sight of the pad, and draw them."""
    kept = set(record.picture_times_ns)
    pad = pad_markers(record)
    seen = [d for d in record.messages(topics.DETECTION) if d.captured_at_ns in kept and pad.among(d)]
    if summary.landing is not None:
        seen = [d for d in seen if summary.landing.looking_since_ns <= d.captured_at_ns <= summary.landing.ended_at_ns]
    overlay, places = Overlay(record), marker_places(record)
    drawn = []
    for detection in _evenly_in_height(seen, paths, count):
        picture, markers = record.picture(detection.captured_at_ns), pad.among(detection)
        if picture is not None:
            markers_m = np.array([places.get((m.family, m.id), _square_m(m.side_m)) for m in markers])
            squares = _Squares(
                detected=np.array([marker.corners_px for marker in markers]),
                estimated=overlay.by_estimate(detection.captured_at_ns, markers_m),
                true=overlay.by_truth(detection.captured_at_ns, markers_m),
            )
            caption = _caption(detection, squares, paths)
            drawn.append(Moment(_jpeg(_annotated(picture, squares)), caption, squares.off_px))
    return drawn


def _square_m(side_m: float) -> Corners:
    return side_m / 2 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])


@dataclass(frozen=True)
class _Squares:
    """The pad's markers in one picture, three times; (N, 4, 2) pixels each, the largest print first."""

    detected: Corners
    estimated: Corners | None
    true: Corners | None

    @property
    def off_px(self) -> tuple[float | None, float | None]:
        """Distances of the centres from the detected one."""
        centre = self.detected.mean(axis=(0, 1))
        others = (self.estimated, self.true)
        apart = [None if one is None else float(np.linalg.norm(one.mean(axis=(0, 1)) - centre)) for one in others]
        return apart[0], apart[1]


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


def _caption(detection: Detection, squares: _Squares, paths: FlightPaths) -> str:
    height = f"{_height_m(detection, paths):.1f} m up" if paths.true or paths.navigated else "height unknown"
    named = zip(("estimate", "truth"), squares.off_px, strict=True)
    apart = "".join(f", {name} {off_px:.1f} px off" for name, off_px in named if off_px is not None)
    since = f"{since_s(detection.captured_at_ns, paths.origin_ns):+.1f} s"
    return f"{since}, {height}, marker {_side_px(squares.detected[0]):.0f} px wide{apart}"


def _annotated(picture: Pixels, squares: _Squares) -> Pixels:
    canvas = _coloured(picture)
    _draw_squares(canvas, squares, np.zeros(2), 1.0)
    if _side_px(squares.detected[0]) < _SMALL_PX:
        _put_lens(canvas, picture, squares)
    return canvas


def _coloured(picture: Pixels) -> NDArray[np.uint8]:
    coloured = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture.copy()
    return np.asarray(coloured, np.uint8)


def _draw_squares(canvas: NDArray[np.uint8], squares: _Squares, left_top_px: Corners, scale: float) -> None:
    """Truth below, then the estimate, then what was detected; a pixel's centre stays its centre when magnified."""

    def shown(corners_px: Corners) -> NDArray[np.int32]:
        moved = (corners_px - left_top_px + 0.5) * scale - 0.5
        return np.asarray(np.round(moved * 2**_SUBPIXEL_BITS), np.int32).reshape(-1, 1, 2)

    thickness = 2 if _side_px(squares.detected[0]) * scale > 30 else 1
    for corners_px, colour, width in (
        (squares.true, TRUE_BGR, thickness + 2),
        (squares.estimated, ESTIMATED_BGR, thickness + 1),
        (squares.detected, DETECTED_BGR, thickness),
    ):
        if corners_px is not None:
            outlines = [shown(one) for one in corners_px]
            cv2.polylines(canvas, outlines, True, colour, width, cv2.LINE_AA, shift=_SUBPIXEL_BITS)
    for one in squares.detected:
        x, y = shown(one)[0, 0].tolist()
        cv2.circle(canvas, (x, y), 8 * (thickness + 1), _FIRST_CORNER_BGR, -1, cv2.LINE_AA, shift=_SUBPIXEL_BITS)


def _put_lens(canvas: NDArray[np.uint8], picture: Pixels, squares: _Squares) -> None:
    """A magnified cut-out in the corner farthest from the pad."""
    height_px, width_px = picture.shape[:2]
    half = max(_LENS_SOURCE_PX // 2, int(_side_px(squares.detected[0])))
    centre = squares.detected.mean(axis=(0, 1))
    left = int(np.clip(round(centre[0]) - half, 0, max(0, width_px - 2 * half)))
    top = int(np.clip(round(centre[1]) - half, 0, max(0, height_px - 2 * half)))
    cut = picture[top : top + 2 * half, left : left + 2 * half]
    shown = min(_LENS_SHOWN_PX, height_px // 2, width_px // 2)
    lens = _coloured(np.asarray(cv2.resize(cut, (shown, shown), interpolation=cv2.INTER_NEAREST), np.uint8))
    _draw_squares(lens, squares, np.array([left, top], float), shown / cut.shape[1])
    cv2.rectangle(lens, (0, 0), (shown - 1, shown - 1), _LABEL_BGR, 2)
    x = width_px - shown - 8 if centre[0] < width_px / 2 else 8
    y = height_px - shown - 8 if centre[1] < height_px / 2 else 8
    canvas[y : y + shown, x : x + shown] = lens


def _side_px(corners_px: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(corners_px - np.roll(corners_px, -1, axis=0), axis=1).mean())


def _jpeg(picture: Pixels) -> str:
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    return base64.b64encode(data.tobytes()).decode()
