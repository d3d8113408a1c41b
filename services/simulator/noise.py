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
