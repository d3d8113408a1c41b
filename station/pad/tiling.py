"""How a board is cut into sheets of paper."""

import itertools
import math
from dataclasses import dataclass

PAPERS_MM = {
    "A0": (841.0, 1189.0),
    "A1": (594.0, 841.0),
    "A2": (420.0, 594.0),
    "A3": (297.0, 420.0),
    "A4": (210.0, 297.0),
    "letter": (215.9, 279.4),
}
"""Width and height, upright, millimetres."""

MARGIN_MM = 12.0
"""Left white at every edge: most printers cannot print there, and cut marks stand there."""
FOOT_MM = 24.0
"""For the scale bar and the page map, at the bottom, beyond the margin."""


@dataclass(frozen=True)
class Tile:
    """One sheet's part of the board."""

    row: int
    column: int
    left_mm: float
    """Of its part, from the board's left edge."""
    top_mm: float
    """Of its part, from the board's upper edge."""
    width_mm: float
    """Of what is kept when the sheets are cut; the last ones are as small as what is left."""
    height_mm: float
    spare_right_mm: float
    """What is printed beyond, for the next sheet to lie on."""
    spare_below_mm: float


@dataclass(frozen=True)
class Tiling:
    """All sheets of a board."""

    page_mm: tuple[float, float]
    """Width and height of the paper as it is used."""
    rows: int
    columns: int
    tiles: tuple[Tile, ...]
    """Row by row."""


def tiling(board_mm: float, paper: str, overlap_mm: float) -> Tiling:
    """The fewest sheets, upright or lying.

    Args:
        board_mm: Edge of the square board.
        paper: A key of `PAPERS_MM`.
        overlap_mm: How much of a sheet is printed again on the one before it.

    Raises:
        ValueError: If the overlap leaves nothing of a sheet.
    """
    width_mm, height_mm = PAPERS_MM[paper]
    either_way = [_cut(board_mm, page_mm, overlap_mm) for page_mm in ((width_mm, height_mm), (height_mm, width_mm))]
    return min(either_way, key=lambda cut: len(cut.tiles))


def _cut(board_mm: float, page_mm: tuple[float, float], overlap_mm: float) -> Tiling:
    usable = (page_mm[0] - 2.0 * MARGIN_MM, page_mm[1] - 2.0 * MARGIN_MM - FOOT_MM)
    (columns, wide_mm), (rows, high_mm) = (_steps(board_mm, length_mm, overlap_mm) for length_mm in usable)
    tiles = []
    for row, column in itertools.product(range(rows), range(columns)):
        left_mm, top_mm = column * wide_mm, row * high_mm
        kept = (min(wide_mm, board_mm - left_mm), min(high_mm, board_mm - top_mm))
        spare = (min(overlap_mm, board_mm - left_mm - kept[0]), min(overlap_mm, board_mm - top_mm - kept[1]))
        tiles.append(Tile(row, column, left_mm, top_mm, *kept, *spare))
    return Tiling(page_mm, rows, columns, tuple(tiles))


def _steps(board_mm: float, usable_mm: float, overlap_mm: float) -> tuple[int, float]:
    """How many sheets side by side, and how much of each is kept: all alike, so that no last one is a sliver."""
    if board_mm <= usable_mm:
        return 1, board_mm
    if usable_mm <= 2.0 * overlap_mm:
        raise ValueError(f"an overlap of {overlap_mm:g} mm leaves nothing of a sheet of {usable_mm:g} mm")
    count = math.ceil(board_mm / (usable_mm - overlap_mm))
    return count, board_mm / count
