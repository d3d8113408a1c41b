"""Random numbers: one generator for each purpose, all from the one seed in the settings."""

import zlib

import numpy as np


def generator(seed: int, purpose: str) -> np.random.Generator:
    """A generator that depends on the seed and on what it is for, so that adding one leaves the others as they were.

    Args:
        seed: `Settings.seed`.
        purpose: Stable name, such as `camera.noise`.
    """
    return np.random.default_rng([seed, zlib.crc32(purpose.encode())])
