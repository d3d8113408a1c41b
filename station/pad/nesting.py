"""`python -m station.pad.nesting`: finds the layout `nested` by trying what fits into the paper's marker, and prints its TOML.

Small markers lie on white cells of the large one: each in the middle of a cell, or on the point where four white cells meet.
There they leave its border alone, and they may darken no cell of it by more than `MOST_INK`. Among the sizes that this allows
those are taken for which the camera may be farthest from the pad's middle at touchdown while, at every height, some marker is
whole in view and no smaller than `LEAST_SIDE_PX`.
"""

import itertools
import sys
from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.markers.family import dictionary, marker_cells
from alight.markers.layout import PadLayout, PlacedMarker
from alight.markers.visibility import Spread, worst_sight
from schemas.calibration import CameraCalibration
from schemas.settings.camera import Calibration

FAMILY, NUMBER, SIDE_M, BOARD_M = "5x5_1000", 68, 1.0, 1.3
HEIGHTS_M = (0.15, 0.18, 0.22, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.95, 1.1, 1.25, 1.4, 2.0, 5.0)
"""Of the camera above the print: from touchdown to where the large marker is in view from everywhere."""
LEAST_SIDE_PX = 30.0
"""Twice the 14 px at which the large marker is seen from 20 m: nothing on the way down is harder than the way up there."""
MOST_INK = 1.0 / 3.0
"""How much of a white cell, as OpenCV samples it, may turn dark; half would turn the bit."""

_CELLS = 7
_CELL_M = SIDE_M / _CELLS
_UNSAMPLED = 0.13
"""Part of a cell at each of its edges that OpenCV leaves out (`perspectiveRemoveIgnoredMarginPerCell`)."""
_INK_OF_A_MARKER = 0.75
"""Black part of a 5x5 marker whose code is half black."""
_OFFSETS_M = (0.03, 0.04, 0.05, 0.06, 0.07, 0.08)
_MIDDLE_SIDES_M = (0.035, 0.04, 0.045, 0.05, 0.055, 0.06)
_CELL_SIDES_M = (0.05, 0.06, 0.07, 0.08)
_CORNER_SIDES_M = (0.12, 0.14, 0.16, 0.18, 0.2)
_WHITE_BITS = range(11, 19)
_LEAST_OWN_DISTANCE = 8

Place = tuple[int, int]
"""Row and column of a cell of the large marker, border included."""


def nested_layout() -> PadLayout:
    """The best of all layouts that fit, for the paper's camera."""
    camera = PinholeCamera.from_calibration(CameraCalibration(at_ns=0, **Calibration().model_dump()))
    best, chosen = (0.0, 0.0), None
    for layout in _candidates():
        score = _score(layout, camera, best[0])
        if score > best:
            best, chosen = score, layout
    if chosen is None:
        raise ValueError("nothing that fits keeps a marker in view at every height")
    return chosen


def worst_ink(layout: PadLayout) -> float:
    """Largest part of a white cell of the largest marker, as OpenCV samples it, that the others turn dark."""
    cells = marker_cells(FAMILY, NUMBER)
    half_m = (0.5 - _UNSAMPLED) * _CELL_M
    worst = 0.0
    for row, column in np.argwhere(cells == 1).tolist():
        x_m, y_m = _middle_m((row, column))
        ink_m2 = 0.0
        for marker in layout.markers[1:]:
            reach_m = half_m + marker.side_m / 2.0
            wide_m = min(reach_m - abs(marker.x_m - x_m), 2.0 * half_m, marker.side_m)
            high_m = min(reach_m - abs(marker.y_m - y_m), 2.0 * half_m, marker.side_m)
            ink_m2 += _INK_OF_A_MARKER * max(wide_m, 0.0) * max(high_m, 0.0)
        worst = max(worst, ink_m2 / (2.0 * half_m) ** 2)
    return worst


