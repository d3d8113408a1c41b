"""Where the pad was, in hindsight: the reference where there is no ground truth."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from alight.geometry.local import moved_by_ned, ned_between
from schemas.fix import FixVerdict, PadFix
from schemas.message import GlobalPosition

FEWEST_FIXES = 10
_ROUNDS = 10
_HUBER = 2.0
_VARIANCE_FLOOR_M2 = 1e-6

Array = NDArray[np.float64]


def smoothed_pad(fixes: Sequence[PadFix]) -> GlobalPosition | None:
    """The place that all fixes of a flight agree on best; None if there are too few.

    The pad does not move, so that its smoothed place is one least squares over all fixes, each weighted by its own
    covariance, with Huber's weights against outliers (Huber, "Robust estimation of a location parameter", 1964). What is
    wrong in all fixes alike stays in it.
    """
    usable = [
        (fix.corrected.position, np.array(fix.covariance_ned_m2).reshape(3, 3))
        for fix in fixes
        if fix.verdict is FixVerdict.ACCEPTED and fix.corrected and fix.covariance_ned_m2
    ]
    if len(usable) < FEWEST_FIXES:
        return None
    origin = usable[0][0]
    places_m = np.array([ned_between(origin, place) for place, _ in usable])
    information = np.linalg.inv(np.array([covariance for _, covariance in usable]) + _VARIANCE_FLOOR_M2 * np.eye(3))
    north, east, down = _robust_mean(places_m, np.asarray(information, float)).tolist()
    return moved_by_ned(origin, (north, east, down))


def _robust_mean(places_m: Array, information: Array) -> Array:
    mean_m: Array = np.median(places_m, axis=0)
    for _ in range(_ROUNDS):
        apart_m = places_m - mean_m
        distance = np.sqrt(np.einsum("ni,nij,nj->n", apart_m, information, apart_m))
        weighted = information * np.minimum(1.0, _HUBER / np.maximum(distance, 1e-12))[:, None, None]
        solved = np.linalg.solve(weighted.sum(axis=0), np.einsum("nij,nj->i", weighted, places_m))
        mean_m = np.asarray(solved, float)
    return mean_m
