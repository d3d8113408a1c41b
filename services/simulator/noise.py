"""Random processes that are cheap enough for every step."""

import math

import numpy as np

BLOCK = 4096


class Normals:
    """Standard normal numbers one at a time, drawn from the generator in blocks."""

    def __init__(self, generator: np.random.Generator) -> None:
        self._generator = generator
        self._block: list[float] = []

    def next(self) -> float:
        """The next number."""
        if not self._block:
            self._block = self._generator.standard_normal(BLOCK).tolist()
        return self._block.pop()


class GaussMarkov:
    """First-order Gauss-Markov process: exponentially correlated noise, stationary from the first sample on."""

    def __init__(self, normals: Normals, sigma: float, time_s: float, step_s: float) -> None:
        self._normals = normals
        self._keep = math.exp(-step_s / time_s)
        self._drive = sigma * math.sqrt(1.0 - self._keep * self._keep)
        self.value = sigma * normals.next()
        """The newest sample, in the unit of `sigma`."""

    def advance(self) -> None:
        """Go one step on."""
        self.value = self._keep * self.value + self._drive * self._normals.next()


class SmoothGaussMarkov:
    """First-order Gauss-Markov process behind a low-pass: it has a velocity. Stationary from the first sample on.

    Its standard deviation is `sigma` whatever the low-pass: the process before it is larger by sqrt(1 + smoothing / time)
    (variance of an exponentially correlated process after a first-order lag).
    """

    def __init__(self, normals: Normals, sigma: float, time_s: float, smoothing_s: float, step_s: float) -> None:
        larger = math.sqrt(1.0 + smoothing_s / time_s)
        self._source = GaussMarkov(normals, sigma * larger, time_s, step_s)
        self._keep = math.exp(-step_s / smoothing_s)
        # Of two jointly normal numbers the second, given the first: both have covariance sigma^2 by the lag's response.
        rest = sigma * math.sqrt(1.0 - 1.0 / larger**2)
        self.value = self._source.value / larger**2 + rest * normals.next()
        """The newest sample, in the unit of `sigma`."""

    def advance(self) -> None:
        """Go one step on."""
        self._source.advance()
        self.value = self._keep * self.value + (1.0 - self._keep) * self._source.value
