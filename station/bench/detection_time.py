"""Show 3: how long each detector takes a frame, on one thread, beside OpenCV's default in the same run."""

import argparse
import math
import time
from collections.abc import Callable

import numpy as np

from alight.runtime.clock import NS_PER_S
from services.detector.detector import Detector, View
from station.bench.detection_contenders import PlainOpenCV, backend
from station.bench.detection_scene import Shot, Studio, one_thread
from station.bench.table import print_table

_SEED = 47
_HEIGHTS_M = (10.0, 16.0, 22.0, 28.0)
_FRAME_NS = NS_PER_S // 30
_FULL_HD, _FULL_HD_ROWS = 3.0, 1080
"""Three times the pixels in each direction with the same lens, and the rows about the middle of them."""

Look = Callable[[Detector | PlainOpenCV, Studio, Shot, int], object]


def bench_detection_time(words: list[str] | None = None) -> None:
    """Print the tables; times are of the thread itself, so that other programs on the machine do not count."""
    parser = argparse.ArgumentParser(prog="python -m station.bench detection-time")
    parser.add_argument("--poses", type=int, default=8, metavar="N", help="poses a height (default: %(default)s)")
    parser.add_argument("--model", default="", metavar="FILE", help="an ONNX model: time `yolo` with it, too")
    options = parser.parse_args(words or [])
    one_thread()
    _print("640x480", Studio(_SEED), options.poses, options.model)
    _print(
        "1920x1080",
        Studio(_SEED + 1, scale=_FULL_HD, height_px=_FULL_HD_ROWS),
        max(options.poses // 2, 1),
        options.model,
    )


def _print(title: str, studio: Studio, poses: int, model: str) -> None:
    shots = [shot for height_m in _HEIGHTS_M for shot in studio.shots(height_m, poses)]
    blank = [_empty(studio, picture) for picture in studio.clutter(poses * 2)]
    plain, aruco, aided = PlainOpenCV(subpixel=False), backend("aruco"), backend("aided")
    runs: list[tuple[str, Detector | PlainOpenCV, Look, list[Shot]]] = [
        ("OpenCV default, whole frame", plain, _alone, shots),
        ("aruco, whole frame", aruco, _alone, shots),
        ("aruco, tracking", aruco, _followed, shots),
        ("aided, whole frame, layout only", aided, _alone, shots),
        ("aided, whole frame, no pad there", aided, _alone, blank),
        ("aided, height and attitude", aided, _told, shots),
        ("aided, near a prediction", aided, _told_where, shots),
        ("aided, tracking", aided, _followed, shots),
    ]
    if model:
        yolo = backend("yolo", model)
        runs += [
            ("yolo, whole frame, layout only", yolo, _alone, shots),
            ("yolo, whole frame, no pad there", yolo, _alone, blank),
            ("yolo, height and attitude", yolo, _told, shots),
        ]
    rows, first = [], 0.0
    for name, detector, look, pictures in runs:
        took_ms = _timed(detector, look, studio, pictures)
        first = first or float(np.median(took_ms))
        median, p95 = np.percentile(took_ms, (50, 95)).tolist()
        rows.append((name, f"{median:.2f}", f"{p95:.2f}", f"{median / first:.2f}"))
    print_table(f"Milliseconds a frame, {title}, one thread", ("detector", "median", "p95", "median / OpenCV"), rows)


def _timed(detector: Detector | PlainOpenCV, look: Look, studio: Studio, shots: list[Shot]) -> list[float]:
    look(detector, studio, shots[0], 0)
    took_ms = []
    for number, shot in enumerate(shots, start=1):
        at_ns = number * 10 * NS_PER_S
        prepared = at_ns if look is not _followed else _seen_before(detector, shot, at_ns)
        began_s = time.thread_time()
        look(detector, studio, shot, prepared)
        took_ms.append(1e3 * (time.thread_time() - began_s))
    return took_ms


def _seen_before(detector: Detector | PlainOpenCV, shot: Shot, at_ns: int) -> int:
    """Let the detector see the frame, so that it tracks in the next one, a thirtieth of a second later."""
    detector.detect(View(shot.picture, at_ns, shot.camera))
    return at_ns + _FRAME_NS


def _alone(detector: Detector | PlainOpenCV, _studio: Studio, shot: Shot, at_ns: int) -> object:
    return detector.detect(View(shot.picture, at_ns, shot.camera))


def _followed(detector: Detector | PlainOpenCV, studio: Studio, shot: Shot, at_ns: int) -> object:
    return _alone(detector, studio, shot, at_ns)


def _told(detector: Detector | PlainOpenCV, studio: Studio, shot: Shot, at_ns: int) -> object:
    return detector.detect(View(shot.picture, at_ns, shot.camera, studio.prior(shot, place=False)))


def _told_where(detector: Detector | PlainOpenCV, studio: Studio, shot: Shot, at_ns: int) -> object:
    return detector.detect(View(shot.picture, at_ns, shot.camera, studio.prior(shot, place=True)))


def _empty(studio: Studio, picture: "np.ndarray[tuple[int, ...], np.dtype[np.uint8]]") -> Shot:
    nowhere = np.full((4, 2), math.nan)
    return Shot(picture, studio.camera, nowhere, np.diag((1.0, -1.0, -1.0)), np.array((0.0, 0.0, 20.0)), 20.0)
