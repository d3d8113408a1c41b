"""Corners by a marker's edges where its cells bear them out, else by its cells: a leaf, dirt or a shadow on the outline moves edges."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from services.detector.cell_corners import cell_chi2, cells_tell, corners_by_cells
from services.detector.edge_corners import RefinedCorners, refined_corners

Array = NDArray[np.float64]

_LARGEST_CHI2 = 25.0
"""Between corners and cells; 8 is to be expected. 99 of 100 rendered pads with nothing on them have less, from 0.85 m to 10 m, half of them with a shadow's edge
across."""
_EXPECTED_CHI2 = 8.0
_WHOLE_SUPPORT = 0.92
"""Of edges that nothing covers: 99 of 100 of those pads, and of the markers of a real board, have as much. Such edges are believed as they are:
cells of a poor print, of a picture of few pixels, point up to 0.3 cells beside good edges, and with slack for that they correct none of 400 covered pads more."""
_ELSEWHERE_PX = 1.0
"""Edges that were looked for this near are not looked for again."""


def sharp_corners(
    picture: NDArray[np.uint8], corners_px: Array, cells: int, camera: PinholeCamera | None
) -> RefinedCorners | None:
    """The corners of edges that are whole, or that the cells agree with; else those to which the cells point.

    Args:
        picture: (height, width), grey levels.
        corners_px: (4, 2), in order around the marker, wrong by less than half a cell, or by a cell or so where something covers a corner.
        cells: Cells along one side, border included.
        camera: Tells how the lens bends the marker; without it cells do not judge edges: it may be the lens that they disagree about.

    Returns:
        None if neither edges nor cells can be made out. Of a small marker the edges, whatever its cells may be. Edges that the cells
        contradict without telling where the corners are claim as much less.
    """
    edges = refined_corners(picture, corners_px, cells, camera)
    if not cells_tell(corners_px, cells) or (edges is not None and _is_believed(picture, edges, cells, camera)):
        return edges
    by_cells = corners_by_cells(picture, corners_px, cells, camera)
    if by_cells is None:
        return None if edges is None else _less_sure(picture, edges, cells, camera)
    if edges is None and float(np.abs(by_cells.corners_px - corners_px).max()) < _ELSEWHERE_PX:
        return by_cells
    again = refined_corners(picture, by_cells.corners_px, cells, camera)
    return again if again is not None and _is_believed(picture, again, cells, camera) else by_cells


def is_borne_out(
    picture: NDArray[np.uint8], corners: RefinedCorners, cells: int, camera: PinholeCamera | None
) -> bool | None:
    """Whether the cells are where the corners have them, for all that both claim; None if the cells cannot tell. As for `sharp_corners`."""
    if camera is None or not cells_tell(corners.corners_px, cells):
        return None
    chi2 = cell_chi2(picture, corners, cells, camera)
    return None if chi2 is None else chi2 <= _LARGEST_CHI2


def _is_believed(picture: NDArray[np.uint8], edges: RefinedCorners, cells: int, camera: PinholeCamera | None) -> bool:
    if camera is None or edges.support >= _WHOLE_SUPPORT:
        return True
    return bool(is_borne_out(picture, edges, cells, camera))


def _less_sure(
    picture: NDArray[np.uint8], edges: RefinedCorners, cells: int, camera: PinholeCamera | None
) -> RefinedCorners:
    chi2 = cell_chi2(picture, edges, cells, camera)
    if chi2 is None:
        return edges
    return replace(edges, covariance_px2=edges.covariance_px2 * max(chi2 / _EXPECTED_CHI2, 1.0))
