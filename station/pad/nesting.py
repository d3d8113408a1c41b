"""`python -m station.pad.nesting`: finds the layout `nested` by trying what fits into the paper's marker, and prints its TOML.

Small markers lie on white cells of the large one: in the middle of a cell, over the seam of two cells, or on the point where four
meet. There they leave its border alone, and they may darken no cell of it by more than `MOST_INK`, however detectors sample cells.
Among the sizes that this allows those are taken for which the camera may be farthest from the pad's middle at touchdown while,
at every height, some marker is whole in view and no smaller than `LEAST_SIDE_PX`.
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
HEIGHTS_M = (0.15, 0.6, 0.3, 0.5, 1.4, 0.18, 0.22, 0.35, 0.4, 0.7, 0.8, 0.95, 1.1, 1.25, 2.0, 5.0)
"""Of the camera above the print: from touchdown to where the large marker is in view from everywhere."""
LEAST_SIDE_PX = 30.0
"""Twice the 14 px at which the large marker is seen from 20 m: nothing on the way down is harder than the way up there."""
MOST_INK = 0.25
"""How much of the sampled part of a white cell may turn dark; half would turn the bit."""
UNSAMPLED = (0.13, 0.25)
"""Part of a cell at each of its edges that is left out when it is read: OpenCV's default, and ours."""

_CELLS = 7
_CELL_M = SIDE_M / _CELLS
_INK_OF_A_MARKER = 0.75
"""Black part of a 5x5 marker whose code is half black."""
_CLEARANCE = 0.1
"""White between two markers, as a part of the larger one's side."""
_OFFSETS_M = (0.03, 0.04, 0.05, 0.06, 0.07, 0.08)
_CELL_SIDE_M = 0.04
_MIDDLE_SIDES_M = (0.025, 0.03, 0.035, 0.04)
_SEAM_SIDES_M = (0.06, 0.07, 0.08, 0.09, 0.1)
_CORNER_SIDES_M = (0.12, 0.13, 0.14, 0.15)
_WHITE_BITS = range(11, 19)
_LEAST_OWN_DISTANCE = 8

Place = tuple[int, int]
"""Row and column of a cell of the large marker, border included."""
Block = tuple[tuple[int, ...], tuple[int, ...]]
"""Rows and columns of some cells."""

_MIDDLE: Place = (_CELLS // 2, _CELLS // 2)


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
    """Largest part of the sampled part of a white cell of the largest marker that the others turn dark."""
    whites = np.argwhere(marker_cells(FAMILY, NUMBER) == 1).tolist()
    return max(_ink(layout, (row, column), unsampled) for row, column in whites for unsampled in UNSAMPLED)


def _ink(layout: PadLayout, place: Place, unsampled: float) -> float:
    half_m = (0.5 - unsampled) * _CELL_M
    x_m, y_m = _middle_m(place)
    ink_m2 = 0.0
    for marker in layout.markers[1:]:
        reach_m = half_m + marker.side_m / 2.0
        wide_m = min(reach_m - abs(marker.x_m - x_m), 2.0 * half_m, marker.side_m)
        high_m = min(reach_m - abs(marker.y_m - y_m), 2.0 * half_m, marker.side_m)
        ink_m2 += _INK_OF_A_MARKER * max(wide_m, 0.0) * max(high_m, 0.0)
    return ink_m2 / (2.0 * half_m) ** 2


def least_clearance(layout: PadLayout) -> float:
    """Smallest gap between two small markers, as a part of the larger one's side; they are all upright."""
    gaps = []
    for one, other in itertools.combinations(layout.markers[1:], 2):
        apart_m = max(abs(one.x_m - other.x_m), abs(one.y_m - other.y_m)) - (one.side_m + other.side_m) / 2.0
        gaps.append(apart_m / max(one.side_m, other.side_m))
    return min(gaps)


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
    inner = range(1, _CELLS - 1)
    corners = [
        block
        for row, column in itertools.product(inner, inner)
        if cells[np.ix_(*(block := _block(row, column, 2, 2)))].all()
    ]
    seams = [
        pair
        for row, column, (high, wide) in itertools.product(inner, inner, ((1, 2), (2, 1)))
        if cells[np.ix_(*(pair := _block(row, column, high, wide)))].all() and _MIDDLE in set(itertools.product(*pair))
    ]
    numbers = _distinct_numbers(int(cells.sum()))
    for corner, seam, *sides_m in itertools.product(corners, seams, _MIDDLE_SIDES_M, _SEAM_SIDES_M, _CORNER_SIDES_M):
        spots = _spots(cells, corner, seam, (sides_m[0], sides_m[1], sides_m[2]))
        placed = (
            PlacedMarker(FAMILY, number, side, x, y) for number, (x, y, side) in zip(numbers, spots, strict=False)
        )
        layout = PadLayout("nested", (PlacedMarker(FAMILY, NUMBER, SIDE_M), *placed), BOARD_M)
        if worst_ink(layout) <= MOST_INK and least_clearance(layout) >= _CLEARANCE:
            yield layout


def _block(row: int, column: int, high: int, wide: int) -> Block:
    return tuple(range(row, row + high)), tuple(range(column, column + wide))


def _spots(
    cells: NDArray[np.bool_], corner: Block, seam: Block, sides_m: tuple[float, float, float]
) -> list[tuple[float, float, float]]:
    """Where markers lie, and their sides, metres, largest first: on corner, seam and middle, and in each white cell that is left."""
    middle_m, seam_m, corner_m = sides_m
    taken = {*itertools.product(*corner), *itertools.product(*seam), _MIDDLE}
    free = {(int(row), int(column)) for row, column in np.argwhere(cells)} - taken
    return [
        (*_middle_m((float(np.mean(corner[0])), float(np.mean(corner[1])))), corner_m),
        (*_middle_m((float(np.mean(seam[0])), float(np.mean(seam[1])))), seam_m),
        *((*_middle_m(place), _CELL_SIDE_M) for place in sorted(free)),
        (*_middle_m(_MIDDLE), middle_m),
    ]


def _middle_m(place: tuple[float, float]) -> tuple[float, float]:
    row, column = place
    return round((column - _MIDDLE[1]) * _CELL_M, 6), round((_MIDDLE[0] - row) * _CELL_M, 6)


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
