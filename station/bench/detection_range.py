"""Show 1: how often each detector finds the pad, by height, and what it finds where there is none."""

import argparse

import numpy as np

from services.detector.detector import FoundMarker
from station.bench.detection_contenders import Contender, contenders
from station.bench.detection_scene import Shot, Studio, one_thread
from station.bench.table import print_table

HEIGHTS_M = (1.0, 2.0, 5.0, 10.0, 14.0, 16.0, 18.0, 20.0, 24.0, 28.0, 30.0, 33.0, 36.0, 40.0, 45.0, 50.0, 60.0)
_SEED = 41
_OTHERS_A_STUDIO = 20
_RIGHT_PX = 2.0
"""A detection counts if its corners are within this of the true ones, root mean square."""


def bench_detection_range(words: list[str] | None = None) -> None:
    """Print the tables; `--poses 100 --clutter 2000 --others 500` is the whole show."""
    parser = argparse.ArgumentParser(prog="python -m station.bench detection-range")
    parser.add_argument("--poses", type=int, default=16, metavar="N", help="poses a height (default: %(default)s)")
    parser.add_argument("--clutter", type=int, default=150, metavar="N", help="frames without any marker")
    parser.add_argument("--others", type=int, default=60, metavar="N", help="frames with another marker")
    parser.add_argument("--model", default="", metavar="FILE", help="an ONNX model: compare `yolo` with it, too")
    parser.add_argument(
        "--only", default="", metavar="WORD", help="only what has this in its name, on the same pictures"
    )
    options = parser.parse_args(words or [])
    one_thread()
    rivals = [rival for rival in contenders(options.model) if options.only in rival.name]
    if options.poses:
        print_rates(options.poses, rivals)
    if options.clutter or options.others:
        print_false_alarms(options.clutter, options.others, rivals)


def print_rates(poses: int, rivals: list[Contender]) -> None:
    """Detections in percent, by height."""
    studio = Studio(_SEED)
    rows = []
    for height_m in HEIGHTS_M:
        hits = np.zeros(len(rivals), int)
        for shot in studio.shots(height_m, poses):
            hits += [_is_right(rival.look(studio, shot), shot) for rival in rivals]
        rows.append((f"{height_m:g}", *(f"{100.0 * hit / poses:.0f}" for hit in hits)))
    head = ("height, m", *(rival.name for rival in rivals))
    print_table(f"Pad found, percent of {poses} poses a height (640x480, seed {_SEED})", head, rows)


def print_false_alarms(clutter: int, others: int, rivals: list[Contender]) -> None:
    """Detections of the pad where it is not."""
    blank = [0] * len(rivals)
    studio = Studio(_SEED + 1)
    for picture in studio.clutter(clutter):
        shot = Shot(
            picture, studio.camera, np.zeros((4, 2)), np.diag((1.0, -1.0, -1.0)), np.array((0.0, 0.0, 20.0)), 20.0
        )
        blank = [count + _is_there(rival, studio, shot) for count, rival in zip(blank, rivals, strict=True)]
    wrong, seen = [0] * len(rivals), 0
    draw = np.random.default_rng(_SEED)
    while seen < others:
        studio = Studio(_SEED + 2 + seen, number=int(draw.choice(np.delete(np.arange(1000), 68))))
        for shot in studio.shots(float(4.0 * 12.0 ** draw.random()), min(_OTHERS_A_STUDIO, others - seen)):
            wrong = [count + _is_there(rival, studio, shot) for count, rival in zip(wrong, rivals, strict=True)]
            seen += 1
    head = ("frames", *(rival.name for rival in rivals))
    rows = [
        (f"{clutter} of clutter", *(str(count) for count in blank)),
        (f"{others} of other markers", *(str(count) for count in wrong)),
    ]
    print_table("False detections of the pad", head, rows)


def _is_there(rival: Contender, studio: Studio, shot: Shot) -> bool:
    return rival.look(studio, shot) is not None


def _is_right(found: FoundMarker | None, shot: Shot) -> bool:
    return found is not None and float(np.sqrt(np.mean((found.corners_px - shot.corners_px) ** 2))) < _RIGHT_PX
