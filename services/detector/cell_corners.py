"""Corners by what is inside a marker: where its black and white cells meet. What covers its outline does not move them."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from services.detector.edge_corners import Outline, RefinedCorners

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_CELL_PX = 4.0
"""Borders of smaller cells lean on each other through the blur."""
_COARSE_REACHES_CELLS = (0.45, 0.3, 0.2)
"""How far to each side of a border the profiles go, pass by pass, while the corners may be off by a cell."""
_REACH_CELLS, _WIDEST_REACH_PX = 0.42, 4.0
"""How far they go when the corners are about right."""
_FINE_PASSES = 4
_STEPS = 13
_LEAST_CONTRAST = 12.0
_CONTRAST_PART = 0.4
_FEWEST_BORDERS = 14
_FEWEST_KEPT = 0.6
_OUTLIER_SIGMAS = 3.5
_LEAST_TOLERANCE_PX = 0.15
_MEDIAN_TO_SIGMA = 1.4826
_FITS = 3
_MODEL_SIGMA_PX = 0.03
_SETTLED_PX = 0.5
_SQUARE = np.array(((0, 0), (1, 0), (1, 1), (0, 1)), np.float32)
_STEP = 1e-4
"""For derivatives through the lens, undistorted x/z or y/z: a thirtieth of a pixel or so."""


@dataclass(frozen=True)
class _Move:
    """By how much corners should move for the cells to lie where the picture has them."""

    move_px: Array
    """(4, 2)."""
    covariance_px2: Array
    """(8, 8), of x, y of the four."""


@dataclass(frozen=True)
class _Seen:
    """Borders that the picture shows."""

    rows: Array
    """(m, 8): how far a border goes along its normal with x, y of each corner."""
    offsets_px: Array
    """(m,): how far it should."""


@dataclass(frozen=True)
class _Borders:
    """Where two cells inside the outline are neighbours, in parts of the marker's side."""

    points: Array
    """(N + M + 4, 1, 2): the crossings of the lines between cells, then the middles of the borders, then the corners."""
    ends: NDArray[np.intp]
    """(2, M): the crossings between which a border lies."""
    places: Array
    """(M + 4, 3): middles and corners once more, each with a 1 behind it."""


def cells_tell(corners_px: Array, cells: int) -> bool:
    """Whether a marker with these corners, (4, 2), has cells that are large enough to be followed."""
    sides = corners_px - corners_px[[3, 0, 1, 2]]
    return float(np.sqrt((sides**2).sum(axis=1).min())) >= _LEAST_CELL_PX * cells


def corners_by_cells(
    picture: NDArray[np.uint8], corners_px: Array, cells: int, camera: PinholeCamera | None
) -> RefinedCorners | None:
    """The corners to which the cells point.

    Args:
        picture: (height, width), grey levels.
        corners_px: (4, 2), in order around the marker, wrong by half a cell or so.
        cells: Cells along one side, border included.
        camera: Tells how the lens bends the marker; None takes it as straight.

    Returns:
        None if the borders between cells cannot be made out, or do not agree.
    """
    begun = Outline.of(corners_px, camera)
    settled = _settled(picture, begun, cells, camera, passes=1)
    if settled is not None:
        return settled
    for reach_cells in _COARSE_REACHES_CELLS:
        move = _move(picture, begun, cells, camera, reach_cells)
        if move is None:
            return None
        begun = Outline.of(begun.corners_px + move.move_px, camera)
    return _settled(picture, begun, cells, camera, passes=_FINE_PASSES)


def _settled(
    picture: NDArray[np.uint8], begun: Outline, cells: int, camera: PinholeCamera | None, passes: int
) -> RefinedCorners | None:
    """The corners that another pass would hardly move; None if so many do not find them."""
    for left in reversed(range(passes)):
        move = _move(picture, begun, cells, camera)
        if move is None:
            return None
        corners_px = begun.corners_px + move.move_px
        if float(np.abs(move.move_px).max()) < _SETTLED_PX:
            return RefinedCorners(corners_px, move.covariance_px2, begun)
        if left:
            begun = Outline.of(corners_px, camera)
    return None


