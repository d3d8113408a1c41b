"""The ink of a marker as closed lines: drawn cell by cell, print programs leave hairlines between the cells."""

import numpy as np
from numpy.typing import NDArray

from alight.markers.family import marker_cells
from alight.markers.layout import PlacedMarker

Point = tuple[int, int]
Loop = NDArray[np.float64]


def ink_loops_m(marker: PlacedMarker) -> list[Loop]:
    """Closed lines around all that is black; what lies within an odd number of them is ink.

    Returns:
        Corners (N, 2) of each line, pad frame, metres.
    """
    cells = marker_cells(marker.family, marker.id)
    count = cells.shape[0]
    upper_left, upper_right, _, lower_left = marker.corners_m()[:, :2]
    right, down = (upper_right - upper_left) / count, (lower_left - upper_left) / count
    return [upper_left + np.outer(loop[:, 0], right) + np.outer(loop[:, 1], down) for loop in _loops(cells == 0)]


def _loops(ink: NDArray[np.bool_]) -> list[Loop]:
    """Lines between ink and what is none, along the grid, ink on their right; corners as (column, row)."""
    ahead = _edges(ink)
    loops = []
    while ahead:
        start = min(ahead)
        corner, corners = start, [start]
        while True:
            following = ahead[corner].pop()
            if not ahead[corner]:
                del ahead[corner]
            corner = following
            if corner == start:
                break
            corners.append(corner)
        loops.append(_without_straight_ones(np.array(corners, float)))
    return loops


def _edges(ink: NDArray[np.bool_]) -> dict[Point, list[Point]]:
    """From each corner of the grid to the next ones along the border of the ink."""
    padded = np.pad(ink, 1)
    ahead: dict[Point, list[Point]] = {}
    for row, column in np.argwhere(ink).tolist():
        beside = ((-1, 0), (0, 1), (1, 0), (0, -1))
        corners = ((column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1))
        for side, (by_row, by_column) in enumerate(beside):
            if not padded[row + 1 + by_row, column + 1 + by_column]:
                ahead.setdefault(corners[side], []).append(corners[(side + 1) % 4])
    return ahead


def _without_straight_ones(corners: Loop) -> Loop:
    before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
    turns = ((corners - before) != (after - corners)).any(axis=1)
    return np.asarray(corners[turns])
