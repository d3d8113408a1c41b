"""What changes within a second, without what lasts longer."""

import numpy as np
from numpy.typing import NDArray

from station.biases.sightings import Array

HALF_WINDOW_S = 0.5
LEAST_NEIGHBOURS = 5


def high_passed(times_s: Array, series: Array, valid: NDArray[np.bool_]) -> Array:
    """Each sample minus the mean of the valid ones within half a second, (N, K); NaN where too few are near, or it is not valid itself.

    Linear in `series`: the residual's derivative passes through it as the residual does.

    Args:
        times_s: (N,), ascending.
        series: (N, K).
        valid: (N,), whether a sample counts.
    """
    sums = np.vstack([np.zeros(series.shape[1]), np.cumsum(np.where(valid[:, None], series, 0.0), axis=0)])
    counts = np.concatenate([[0], np.cumsum(valid)])
    first = np.searchsorted(times_s, times_s - HALF_WINDOW_S, side="left")
    after = np.searchsorted(times_s, times_s + HALF_WINDOW_S, side="right")
    near = counts[after] - counts[first]
    enough = valid & (near >= LEAST_NEIGHBOURS)
    mean = (sums[after] - sums[first]) / np.maximum(near, 1)[:, None]
    return np.where(enough[:, None], series - mean, np.nan)
