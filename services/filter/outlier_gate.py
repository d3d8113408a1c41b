"""Keeps gross outliers from the window, and notices when it is the estimate that is wrong."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from alight.geometry.local import ned_between
from schemas.settings.filter import OutlierGate as OutlierGateSettings
from services.filter.entry import Entry


def squared_distance(entry: Entry, reference: Entry) -> float:
    """Squared Mahalanobis distance of position and azimuth, both entries being uncertain; four degrees of freedom."""
    apart: NDArray[np.float64] = ned_between(reference.position, entry.position)
    position = float(apart @ np.linalg.solve(entry.covariance_ned_m2 + reference.covariance_ned_m2, apart))
    turn = math.remainder(entry.azimuth_rad - reference.azimuth_rad, math.tau)
    variance = entry.azimuth_variance_rad2 + reference.azimuth_variance_rad2
    return position + (turn**2 / variance if variance > 0.0 else 0.0)


class OutlierGate:
    """Judges each fix by its distance from a reference: the newest estimate."""

    def __init__(self, settings: OutlierGateSettings) -> None:
        self._limit = settings.sigma**2
        self._outcomes: deque[bool] = deque(maxlen=settings.memory)
        self._reference: Entry | None = None

    @property
    def has_reference(self) -> bool:
        """Whether there is anything to judge by."""
        return self._reference is not None

    def refer_to(self, reference: Entry) -> None:
        """Judge by this from now on; its covariance should be the whole one, with what does not average out."""
        self._reference = reference

    def clear(self) -> None:
        """Forget the estimate and all outcomes: everything passes until there is a new one."""
        self._reference = None
        self._outcomes.clear()

    def admits(self, entry: Entry) -> bool:
        """Whether the fix may be the pad."""
        if self._reference is None or self._limit == 0.0:
            return True
        admitted = squared_distance(entry, self._reference) <= self._limit
        self._outcomes.append(admitted)
        return admitted

    @property
    def outvoted(self) -> bool:
        """Whether most of the last fixes contradict the estimate."""
        rejected = self._outcomes.count(False)
        return self._outcomes.maxlen is not None and 2 * rejected > self._outcomes.maxlen
