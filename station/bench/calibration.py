"""Real calibration pictures, where they lie beside the repository: what is found, and what their authors had found."""

import os
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from services.camera.calibration_file import read_calibration
from station.bench.table import print_table
from station.calibrate.board import Grey, board_from
from station.calibrate.coverage import Coverage
from station.calibrate.judge import complaints_after, complaints_before
from station.calibrate.solve import NAMES, Solution, board_errors, solve
from station.calibrate.views import choose_views, find_views

REAL = Path(os.environ.get("ALIGHT_REAL_DATA", Path(__file__).resolve().parents[2].parent / "shared" / "real"))
SETS = (
    ("bottomcam_chessboard_20181028", "*.png", "chessboard:8x5:0.03"),
    ("bottomcam_chessboard_20190214_squeezed", "*.png", "chessboard:8x5:0.03"),
    ("tello_front_gridboard", "[0-9]*.png", "gridboard:5x7:0.033:0.0035:6x6_1000"),
    ("opencv_aruco_tutorials", "img_0*.jpg", "charuco:5x7:0.04:0.02:6x6_250:legacy"),
)
"""Folder, pictures, board. The authors' camera lies beside them in `mtx.npy` and `dist.npy`, or in OpenCV's YAML."""
_YAML = "tutorial_camera_charuco.yml"


def bench_calibration() -> None:
    """Calibrate and print."""
    if not REAL.is_dir():
        print("no real pictures here: name their folder in ALIGHT_REAL_DATA")
        return
    for folder, pattern, board in SETS:
        _bench_set(REAL / folder, pattern, board)


def _bench_set(folder: Path, pattern: str, board: str) -> None:
    pictures = list(_pictures(folder, pattern))
    size_px = (pictures[0][1].shape[1], pictures[0][1].shape[0])
    views = [view for _, view in find_views(board_from(board), pictures) if view is not None]
    chosen = choose_views(views)
    coverage = Coverage(size_px)
    coverage.add(chosen.used)
    solution = solve(chosen.used, size_px)
    authors = _authors(folder)
    _print(folder.name, solution, authors)
    errors = np.concatenate([board_errors(view, authors) for view in solution.views])
    print(
        f"{len(pictures)} pictures, {len(solution.views)} views used; error {solution.rms_px:.2f} px, held out "
        f"{solution.held_out_rms_px:.2f} px, with the authors' camera {np.sqrt(np.mean(errors**2)):.2f} px"
    )
    for complaint in (*complaints_before(len(pictures), len(views), chosen, coverage), *complaints_after(solution)):
        print(f"  refused: {complaint}")


def _pictures(folder: Path, pattern: str) -> list[tuple[str, Grey]]:
    read = ((file.name, cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)) for file in sorted(folder.glob(pattern)))
    return [(name, np.asarray(picture, np.uint8)) for name, picture in read if picture is not None]


def _authors(folder: Path) -> NDArray[np.float64]:
    if (folder / _YAML).exists():
        camera = read_calibration(folder / _YAML, "the authors' camera")
        return np.array([camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, *camera.distortion])
    matrix, distortion = np.load(folder / "mtx.npy"), np.load(folder / "dist.npy").ravel()
    return np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion[:5]])


def _print(name: str, solution: Solution, authors: NDArray[np.float64]) -> None:
    rows = [
        (parameter, f"{found:.4g}", f"{sigma:.2g}", f"{theirs:.4g}", f"{(found - theirs) / sigma:.1f}")
        for parameter, found, sigma, theirs in zip(
            NAMES, solution.values.tolist(), solution.sigmas.tolist(), authors.tolist(), strict=True
        )
    ]
    print_table(f"Real pictures `{name}`", ("", "found", "one sigma", "authors", "off, sigmas"), rows)