def cell_chi2(
    picture: NDArray[np.uint8], corners: RefinedCorners, cells: int, camera: PinholeCamera | None
) -> float | None:
    """How far the corners are from where the cells have them: squared, over what both claim; 8 is to be expected.

    Args:
        picture: (height, width), grey levels.
        corners: By the edges.
        cells: Cells along one side, border included.
        camera: Tells how the lens bends the marker; None takes it as straight.

    Returns:
        None if too few borders between cells can be made out.
    """
    seen = _seen(picture, corners.begun, cells, camera)
    if seen is None:
        return None
    # What the corners have moved since is known, and what does not go with it is no part of the question.
    rows, offsets = seen.rows, seen.offsets_px - seen.rows @ (corners.corners_px - corners.begun.corners_px).ravel()
    kept = np.abs(offsets) <= _tolerance_px(np.abs(offsets))
    if int(kept.sum()) < _FEWEST_BORDERS:
        return None
    used, asked = rows[kept], offsets[kept]
    try:
        inverse = np.asarray(np.linalg.inv(used.T @ used), np.float64)
    except np.linalg.LinAlgError:
        return None
    move = inverse @ (used.T @ asked)
    covariance = _covariance(inverse, np.abs(asked - used @ move)) + corners.covariance_px2
    return float(move @ np.linalg.solve(covariance, move))


def _move(
    picture: NDArray[np.uint8],
    outline: Outline,
    cells: int,
    camera: PinholeCamera | None,
    reach_cells: float | None = None,
) -> _Move | None:
    seen = _seen(picture, outline, cells, camera, reach_cells)
    return _fitted(seen) if seen is not None else None


def _seen(
    picture: NDArray[np.uint8],
    outline: Outline,
    cells: int,
    camera: PinholeCamera | None,
    reach_cells: float | None = None,
) -> _Seen | None:
    """Measure the borders, with a reach as for corners that are about right unless another is given; None if too few can be made out."""
    if not np.isfinite(outline.straight).all():
        return None
    borders = _borders(cells)
    H = np.asarray(cv2.getPerspectiveTransform(_SQUARE, outline.straight.astype(np.float32)), np.float64)
    straight = np.asarray(cv2.perspectiveTransform(borders.points, H), float).reshape(-1, 2)
    points, stretches = _through_lens(straight, len(borders.places), camera)
    if not np.isfinite(points).all():
        return None
    begin, end = points[borders.ends]
    along = end - begin
    lengths = np.sqrt((along**2).sum(axis=1))
    normals = np.column_stack((along[:, 1], -along[:, 0])) / lengths[:, None]
    cell_px = float(lengths.min())
    reach_px = min(_REACH_CELLS * cell_px, _WIDEST_REACH_PX) if reach_cells is None else reach_cells * cell_px
    offsets, good = _offsets(picture, points[-len(borders.places) : -4], normals, reach_px)
    if int(good.sum()) < _FEWEST_BORDERS:
        return None
    slopes: Array = np.matmul(stretches, _slopes(borders.places, H))
    of_borders = normals[:, :1] * slopes[:-4, 0] + normals[:, 1:] * slopes[:-4, 1]
    try:
        rows = of_borders[good] @ np.linalg.inv(slopes[-4:].reshape(8, 8))
    except np.linalg.LinAlgError:
        return None
    return _Seen(rows, offsets[good])


@lru_cache(maxsize=8)
def _borders(cells: int) -> _Borders:
    lines = np.arange(1, cells) / cells
    x, y = np.meshgrid(lines, lines)
    number = np.arange(x.size).reshape(x.shape)
    across = np.stack((number[:, :-1].ravel(), number[:, 1:].ravel()))
    down = np.stack((number[:-1].ravel(), number[1:].ravel()))
    ends = np.hstack((across, down))
    crossings = np.stack((x.ravel(), y.ravel()), axis=1)
    places = np.vstack((crossings[ends].mean(axis=0), _SQUARE))
    points = np.vstack((crossings, places))[:, None]
    return _Borders(points, ends, np.column_stack((places, np.ones(len(places)))))


