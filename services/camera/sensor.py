"""What lens and sensor make of the light: blur, vignetting, noise."""

import math
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from schemas.settings.camera import Optics

Picture = NDArray[np.uint8]

PIXEL_VARIANCE_PX2 = 1.0 / 12.0
"""Variance of a pixel's own area along one axis."""

_SPARE_PX = 256
_LEAST_BLUR_PX2 = 0.01


class Sensor:
    """Turns a drawn scene into a picture. Draws its random numbers from the generator that it is given."""

    def __init__(self, camera: PinholeCamera, optics: Optics, random: np.random.Generator) -> None:
        self._optics = optics
        self._random = random
        noise = random.standard_normal((camera.height_px + _SPARE_PX, camera.width_px + _SPARE_PX), np.float32)
        levels = np.rint(noise * np.float32(optics.noise_level))
        self._brighter = np.clip(levels, 0, 255).astype(np.uint8)
        self._darker = np.clip(-levels, 0, 255).astype(np.uint8)
        self._vignette = _vignette(camera, optics.vignetting) if optics.vignetting > 0.0 else None

    def expose(self, picture: Picture, blur_px2: float) -> Picture:
        """The picture as the sensor gives it.

        Args:
            picture: The scene, grey levels.
            blur_px2: Variance of the blur that drawing has already brought; the rest of the lens's blur and of the pixel's area
                is added.
        """
        if self._vignette is not None:
            picture = np.asarray(cv2.multiply(picture, self._vignette, scale=1.0 / 255.0), np.uint8)
        variance_px2 = self._optics.lens_blur_px**2 + PIXEL_VARIANCE_PX2 - blur_px2
        if variance_px2 > _LEAST_BLUR_PX2:
            kernel = blur_kernel(round(variance_px2, 3))
            picture = np.asarray(cv2.sepFilter2D(picture, -1, kernel, kernel), np.uint8)
        return self._with_noise(picture) if self._optics.noise_level > 0.0 else picture

    def _with_noise(self, picture: Picture) -> Picture:
        rows, columns = picture.shape
        top, left = self._random.integers(0, _SPARE_PX, 2).tolist()
        window = (slice(top, top + rows), slice(left, left + columns))
        noisy = cv2.subtract(cv2.add(picture, self._brighter[window]), self._darker[window])
        return np.asarray(noisy, np.uint8)


@lru_cache(maxsize=64)
def blur_kernel(variance_px2: float) -> NDArray[np.float32]:
    """A Gaussian blur of a picture that is already sampled, (2 n + 1,), sum 1.

    The sampled Gaussian, which is the usual kernel, blurs much too little where the standard deviation is below half a
    pixel. These taps are the least-squares fit of the Gaussian's frequency response up to the Nyquist frequency, weighted
    as edges weight it (1 / frequency).
    """
    reach = max(2, math.ceil(3.0 * math.sqrt(variance_px2)))
    frequency = (np.arange(256) + 0.5) / 512.0
    response = np.exp(-2.0 * np.pi**2 * variance_px2 * frequency**2)
    taps = np.arange(1, reach + 1)
    # With the middle tap as 1 minus the others, every tap adds 2 (cos - 1) to the response.
    basis = 2.0 * (np.cos(2.0 * np.pi * frequency[:, None] * taps) - 1.0)
    side, *_ = np.linalg.lstsq(basis / frequency[:, None], (response - 1.0) / frequency, rcond=None)
    return np.concatenate((side[::-1], [1.0 - 2.0 * side.sum()], side)).astype(np.float32)


def _vignette(camera: PinholeCamera, strength: float) -> Picture:
    x = (np.arange(camera.width_px) - camera.cx_px) / camera.fx_px
    y = (np.arange(camera.height_px) - camera.cy_px) / camera.fy_px
    cosine2 = 1.0 / (1.0 + x[None, :] ** 2 + y[:, None] ** 2)
    return np.rint(255.0 * (1.0 - strength * (1.0 - cosine2**2))).astype(np.uint8)
