"""What an exported model sees in frames that it has not learned from."""

from pathlib import Path

import numpy as np

from schemas.settings.detector import Yolo
from services.detector.yolo.model import OnnxModel
from services.detector.yolo.places import distinct
from station.bench.detection_scene import Shot, Studio
from station.bench.table import print_table

HEIGHTS_M = (2.5, 5.0, 10.0, 16.0, 24.0, 30.0, 36.0, 40.0, 45.0)
_SEED = 61
_NEAR_SIDES = 0.3
_SIZE_FACTOR = 1.25


def print_validation(file: Path, shots: int, blank: int) -> None:
    """How often the pad of the paper is among the boxes of a frame, by height, and how many boxes frames without it have."""
    settings = Yolo(model=str(file))
    model, studio = OnnxModel(settings), Studio(_SEED)
    rows = []
    for height_m in HEIGHTS_M:
        ranks = np.array([_rank(model, settings, shot) for shot in studio.shots(height_m, shots)])
        shares = [100.0 * float(np.mean(ranks <= rank)) for rank in (1, settings.most_boxes)]
        rows.append((f"{height_m:g}", *(f"{share:.0f}" for share in shares)))
    title = f"The pad is seen, percent of {shots} frames (least score {settings.least_score})"
    print_table(title, ("height, m", "as the best box", f"among the best {settings.most_boxes}"), rows)
    for codes in (False, True):
        counts = [
            len(distinct(model.boxes(picture, settings.least_score), 1000))
            for picture in studio.clutter(blank, codes=codes)
        ]
        with_codes = "with codes of random cells" if codes else "without codes"
        print(f"boxes in a frame of clutter {with_codes}: {np.mean(counts):.1f} on average, {max(counts)} at most")


def _rank(model: OnnxModel, settings: Yolo, shot: Shot) -> float:
    """Which of the boxes is the marker, from 1; infinite if none is."""
    x, y = shot.corners_px.mean(axis=0).tolist()
    side_px = float(np.linalg.norm(shot.corners_px - np.roll(shot.corners_px, 1, axis=0), axis=1).mean())
    for rank, box in enumerate(distinct(model.boxes(shot.picture, settings.least_score), 1000), start=1):
        near = max(abs(box.x_px - x), abs(box.y_px - y)) < max(_NEAR_SIDES * side_px, 2.0)
        if near and 1.0 / _SIZE_FACTOR < box.width_px / side_px < _SIZE_FACTOR:
            return rank
    return np.inf
