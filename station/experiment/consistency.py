"""Whether errors have the size that was claimed for them: normalised estimation error squared (NEES).

Bar-Shalom, Li and Kirubarajan, *Estimation with Applications to Tracking and Navigation*, section 5.4: the mean over N
independent runs of e^T P^-1 e, times N, is chi-square with 3 N degrees of freedom if P is honest.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

AXES = 3
_NORMAL_975 = 1.959964

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Nees:
    """NEES of one error from each flight."""

    mean: float
    count: int

    @property
    def bounds(self) -> tuple[float, float]:
        """Between these lies the mean of honest claims 95 times of 100."""
        return mean_bounds(self.count)

    @property
    def within(self) -> bool:
        """Whether it does."""
        low, high = self.bounds
        return low <= self.mean <= high


def nees(errors_m: Sequence[Array], covariances_m2: Sequence[Array]) -> Nees | None:
    """Of errors (3,) and their covariances (3, 3); None of nothing."""
    if not len(errors_m):
        return None
    scores = [float(e @ np.linalg.solve(P, e)) for e, P in zip(errors_m, covariances_m2, strict=True)]
    return Nees(float(np.mean(scores)), len(scores))


def mean_bounds(count: int) -> tuple[float, float]:
    """2.5 and 97.5 % quantiles of the mean of `count` chi-square numbers of three degrees of freedom (Wilson and Hilferty, 1931)."""
    part = 2.0 / (9.0 * AXES * count)
    low, high = (AXES * (1.0 - part + sign * _NORMAL_975 * part**0.5) ** 3 for sign in (-1.0, 1.0))
    return low, high
