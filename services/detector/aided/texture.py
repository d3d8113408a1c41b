"""The pattern drawn once for a blur, to be looked up at any place: many times as quick as working it out anew."""

import math
from collections import OrderedDict

import cv2
import numpy as np
from numpy.typing import NDArray

from services.detector.aided.pattern import Pattern

Array = NDArray[np.float64]
Field = NDArray[np.float32]

WHITE, BOARD, WHITE_U, WHITE_V, BOARD_U, BOARD_V, WHITE_UU, WHITE_VV, WHITE_UV = range(9)
"""What is drawn, in this order: shares of white and of board, and their derivatives by cells to the right (u) and down (v)."""

_NODES = 12
"""A cell. An edge of a cell lies on a node, so that reading between nodes blurs it and does not move it."""
_MARGIN_CELLS = 1.5
_LOG_STEP = 2.0**-4
"""Between two blurs that are drawn; between them the picture is continued to first order."""
_MOST_KEPT = 48


class PatternTexture:
    """Looks up shades of one pattern. What it answers depends on what it is asked alone, not on what it has drawn before."""

    def __init__(self, pattern: Pattern, log_step: float = _LOG_STEP) -> None:
        """Take the pattern and how far apart, as a logarithm, the blurs are that are drawn."""
        self._pattern = pattern
        self._log_step = log_step
        along = np.arange(round((pattern.count + 2.0 * _MARGIN_CELLS) * _NODES) + 1)
        self._places = along / _NODES - _MARGIN_CELLS
        self._drawn: OrderedDict[tuple[int, int], Field] = OrderedDict()

    def shades(self, u: Array, v: Array, blur_u: float, blur_v: float) -> Array:
        """All nine at places (u, v), each (N,), blurred with these standard deviations in cells.

        Returns:
            (9, N). White is that of the very blur, the others those of one within half a step of it.
        """
        number_u, number_v = round(math.log(blur_u) / self._log_step), round(math.log(blur_v) / self._log_step)
        texture = self._texture(number_u, number_v)
        x = ((u + _MARGIN_CELLS) * _NODES).astype(np.float32)
        y = ((v + _MARGIN_CELLS) * _NODES).astype(np.float32)
        read = cv2.remap(texture, x[None], y[None], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        shades = np.array(read[0].T, np.float64, order="C")
        # A Gaussian blur obeys the heat equation: its variance grows as the second derivative says.
        more_u = 0.5 * (blur_u**2 - math.exp(2.0 * number_u * self._log_step))
        more_v = 0.5 * (blur_v**2 - math.exp(2.0 * number_v * self._log_step))
        shades[WHITE] += more_u * shades[WHITE_UU] + more_v * shades[WHITE_VV]
        return shades

    def _texture(self, number_u: int, number_v: int) -> Field:
        key = number_u, number_v
        texture = self._drawn.get(key)
        if texture is None:
            blurs = math.exp(number_u * self._log_step), math.exp(number_v * self._log_step)
            texture = self._drawn[key] = self._pattern.raster(self._places, self._places, *blurs)
            if len(self._drawn) > _MOST_KEPT:
                self._drawn.popitem(last=False)
        else:
            self._drawn.move_to_end(key)
        return texture