def _score(layout: PadLayout, camera: PinholeCamera, to_beat_m: float) -> tuple[float, float]:
    """Largest offset at touchdown, metres, and the fewest pixels there; nothing is said about what beats nothing."""
    score = (0.0, 0.0)
    for offset_m in _OFFSETS_M:
        if offset_m < to_beat_m:
            continue
        fewest_px = np.inf
        for height_m in HEIGHTS_M:
            fewest_px = min(fewest_px, worst_sight(layout, camera, height_m, Spread(offset_m)).side_px)
            if fewest_px < LEAST_SIDE_PX:
                return score
        score = (offset_m, float(fewest_px))
    return score


def _candidates() -> Iterator[PadLayout]:
    cells = marker_cells(FAMILY, NUMBER) == 1
    corners = [
        (row, column)
        for row, column in itertools.product(range(1, _CELLS - 2), repeat=2)
        if cells[row : row + 2, column : column + 2].all()
    ]
    numbers = _distinct_numbers(int(cells.sum()) + 1)
    for corner, *sides_m in itertools.product(corners, _MIDDLE_SIDES_M, _CELL_SIDES_M, _CORNER_SIDES_M):
        layout = _layout(cells, corner, (sides_m[0], sides_m[1], sides_m[2]), numbers)
        if worst_ink(layout) <= MOST_INK:
            yield layout


def _layout(
    cells: NDArray[np.bool_], corner: Place, sides_m: tuple[float, float, float], numbers: list[int]
) -> PadLayout:
    """One marker of each white cell's middle but those around the corner, where a larger one lies."""
    middle_m, cell_m, corner_m = sides_m
    row, column = corner
    taken = set(itertools.product((row, row + 1), (column, column + 1)))
    x_m, y_m = _middle_m((row + 0.5, column + 0.5))
    free = {(int(row), int(column)) for row, column in np.argwhere(cells)} - taken
    middle = (_CELLS // 2, _CELLS // 2)
    small = [
        (x_m, y_m, corner_m),
        *((*_middle_m(place), middle_m if place == middle else cell_m) for place in sorted(free)),
    ]
    small.sort(key=lambda spot: -spot[2])
    large = PlacedMarker(FAMILY, NUMBER, SIDE_M)
    placed = (PlacedMarker(FAMILY, number, side, x, y) for number, (x, y, side) in zip(numbers, small, strict=False))
    return PadLayout("nested", (large, *placed), BOARD_M)


def _middle_m(place: tuple[float, float]) -> tuple[float, float]:
    row, column = place
    return round((column - _CELLS // 2) * _CELL_M, 6), round((_CELLS // 2 - row) * _CELL_M, 6)


def _distinct_numbers(count: int) -> list[int]:
    """Markers whose codes, however turned, differ most from each other, from the large one's and from themselves."""
    codes = dictionary(FAMILY)
    bits = [marker_cells(FAMILY, number)[1:-1, 1:-1] for number in range(codes.bytesList.shape[0])]
    fit = [
        number
        for number, each in enumerate(bits)
        if int(each.sum()) in _WHITE_BITS
        and min(int((each != np.rot90(each, turns)).sum()) for turns in (1, 2, 3)) >= _LEAST_OWN_DISTANCE
    ]
    fit = [number for number in fit if number != NUMBER]
    chosen = [NUMBER]
    nearest = np.full(len(fit), np.inf)
    for _ in range(count):
        turned = [np.rot90(bits[chosen[-1]], turns) for turns in range(4)]
        newest = [min(int((bits[number] != each).sum()) for each in turned) for number in fit]
        nearest = np.minimum(nearest, newest)
        chosen.append(fit[int(np.argmax(nearest))])
    return chosen[1:]


def as_toml(layout: PadLayout) -> str:
    """The layout as a file that `read_layout` takes."""
    lines = [f"board_m = {layout.board_m:g}"]
    for marker in layout.markers:
        lines += ["", "[[marker]]", f'family = "{marker.family}"', f"id = {marker.id}", f"side_m = {marker.side_m:g}"]
        lines += [f"{key} = {value!r}" for key in ("x_m", "y_m", "rotation_rad") if (value := getattr(marker, key))]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    cv2.setNumThreads(1)
    head = "# One marker of 1 m for the way down, small ones in it for the last metre. Found by station/pad/nesting.py."
    sys.stdout.write(f"{head}\n{as_toml(nested_layout())}")
