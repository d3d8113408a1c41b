"""How a pad's coordinates, and the errors that fixes share, change while time passes."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from schemas.settings.filter import Kalman

Array = NDArray[np.float64]

PLACE, DRIFT, SHARED = slice(0, 3), slice(3, 6), slice(6, 17)
SIZE = 17
"""Place (3), drift (3), lasting errors (11) in the order of the columns of `Sighting.H`."""
_INTERVALS = 8
"""So many are kept: a camera's period in whole nanoseconds is now one more, now one less, and twice as long where a frame was lost."""


class PadMotion:
    """The motion of the state of a `PadTrack`.

    The drift is a first-order Gauss-Markov process and the place its integral (van Loan's integrals in closed form), plus a random
    walk of the place; each lasting error is a Gauss-Markov process of unit variance.
    """

    def __init__(self, settings: Kalman, *, moving: bool) -> None:
        drift2 = settings.drift_mps**2
        pad2 = settings.pad_mps**2 if moving else 0.0
        self.rate_variances = (drift2 + pad2, drift2 + pad2, drift2)
        """Of the drift on each axis, (m/s)^2."""
        self._rate_time_s = settings.pad_time_s if moving else settings.drift_time_s
        self._wander2 = settings.wander_m**2
        self._times_s = (
            settings.attitude_time_s,
            settings.attitude_time_s,
            settings.heading_time_s,
            settings.lens_time_s,
            settings.lens_time_s,
            settings.lens_time_s,
            settings.timing_time_s,
            settings.size_time_s,
            settings.height_time_s,
            settings.mount_time_s,
            settings.mount_time_s,
        )
        self._azimuth_wander2 = math.radians(settings.azimuth_wander_deg) ** 2
        self._known = lru_cache(maxsize=_INTERVALS)(self._computed)

    def over(self, ahead_s: float) -> tuple[Array, Array]:
        """The transition F and the covariance Q of what comes to it, (17, 17) each: x' = F x, P' = F P F^T + Q. Not to be changed."""
        return self._known(ahead_s)

    def azimuth_variance(self, ahead_s: float) -> float:
        """What is added to that of the azimuth, rad^2."""
        return self._azimuth_wander2 * ahead_s

    def _computed(self, ahead_s: float) -> tuple[Array, Array]:
        time_s = self._rate_time_s
        keep = math.exp(-ahead_s / time_s)
        faded = [math.exp(-ahead_s / each_s) for each_s in self._times_s]
        walked_s2 = time_s**2 * max(0.0, 2.0 * ahead_s / time_s - 3.0 + 4.0 * keep - keep * keep)
        together_s = time_s * (1.0 - keep) ** 2
        F, Q = np.zeros(SIZE * SIZE), np.zeros(SIZE * SIZE)
        F[:: SIZE + 1] = [1.0, 1.0, 1.0, keep, keep, keep, *faded]
        Q[:: SIZE + 1] = [
            *(variance * walked_s2 + self._wander2 * ahead_s for variance in self.rate_variances),
            *(variance * (1.0 - keep * keep) for variance in self.rate_variances),
            *(1.0 - each * each for each in faded),
        ]
        # The blocks (place, drift) and (drift, place), by their diagonals.
        F[3 : 3 * SIZE + 3 : SIZE + 1] = time_s * (1.0 - keep)
        Q[3 : 3 * SIZE + 3 : SIZE + 1] = Q[3 * SIZE : 6 * SIZE : SIZE + 1] = [
            variance * together_s for variance in self.rate_variances
        ]
        return F.reshape(SIZE, SIZE), Q.reshape(SIZE, SIZE)
