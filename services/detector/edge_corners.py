"""Corners sharper than a contour gives them: lines fitted to the four edges of the marker, and where these cross."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_REACHES_PX = ((1.2, 6.0), (1.0, 3.0), (1.0, 3.0))
"""How far to each side of an edge the profiles go, at least and at most, pass by pass: first a contour's errors must fit in."""
_REACH_CELLS = 0.6
_SETTLED_PX = 0.15
_STEPS_PER_PX = 2
_MOST_SAMPLES = 32
_FEWEST_SAMPLES = 5
_LEAST_CONTRAST = 12.0
_LARGEST_MOVE_CELLS = 1.0
_LARGEST_LAST_MOVE_PX = 0.5
_MODEL_SIGMA_PX = 0.015
_LEAK_SIGMA_PX = 0.7


@dataclass(frozen=True)
class Outline:
    """Four corners in the picture and before the lens."""

    corners_px: Array
    """(4, 2), pixels."""
    straight: Array
    """(4, 2), undistorted x/z, y/z; without a camera the same pixels."""

    @classmethod
    def of(cls, corners_px: Array, camera: PinholeCamera | None) -> Self:
        """Corners as this lens has bent them."""
        return cls(corners_px, corners_px if camera is None else camera.undistorted(corners_px))


@dataclass(frozen=True)
class RefinedCorners:
    """Four corners and how sure they are."""

    corners_px: Array
    """(4, 2), pixels."""
    covariance_px2: Array
    """(8, 8), of x, y of the four: large for a corner out of the picture, to which the edges had to be drawn out."""
    begun: Outline
    """Where the last pass began, a fraction of a pixel away."""
    support: float = 0.0
    """The share of its length that bears an edge out, of the edge of which the least does; 0 where they do not come from edges."""

    @property
    def sigma_px(self) -> float:
        """Standard deviation of a coordinate, root mean square over all, pixels."""
        return float(np.sqrt(np.trace(self.covariance_px2) / 8.0))


@dataclass(frozen=True)
class _Lines:
    at_ends_px: Array
    """(4, 2): how far outward of its start and of its end each edge is."""
    covariances_px2: Array
    """(4, 2, 2), of these."""
    support: float
    """The least share of an edge's profiles that its line goes through."""


@dataclass(frozen=True)
class _Fit:
    begun: Outline
    corners_px: Array
    moved_px: float
    lines: _Lines
    corners_from_lines: Array
    """(4, 2, 2): what makes a corner's move of what the edge that ends there and the one that begins there ask for."""


def refined_corners(
    picture: NDArray[np.uint8], corners_px: Array, cells: int, camera: PinholeCamera | None
) -> RefinedCorners | None:
    """Fit the marker's edges.

    Args:
        picture: (height, width), grey levels.
        corners_px: (4, 2), in order around the marker, wrong by less than half a cell.
        cells: Cells along one side, border included; an edge's profile must not reach the next cell.
        camera: Tells how the lens bends the edges; None takes them as straight.

    Returns:
        None if the edges cannot be made out, or lie somewhere else.
    """
    cell_px = float(np.linalg.norm(corners_px - np.roll(corners_px, -1, axis=0), axis=1).min()) / cells
    corners = corners_px
    fit: _Fit | None = None
    for narrowest_px, widest_px in _REACHES_PX:
        fit = _one_pass(picture, corners, min(max(_REACH_CELLS * cell_px, narrowest_px), widest_px), camera)
        if fit is None:
            return None
        corners, first = fit.corners_px, corners is corners_px
        if not first and fit.moved_px < _SETTLED_PX:
            break
    moved_px = float(np.abs(corners - corners_px).max())
    if fit is None or moved_px > max(_LARGEST_MOVE_CELLS * cell_px, 1.5) or fit.moved_px > _LARGEST_LAST_MOVE_PX:
        return None
    # Cells of a few pixels leak into the edge through the blur.
    leak_px2 = (_LEAK_SIGMA_PX / cell_px**3) ** 2
    return RefinedCorners(corners, _covariance(fit) + leak_px2 * np.eye(8), fit.begun, fit.lines.support)


def _covariance(fit: _Fit) -> Array:
    """Of the corners, (8, 8): neighbours share an edge."""
    whole, slopes = np.zeros((8, 8)), np.zeros((8, 8))
    for corner in range(4):
        edge, rows = 2 * corner, slice(2 * corner, 2 * corner + 2)
        whole[rows, rows] = fit.lines.covariances_px2[corner]
        # Column `edge` is the edge's start, the one before it the end of the edge before.
        slopes[rows, edge - 1] = fit.corners_from_lines[corner, :, 0]
        slopes[rows, edge] = fit.corners_from_lines[corner, :, 1]
    covariance: Array = slopes @ whole @ slopes.T
    return covariance


