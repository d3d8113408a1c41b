"""Show 1's last sentence: how much further several frames of an approach find the pad than one does."""

import argparse

import numpy as np

from services.detector.detector import Detector, Prior, View
from station.bench.detection_contenders import backend
from station.bench.detection_scene import Shot, Studio, one_thread
from station.bench.table import print_table

HEIGHTS_M = (36.0, 40.0, 45.0, 50.0, 55.0, 60.0)
LOOKS = (1, 3, 10)
"""How many consecutive frames."""
_SEED = 53
_FRAME_NS = 33_333_333
_APART_NS = 10_000_000_000
_RIGHT_PX = 2.0
_KNOWN = ("layout", "+ height, attitude", "+ place")


def bench_detection_approach(words: list[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m station.bench detection-approach")
    parser.add_argument("--approaches", type=int, default=24, metavar="N", help="a height (default: %(default)s)")
    options = parser.parse_args(words or [])
    one_thread()
    studio, rows = Studio(_SEED), []
    detectors = [backend("aided") for _ in _KNOWN]
    for height_m in HEIGHTS_M:
        first = np.array([_first_found(detectors, studio, height_m, number) for number in range(options.approaches)])
        percent = [[f"{100.0 * np.mean(column < looks):.0f}" for looks in LOOKS] for column in first.T]
        rows.append((f"{height_m:g}", *(" / ".join(each) for each in percent)))
    looks = " / ".join(str(count) for count in LOOKS)
    title = f"`aided`: pad found within {looks} frames, percent of {options.approaches} approaches at 1 m/s"
    print_table(title, ("height, m", *_KNOWN), rows)


def _first_found(detectors: list[Detector], studio: Studio, height_m: float, number: int) -> list[int]:
    """For each of what may be known the first frame that found the pad, counted from 0; as many as there are if none did."""
    shots = list(studio.approach(height_m, max(LOOKS)))
    # A system errs alike from one frame to the next: one draw for all of them.
    errors = [None, studio.prior(shots[0], place=False), studio.prior(shots[0], place=True)]
    return [_found_in(*each, shots, number) for each in zip(detectors, errors, strict=True)]


def _found_in(detector: Detector, prior: Prior | None, shots: list[Shot], number: int) -> int:
    for count, shot in enumerate(shots):
        view = View(shot.picture, (number + 1) * _APART_NS + count * _FRAME_NS, shot.camera, prior)
        for marker in detector.detect(view):
            if marker.id == 68 and float(np.sqrt(np.mean((marker.corners_px - shot.corners_px) ** 2))) < _RIGHT_PX:
                return count
    return len(shots)
