"""Mean and median of the entries of a window, with the covariance that is left."""

import math
from collections.abc import Sequence

import numpy as np

from alight.geometry.circular import circular_mean, circular_median
from alight.geometry.local import moved_by_ned, ned_between
from schemas.settings.filter import Method
from services.filter.entry import Entry

MEDIAN_INEFFICIENCY = math.pi / 2
"""Variance of the median over that of the mean, for many normal errors."""


def averaged(entries: Sequence[Entry], method: Method) -> Entry:
    """One entry out of many: for `none` the newest, for `median` the median, else the mean.

    Positions are averaged in the tangent plane of the newest one, axis by axis, height included; azimuths on the circle.
    The entries' errors are taken as independent: what they have in common is not in `Entry.covariance_ned_m2`.

    Raises:
        ValueError: If the average is no place on the earth.
    """
    newest = entries[-1]
    if method == "none":
        return newest
    vectors = np.array([ned_between(newest.position, entry.position) for entry in entries])
    azimuths = [entry.azimuth_rad for entry in entries]
    count = len(entries)
    variance_factor = 1.0 / count**2
    if method == "median":
        centre, azimuth_rad = np.median(vectors, axis=0), circular_median(azimuths)
        variance_factor *= MEDIAN_INEFFICIENCY if count > 2 else 1.0
    else:
        centre, azimuth_rad = vectors.mean(axis=0), circular_mean(azimuths)
    return Entry(
        position=moved_by_ned(newest.position, centre),
        azimuth_rad=azimuth_rad,
        covariance_ned_m2=variance_factor * np.sum([entry.covariance_ned_m2 for entry in entries], axis=0),
        azimuth_variance_rad2=variance_factor * math.fsum(entry.azimuth_variance_rad2 for entry in entries),
    )
