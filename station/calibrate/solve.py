"""From views to a camera: the least-squares solution, how sure each number is, and how well it does on views it has not seen."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from station.calibrate.views import View

Array = NDArray[np.float64]
SizePx = tuple[int, int]

NAMES = ("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3")
OUTLIER = 3.0
"""A view that fits this many times worse than the middle one is left out, the worst first, but no more than `MOST_OUTLIERS`."""
MOST_OUTLIERS = 0.2
"""Part of the views. If more than that do not fit, it is not the views that are wrong."""

_MOST_FOLDS = 12
_FEWEST_VIEWS = 3


class SolveError(ValueError):
    """No camera explains the views; in one line why."""


@dataclass(frozen=True)
class Solution:
    """A calibrated camera."""

    size_px: SizePx
    values: Array
    """(9,), in the order of `NAMES`."""
    sigmas: Array
    """(9,), one standard deviation each: the larger of what the corners' noise and what leaving views out (jackknife) says."""
    rms_px: float
    """Root mean square reprojection error over the views that it was solved with."""
    held_out_rms_px: float
    """The same over views that were left out in turn, each with a camera that was solved without it."""
    view_rms_px: tuple[float, ...]
    tilts_rad: tuple[float, ...]
    """Of each view: between the board's normal and the optical axis."""
    views: tuple[View, ...]
    outliers: tuple[View, ...]
    """Views that were left out because they do not fit."""

    @property
    def matrix(self) -> Array:
        """(3, 3)."""
        return _matrix(self.values)


def solve(views: Sequence[View], size_px: SizePx) -> Solution:
    """Calibrate, once more without the views that do not fit, and cross-validate.

    Raises:
        SolveError: If there are too few views, or no solution.
    """
    fit = _fit(views, size_px)
    limit_px = OUTLIER * float(np.median(fit.view_rms_px))
    worst_first = np.argsort(fit.view_rms_px)[::-1][: int(MOST_OUTLIERS * len(views))]
    out = {int(index) for index in worst_first if fit.view_rms_px[index] > limit_px}
    outliers = [view for index, view in enumerate(views) if index in out]
    kept = [view for index, view in enumerate(views) if index not in out]
    if outliers:
        fit = _fit(kept, size_px)
    held_out_rms_px, jackknife = _cross_validated(kept, size_px, fit)
    return Solution(
        size_px=size_px,
        values=fit.values,
        sigmas=np.maximum(fit.sigmas, jackknife),
        rms_px=fit.rms_px,
        held_out_rms_px=held_out_rms_px,
        view_rms_px=fit.view_rms_px,
        tilts_rad=fit.tilts_rad,
        views=tuple(kept),
        outliers=tuple(outliers),
    )


@dataclass(frozen=True)
class _Fit:
    values: Array
    sigmas: Array
    rms_px: float
    view_rms_px: tuple[float, ...]
    tilts_rad: tuple[float, ...]


def _fit(views: Sequence[View], size_px: SizePx, begin: Array | None = None) -> _Fit:
    if len(views) < _FEWEST_VIEWS:
        raise SolveError(f"{len(views)} views are left, at least {_FEWEST_VIEWS} are needed to solve at all")
    points = [view.corners.points_m.astype(np.float32).reshape(-1, 1, 3) for view in views]
    pixels = [view.corners.pixels.astype(np.float32).reshape(-1, 1, 2) for view in views]
    try:
        rms_px, matrix, distortion, turns, _, sigmas, _, per_view = cv2.calibrateCameraExtended(
            points,
            pixels,
            size_px,
            np.eye(3) if begin is None else _matrix(begin),
            np.zeros(5) if begin is None else begin[4:].copy(),
            flags=0 if begin is None else cv2.CALIB_USE_INTRINSIC_GUESS,
        )
    except cv2.error as error:
        raise SolveError(f"no camera explains the views: {str(error).strip().splitlines()[-1][:200]}") from None
    values = np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *np.ravel(distortion)[:5]])
    if not (np.isfinite(values).all() and (values[:2] > 0.0).all()):
        raise SolveError("no camera explains the views: the solution is not finite")
    tilts = [float(np.arccos(min(abs(cv2.Rodrigues(turn)[0][2, 2]), 1.0))) for turn in turns]
    return _Fit(
        values, np.asarray(np.ravel(sigmas)[:9], float), float(rms_px), tuple(np.ravel(per_view).tolist()), tuple(tilts)
    )


def _cross_validated(views: Sequence[View], size_px: SizePx, whole: _Fit) -> tuple[float, Array]:
    """Leave every view out once, in folds: the error there, and how much the camera changes (grouped jackknife)."""
    folds = min(len(views), _MOST_FOLDS)
    squares, count, cameras = 0.0, 0, []
    for fold in range(folds):
        inside = [view for index, view in enumerate(views) if index % folds != fold]
        if len(inside) < _FEWEST_VIEWS:
            return float("inf"), np.full(len(NAMES), np.inf)
        try:
            fit = _fit(inside, size_px, whole.values)
        except SolveError:
            return float("inf"), np.full(len(NAMES), np.inf)
        cameras.append(fit.values)
        for view in views[fold::folds]:
            errors = board_errors(view, fit.values)
            squares, count = squares + float((errors**2).sum()), count + len(errors)
    scatter = np.array(cameras) - whole.values
    return float(np.sqrt(squares / count)), np.sqrt((folds - 1) / folds * (scatter**2).sum(axis=0))


def board_errors(view: View, values: Array) -> Array:
    """Distances between seen and reprojected corners, (N,), pixels, with the board where it fits best."""
    matrix, distortion = _matrix(values), values[4:]
    points, pixels = view.corners.points_m, view.corners.pixels
    found, turn, shift = cv2.solvePnP(points, pixels, matrix, distortion)
    if not found:
        return np.full(len(pixels), np.inf)
    projected, _ = cv2.projectPoints(points, turn, shift, matrix, distortion)
    return np.asarray(np.linalg.norm(projected.reshape(-1, 2) - pixels, axis=1))


def _matrix(values: Array) -> Array:
    fx, fy, cx, cy = values[:4]
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
