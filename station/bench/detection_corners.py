"""Show 2: how exact corners and range are by height, whether the covariance is honest, and that all place a pixel's centre alike."""

import argparse
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from services.detector.detector import FoundMarker, View
from services.detector.square_pose import located
from station.bench.detection_contenders import Contender, backend, contenders
from station.bench.detection_scene import Shot, Studio, one_thread, rms
from station.bench.table import print_table

HEIGHTS_M = (1.0, 2.0, 5.0, 10.0, 18.0, 20.0, 24.0, 30.0, 36.0, 40.0)
HONEST_HEIGHTS_M = (1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0)
_SEED = 43
_RIGHT_PX = 2.0


@dataclass
class _Errors:
    corners_px: list[float] = field(default_factory=list)
    shift_px: list[NDArray[np.float64]] = field(default_factory=list)
    range_percent: list[float] = field(default_factory=list)

    def add(self, found: FoundMarker, shot: Shot) -> None:
        error = found.corners_px - shot.corners_px
        if rms(error) > _RIGHT_PX:
            return
        self.corners_px.append(rms(error))
        self.shift_px.append(error.mean(axis=0))
        marker = located(found, 1.0, shot.camera)
        if marker is not None:
            seen_m = float(np.linalg.norm(marker.poses[0].position_camera_m))
            true_m = float(np.linalg.norm(shot.centre_camera_m))
            self.range_percent.append(100.0 * abs(seen_m / true_m - 1.0))


def bench_detection_corners(words: list[str] | None = None) -> None:
    """Print the tables; `--poses 100 --detections 2000` is the whole show."""
    parser = argparse.ArgumentParser(prog="python -m station.bench detection-corners")
    parser.add_argument("--poses", type=int, default=16, metavar="N", help="poses a height (default: %(default)s)")
    parser.add_argument(
        "--detections", type=int, default=240, metavar="N", help="for the covariance (default: %(default)s)"
    )
    options = parser.parse_args(words or [])
    one_thread()
    studio, rivals = Studio(_SEED), contenders()
    errors = {height_m: _errors(studio, rivals, height_m, options.poses) for height_m in HEIGHTS_M}
    head = ("height, m", *(rival.name for rival in rivals))
    rows = [(f"{height_m:g}", *(_corners(each) for each in row)) for height_m, row in errors.items()]
    title = f"Corners: RMSE / median error, px (mean shift right/down, px); {options.poses} poses a height"
    print_table(title, head, rows)
    rows = [(f"{height_m:g}", *(_range(each) for each in row)) for height_m, row in errors.items()]
    print_table("Range: RMSE / median error, percent of the distance", head, rows)
    print_honesty(options.detections)


def print_honesty(detections: int) -> None:
    """The square of the corners' error, normalised by what the detector says of itself: 1 is honest."""
    studio = Studio(_SEED + 1)
    rows = []
    everything: list[tuple[float, float]] = []
    aided, poses = backend("aided"), max(detections // len(HONEST_HEIGHTS_M), 1)
    for height_m in HONEST_HEIGHTS_M:
        ratios = []
        for number, shot in enumerate(studio.shots(height_m, poses), start=1):
            view = View(shot.picture, number * 10**10, shot.camera, studio.prior(shot, place=False))
            found = next((marker for marker in aided.detect(view) if marker.id == 68), None)
            if found is not None and rms(found.corners_px - shot.corners_px) < _RIGHT_PX:
                ratios.append(_normalised(found, shot))
        everything += ratios
        rows.append((f"{height_m:g}", str(len(ratios)), *_means(ratios)))
    rows.append(("all", str(len(everything)), *_means(everything)))
    head = ("height, m", "detections", "each coordinate", "all eight together")
    print_table("Corner error squared over its variance, mean (1 is honest), aided", head, rows)


def _means(ratios: list[tuple[float, float]]) -> tuple[str, str]:
    if not ratios:
        return "-", "-"
    single, joint = np.mean(ratios, axis=0).tolist()
    return f"{single:.2f}", f"{joint:.2f}"


def _normalised(found: FoundMarker, shot: Shot) -> tuple[float, float]:
    error = (found.corners_px - shot.corners_px).ravel()
    single = float(error @ error) / 8.0 / found.corner_sigma_px**2
    if found.corner_covariance_px2 is None:
        return single, single
    # Six numbers make the pose of a square; two of the eight directions cannot err.
    values, vectors = np.linalg.eigh(found.corner_covariance_px2)
    along = (vectors.T @ error)[2:]
    return single, float(np.mean(along**2 / values[2:]))


def _errors(studio: Studio, rivals: list[Contender], height_m: float, poses: int) -> list[_Errors]:
    errors = [_Errors() for _ in rivals]
    for shot in studio.shots(height_m, poses):
        for rival, each in zip(rivals, errors, strict=True):
            found = rival.look(studio, shot)
            if found is not None:
                each.add(found, shot)
    return errors


def _corners(errors: _Errors) -> str:
    if not errors.corners_px:
        return "-"
    right, down = np.mean(errors.shift_px, axis=0).tolist()
    errors_px = np.array(errors.corners_px)
    return f"{rms(errors_px):.3f} / {np.median(errors_px):.3f} ({right:+.2f}/{down:+.2f})"


def _range(errors: _Errors) -> str:
    if not errors.range_percent:
        return "-"
    return f"{rms(np.array(errors.range_percent)):.2f} / {np.median(errors.range_percent):.2f}"