def _through_lens(straight: Array, last: int, camera: PinholeCamera | None) -> tuple[Array, Array]:
    """Pixels of undistorted points (N, 2), and the pixels' derivatives by these for the last of them, (last, 2, 2)."""
    if camera is None:
        return straight, np.broadcast_to(np.eye(2), (last, 2, 2))
    beside = straight[-last:]
    seen = camera.pixels(
        np.concatenate((straight, beside + _STEP * np.array((1.0, 0.0)), beside + _STEP * np.array((0.0, 1.0))))
    )
    points, right, below = seen[: len(straight)], seen[len(straight) : -last], seen[-last:]
    return points, np.stack((right - points[-last:], below - points[-last:]), axis=2) / _STEP


def _slopes(places: Array, H: Array) -> Array:
    """Derivatives of where a homography takes places (N, 3) by its first eight elements, (N, 2, 8)."""
    x, y, w = H @ places.T
    on = places / w[:, None]
    slopes = np.zeros((len(places), 2, 8))
    slopes[:, 0, 0:3] = slopes[:, 1, 3:6] = on
    slopes[:, 0, 6:] = -on[:, :2] * (x / w)[:, None]
    slopes[:, 1, 6:] = -on[:, :2] * (y / w)[:, None]
    return slopes


def _offsets(picture: NDArray[np.uint8], places: Array, normals: Array, reach_px: float) -> tuple[Array, Flags]:
    """How far along its normal from each place the brightness passes the middle, pixels, and where there is a border at all."""
    across = np.linspace(-reach_px, reach_px, _STEPS)
    where = (places[:, None] + across[:, None] * normals[:, None]).astype(np.float32)
    sampled = cv2.remap(picture, where, np.empty(0, np.float32), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    profile = np.asarray(sampled, float)
    first = (profile[:, 0] + profile[:, 1]) / 2.0
    contrast = (profile[:, -2] + profile[:, -1]) / 2.0 - first
    size = np.abs(contrast)
    # Half of the neighbours or so are of the same colour.
    strong = float(np.partition(size, -len(size) // 5)[-len(size) // 5])
    good = size > max(_CONTRAST_PART * strong, _LEAST_CONTRAST)
    beyond = profile.sum(axis=1) - (profile[:, 0] + profile[:, -1]) / 2.0 - first * (_STEPS - 1)
    offsets = reach_px - beyond / np.where(good, contrast, 1.0) * (across[1] - across[0])
    outer = where[:, (0, -1)]
    good &= ((outer >= 0.0) & (outer <= np.array(picture.shape[::-1]) - 1.0)).all(axis=(1, 2))
    good &= np.abs(offsets) < reach_px
    return offsets, good


def _fitted(seen: _Seen) -> _Move | None:
    """Least squares, again without what lies far off: what covers some cells, or borders that were taken for others."""
    kept = np.ones(len(seen.offsets_px), bool)
    fewest = max(_FEWEST_BORDERS, _FEWEST_KEPT * len(kept))
    for _ in range(_FITS):
        used = seen.rows[kept]
        try:
            inverse = np.asarray(np.linalg.inv(used.T @ used), np.float64)
        except np.linalg.LinAlgError:
            return None
        move = inverse @ (used.T @ seen.offsets_px[kept])
        residuals: Array = np.abs(seen.offsets_px - seen.rows @ move)
        near = residuals <= _tolerance_px(residuals)
        if int(near.sum()) < fewest:
            return None
        if bool((near == kept).all()):
            break
        kept = near
    return _Move(move.reshape(4, 2), _covariance(inverse, residuals))


def _tolerance_px(residuals: Array) -> float:
    """Beyond which a border is another one, or covered."""
    return max(_OUTLIER_SIGMAS * _MEDIAN_TO_SIGMA * _median(residuals), _LEAST_TOLERANCE_PX)


def _covariance(inverse: Array, residuals: Array) -> Array:
    """Of the corners, (8, 8), from the inverse of the normal matrix and what is left of the borders' offsets, pixels."""
    spread2 = (_MEDIAN_TO_SIGMA * _median(residuals)) ** 2 * len(residuals) / (len(residuals) - 8.0)
    covariance: Array = (spread2 + _MODEL_SIGMA_PX**2) * inverse
    return covariance


def _median(values: Array) -> float:
    """The upper one of two in the middle; NumPy's own takes ten times as long for so few."""
    return float(np.partition(values, len(values) // 2)[len(values) // 2])
