"""ChArUco boards as pads: the print is OpenCV's own."""

import cv2
import numpy as np
import pytest

from alight.markers.charuco import Charuco
from alight.markers.layout import LayoutError, read_layout
from alight.markers.print_grid import print_grid

BOARD = """
board_m = {board_m}
[charuco]
columns = {columns}
rows = {rows}
square_m = 0.1
marker_m = 0.06
family = "4x4_50"
legacy = {legacy}
"""


def read(tmp_path, columns=5, rows=4, legacy="false", board_m=0.6):
    file = tmp_path / "board.toml"
    file.write_text(BOARD.format(columns=columns, rows=rows, legacy=legacy, board_m=board_m))
    return read_layout(str(file))


@pytest.mark.parametrize(("columns", "rows"), [(5, 7), (4, 4), (3, 6)])
@pytest.mark.parametrize("legacy", [False, True])
def test_the_print_is_the_one_that_opencv_draws(tmp_path, columns, rows, legacy) -> None:
    layout = read(tmp_path, columns, rows, str(legacy).lower(), board_m=0.8)
    grid = print_grid(layout.markers, layout.board_m, layout.ink)
    size = (columns * 100, rows * 100)
    drawn = np.asarray(Charuco(columns, rows, 0.1, 0.06, "4x4_50", legacy).board().generateImage(size)) > 127
    x_m = (np.arange(size[0]) + 0.5) / 1000.0 + 0.4 - columns * 0.05
    y_m = (np.arange(size[1]) + 0.5) / 1000.0 + 0.4 - rows * 0.05
    ours = grid.white[np.ix_(np.searchsorted(grid.y_m, y_m) - 1, np.searchsorted(grid.x_m, x_m) - 1)] == 1
    # OpenCV rounds the cells of 10 mm to whole pixels.
    assert (ours != drawn).mean() < 0.01


def test_chess_corners_lie_where_black_squares_meet(tmp_path) -> None:
    layout = read(tmp_path)
    ink = np.array([square.outline_m() for square in layout.ink]).reshape(-1, 2)
    for corner in layout.charuco.chess_corners_m():
        assert (np.linalg.norm(ink - corner, axis=1) < 1e-6).sum() == 2


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"board_m": 0.45}, "the chessboard reaches beyond the board: enlarge board_m"),
        ({"columns": 12, "rows": 12, "board_m": 2.0}, "family 4x4_50 has 50 markers, the board needs 72"),
        ({"columns": 2}, "charuco.columns: Input should be greater than or equal to 3"),
    ],
)
def test_a_board_that_cannot_be_is_refused(tmp_path, change, says) -> None:
    with pytest.raises(LayoutError, match=says):
        read(tmp_path, **change)


def test_a_pad_is_either_markers_or_a_board(tmp_path) -> None:
    file = tmp_path / "both.toml"
    file.write_text(
        BOARD.format(columns=5, rows=4, legacy="false", board_m=0.6)
        + "[[marker]]\nfamily = '4x4_50'\nid = 40\nside_m = 0.05\n"
    )
    with pytest.raises(LayoutError, match="either as tables"):
        read_layout(str(file))


def test_opencv_finds_its_corners_in_our_print(tmp_path) -> None:
    layout = read(tmp_path, columns=5, rows=5)
    grid = print_grid(layout.markers, layout.board_m, layout.ink)
    places = (np.arange(900) + 0.5) / 1500.0
    white = grid.white[np.ix_(np.searchsorted(grid.y_m, places) - 1, np.searchsorted(grid.x_m, places) - 1)]
    picture = (white * 200 + 20).astype(np.uint8)
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(layout.charuco.board()).detectBoard(picture)
    assert len(numbers) == 16
    expected = layout.charuco.chess_corners_m()[np.ravel(numbers)] * (1500.0, -1500.0) + 449.5
    assert np.abs(corners.reshape(-1, 2) - expected).max() < 0.2
