"""What is where on a print: black and white rectangles, from which exact means over any area follow."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alight.markers.family import marker_cells
from alight.markers.layout import InkSquare, PlacedMarker

Array = NDArray[np.float64]

_SQUARE_ON_RAD = 1e-9
_SAMPLES = 4096
_MOST_SAMPLES_A_TEXEL = 16


@dataclass(frozen=True)
class PrintGrid:
    """A board cut along the edges of all cells of all markers that lie square to it."""

    x_m: Array
    """Where it is cut upright: distances from the print's left edge, rising, (columns + 1,), metres."""
    y_m: Array
    """Where it is cut across: distances from the print's upper edge, rising, (rows + 1,), metres."""
    white: NDArray[np.uint8]
    """1 for paper, 0 for ink, (rows, columns), first row on top."""


def is_square_on(marker: PlacedMarker) -> bool:
    """Whether its edges run along the board's."""
    return abs(math.remainder(marker.rotation_rad, math.pi / 2.0)) < _SQUARE_ON_RAD


def print_grid(markers: tuple[PlacedMarker, ...], board_m: float, ink: tuple[InkSquare, ...] = ()) -> PrintGrid:
    """Cut a board up.

    Args:
        markers: Markers that lie square to the board; later ones lie over earlier ones.
        board_m: Edge of the white board, metres.
        ink: Black squares under them.
    """
    seams = [_seams_m(marker, board_m) for marker in markers]
    bounds = [_bounds_m(square, board_m) for square in ink]
    x_m = _cuts_m([x for x, _ in (*seams, *bounds)], board_m)
    y_m = _cuts_m([y for _, y in (*seams, *bounds)], board_m)
    white = np.ones((len(y_m) - 1, len(x_m) - 1), np.uint8)
    middle_x, middle_y = (x_m[:-1] + x_m[1:]) / 2.0, (y_m[:-1] + y_m[1:]) / 2.0
    for (left, right), (top, bottom) in bounds:
        white[np.ix_((middle_y > top) & (middle_y < bottom), (middle_x > left) & (middle_x < right))] = 0
    for marker, (seams_x, seams_y) in zip(markers, seams, strict=True):
        columns = np.searchsorted(seams_x, middle_x) - 1
        rows = np.searchsorted(seams_y, middle_y) - 1
        cells = np.rot90(marker_cells(marker.family, marker.id), round(marker.rotation_rad / (math.pi / 2.0)))
        count = cells.shape[0]
        on_rows, on_columns = (
            np.flatnonzero((rows >= 0) & (rows < count)),
            np.flatnonzero((columns >= 0) & (columns < count)),
        )
        white[np.ix_(on_rows, on_columns)] = cells[np.ix_(rows[on_rows], columns[on_columns])]
    return PrintGrid(x_m, y_m, white)


def split_askew(markers: tuple[PlacedMarker, ...]) -> tuple[tuple[PlacedMarker, ...], tuple[PlacedMarker, ...]]:
    """The first markers that lie square to the board, and the others from the first askew one on, which lie over them."""
    first = next((index for index, marker in enumerate(markers) if not is_square_on(marker)), len(markers))
    return markers[:first], markers[first:]


def chess_grid(columns: int, rows: int, square_m: float, board_m: float) -> PrintGrid:
    """A chessboard in the middle of a board, its upper left square black.

    Args:
        columns: Inner corners in a row.
        rows: Rows of inner corners.
        square_m: Edge of one square, metres.
        board_m: Edge of the white board, metres.
    """
    seams = [
        np.concatenate(([0.0], board_m / 2.0 + (np.arange(count + 2) - (count + 1) / 2.0) * square_m, [board_m]))
        for count in (columns, rows)
    ]
    white = np.ones((rows + 3, columns + 3), np.uint8)
    white[1:-1, 1:-1] = np.add.outer(np.arange(rows + 1), np.arange(columns + 1)) % 2
    return PrintGrid(seams[0], seams[1], white)


def overlaps_m(bounds_m: Array, seams_m: Array) -> Array:
    """Length that each interval between bounds has in common with each interval between seams, (bounds - 1, seams - 1), metres."""
    upper = np.minimum(bounds_m[1:, None], seams_m[None, 1:])
    lower = np.maximum(bounds_m[:-1, None], seams_m[None, :-1])
    return np.asarray(np.maximum(upper - lower, 0.0))


def turned_whiteness(marker: PlacedMarker, board_m: float, side_texels: int) -> tuple[Array, Array]:
    """A marker that lies askew, by many samples a texel, on a board of `side_texels` x `side_texels`.

    Returns:
        The white part of each texel's part under the marker, and the part under the marker, both 0 to 1 and (n, n).
    """
    fine = min(max(_SAMPLES // side_texels, 2), _MOST_SAMPLES_A_TEXEL)
    places = ((np.arange(side_texels * fine) + 0.5) / (side_texels * fine) - 0.5) * board_m
    cells = marker_cells(marker.family, marker.id)
    count = cells.shape[0]
    c, s = math.cos(marker.rotation_rad), math.sin(marker.rotation_rad)
    ink_free, cover = np.zeros((side_texels, side_texels)), np.zeros((side_texels, side_texels))
    x = places - marker.x_m
    for row in range(side_texels):
        y = -places[row * fine : (row + 1) * fine, None] - marker.y_m
        column = np.floor((c * x + s * y) * (count / marker.side_m) + count / 2.0).astype(int)
        line = np.floor(count / 2.0 - (c * y - s * x) * (count / marker.side_m)).astype(int)
        on = (column >= 0) & (column < count) & (line >= 0) & (line < count)
        if not on.any():
            continue
        bright = np.where(on, cells[np.clip(line, 0, count - 1), np.clip(column, 0, count - 1)], 0)
        cover[row] = on.reshape(fine, side_texels, fine).mean(axis=(0, 2))
        ink_free[row] = bright.reshape(fine, side_texels, fine).mean(axis=(0, 2))
    return ink_free, cover


def _cuts_m(seams_m: list[Array], board_m: float) -> Array:
    """All seams, and the board's edges, rising."""
    return np.unique(np.concatenate([[0.0, board_m], *seams_m]))


def _bounds_m(square: InkSquare, board_m: float) -> tuple[Array, Array]:
    """Its edges from the board's left and upper edge, metres."""
    ends = np.array([-0.5, 0.5]) * square.side_m + board_m / 2.0
    return ends + square.x_m, ends - square.y_m


def _seams_m(marker: PlacedMarker, board_m: float) -> tuple[Array, Array]:
    """Edges of its cells from the board's left and upper edge, metres."""
    margin_m = (board_m - marker.side_m) / 2.0
    count = marker_cells(marker.family, marker.id).shape[0]
    along = np.linspace(0.0, marker.side_m, count + 1)
    return margin_m + marker.x_m + along, margin_m - marker.y_m + along