def _one_pass(
    picture: NDArray[np.uint8], corners_px: Array, reach_px: float, camera: PinholeCamera | None
) -> _Fit | None:
    """Measure where the edges are, and move the corners there."""
    ends = np.roll(corners_px, -1, axis=0)
    direction = ends - corners_px
    lengths = np.sqrt((direction**2).sum(axis=1))
    shortest_px = max(float(lengths.min()), 1.0)
    normals = np.column_stack((direction[:, 1], -direction[:, 0])) / lengths[:, None]
    count = int(min(max(shortest_px - 2.0 * reach_px, _FEWEST_SAMPLES), _MOST_SAMPLES))
    margin = min(reach_px / shortest_px, 0.25)
    along = margin + (1.0 - 2.0 * margin) * (np.arange(count) + 0.5) / count
    begun = Outline.of(corners_px, camera)
    points = _edge_points(begun.straight, along, camera)
    offsets, good = _edge_offsets(picture, points, normals, reach_px)
    lines = _lines(along, offsets, good)
    if lines is None:
        return None
    # Corner i moves by what the edge that ends there and the edge that begins there ask for along their normals.
    before = np.roll(normals, 1, axis=0)
    asked = np.stack((np.roll(lines.at_ends_px[:, 1], 1), lines.at_ends_px[:, 0]), axis=1)
    matrices = np.stack((before, normals), axis=1)
    if not (np.isfinite(asked).all() and float(np.abs(np.linalg.det(matrices)).min()) > 1e-2):
        return None
    inverses = np.linalg.inv(matrices)
    move = (inverses @ asked[..., None])[..., 0]
    return _Fit(begun, corners_px + move, float(np.abs(move).max()), lines, inverses)


def _edge_points(corners: Array, along: Array, camera: PinholeCamera | None) -> Array:
    """Points on the edges between undistorted corners, (4, n, 2), pixels: straight lines before the lens, bent as it bends them."""
    ends = np.roll(corners, -1, axis=0)
    straight: Array = corners[:, None] + along[None, :, None] * (ends - corners)[:, None]
    return straight if camera is None else camera.pixels(straight.reshape(-1, 2)).reshape(straight.shape)


def _edge_offsets(picture: NDArray[np.uint8], points: Array, normals: Array, reach_px: float) -> tuple[Array, Flags]:
    """How far outward of each point the brightness passes the middle between ink and board, pixels, and which to trust.

    The integral over the profile is used, not its steepest place: it takes every sample in and does not mind the blur.
    """
    steps = 2 * round(reach_px * _STEPS_PER_PX) + 1
    across = np.linspace(-reach_px, reach_px, steps)
    where = points[:, :, None] + across[None, None, :, None] * normals[:, None, None]
    flat = where.reshape(points.shape[0], -1, 2).astype(np.float32)
    sampled = cv2.remap(picture, flat, np.empty(0, np.float32), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    profile = np.asarray(sampled, float).reshape(where.shape[:3])
    ink = (profile[..., 0] + profile[..., 1]) / 2.0
    contrast = (profile[..., -1] + profile[..., -2]) / 2.0 - ink
    good = contrast > max(0.4 * float(np.median(contrast)), _LEAST_CONTRAST)
    bright = profile.sum(axis=2) - (profile[..., 0] + profile[..., -1]) / 2.0 - ink * (steps - 1)
    bright_px = bright / np.where(good, contrast, 1.0) * (across[1] - across[0])
    offsets = reach_px - bright_px
    # The whole profile has to be in the picture: what lies beyond its border is made up.
    inmost, outmost = np.zeros(2), np.array(picture.shape[::-1]) - 1.0
    outer = where[:, :, [0, -1]]
    good &= ((outer >= inmost) & (outer <= outmost)).all(axis=(2, 3)) & (np.abs(offsets) < reach_px)
    return np.where(good, offsets, 0.0), good


def _lines(along: Array, offsets: Array, good: Flags) -> _Lines | None:
    """A line through each edge's offsets, once more without what lies far off."""
    for _ in range(2):
        weights = good.astype(float)
        total = weights.sum(axis=1)
        if float(total.min()) < _FEWEST_SAMPLES:
            return None
        middle = (weights @ along) / total
        level = (weights * offsets).sum(axis=1) / total
        beside = along[None] - middle[:, None]
        breadth2 = np.maximum((weights * beside**2).sum(axis=1), 1e-12)
        slope = (weights * beside * offsets).sum(axis=1) / breadth2
        residuals = np.abs(offsets - level[:, None] - slope[:, None] * beside)
        spread2 = float((weights * residuals**2).sum() / max(float(total.sum()) - 8.0, 1.0))
        kept = good & (residuals <= max(3.0 * spread2**0.5, 0.05))
        if bool((kept == good).all()) or int(kept.sum(axis=1).min()) < _FEWEST_SAMPLES:
            break
        good = kept
    ends = np.stack((-middle, 1.0 - middle), axis=1)
    shares = 1.0 / total[:, None, None] + ends[:, :, None] * ends[:, None, :] / breadth2[:, None, None]
    covariances = spread2 * shares + _of_the_model(along, good)
    return _Lines(level[:, None] + slope[:, None] * ends, covariances, float(total.min()) / len(along))


def _of_the_model(along: Array, good: Flags) -> Array:
    """What no number of samples averages out, (4, 2, 2): an error of its own where each edge is first and last seen, drawn out to its ends."""
    first = np.where(good, along, 1.0).min(axis=1)
    last = np.where(good, along, 0.0).max(axis=1)
    ends = np.array((0.0, 1.0))
    parts = np.stack((last[:, None] - ends, ends - first[:, None]), axis=2) / (last - first)[:, None, None]
    covariances: Array = _MODEL_SIGMA_PX**2 * (parts @ parts.transpose(0, 2, 1))
    return covariances
