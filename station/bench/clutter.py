"""Things on the ground that a detector could take for a marker."""

import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
Layer = NDArray[np.float32]
Keep = tuple[float, float, float]
"""A place to leave alone: x, y, reach, pixels."""

_FEWEST, _MOST = 15, 60
_SMALLEST_PX, _GROWTH = 6.0, 10.0
_FINER = 4
_PIXEL_BLUR_PX = math.sqrt(1.0 / 12.0)


def strewn(
    picture: Picture, random: np.random.Generator, noise_level: float, keep: Keep | None, *, codes: bool = True
) -> Picture:
    """The picture with 15 to 60 things in it, of 6 to 60 pixels, turned any way, blurred and noisy as the rest; codes of random cells only if wanted."""
    out = picture.astype(np.float32)
    height, width = picture.shape
    for _ in range(int(random.integers(_FEWEST, _MOST))):
        size_px = float(_SMALLEST_PX * _GROWTH ** random.random())
        x, y = float(random.uniform(0, width)), float(random.uniform(0, height))
        reach = int(size_px) + 3
        if keep is not None and max(abs(x - keep[0]), abs(y - keep[1])) < reach + keep[2]:
            continue
        shade, cover = _Thing(random, size_px, reach, (x - int(x), y - int(y))).drawn(codes=codes)
        left, top = int(x) - reach, int(y) - reach
        x0, y0, x1, y1 = max(left, 0), max(top, 0), min(left + 2 * reach + 1, width), min(top + 2 * reach + 1, height)
        part = slice(y0 - top, y1 - top), slice(x0 - left, x1 - left)
        noise = random.normal(0.0, noise_level, shade[part].shape).astype(np.float32)
        place = out[y0:y1, x0:x1]
        place += cover[part] * (shade[part] + noise - place)
    return np.clip(np.rint(out), 0, 255).astype(np.uint8)


class _Thing:
    """One thing, drawn four times as fine and made smaller."""

    def __init__(self, random: np.random.Generator, size_px: float, reach: int, fraction: tuple[float, float]) -> None:
        self._random, self._size = random, size_px
        side = (2 * reach + 1) * _FINER
        self._shade, self._cover = np.zeros((side, side), np.float32), np.zeros((side, side), np.float32)
        self._middle = np.array([(reach + each + 0.5) * _FINER - 0.5 for each in fraction])
        self._turn = float(random.uniform(0.0, math.tau))
        self._dark, self._bright = float(random.uniform(15, 90)), float(random.uniform(150, 240))
        self._any = float(random.uniform(15, 240))

    def drawn(self, *, codes: bool) -> tuple[Layer, Layer]:
        """Shade and cover."""
        coded = (self._code, self._code) if codes else ()
        kinds: tuple[Callable[[], None], ...] = (self._plate, self._frame, *coded, self._disc, self._stripes)
        kinds[int(self._random.integers(len(kinds)))]()
        blur_px = math.hypot(float(self._random.uniform(0.4, 1.0)), _PIXEL_BLUR_PX) * _FINER
        return self._smaller(self._shade, blur_px), self._smaller(self._cover, blur_px)

    @staticmethod
    def _smaller(layer: Layer, blur_px: float) -> Layer:
        soft = cv2.GaussianBlur(layer, (0, 0), blur_px)
        side = layer.shape[0] // _FINER
        return np.asarray(cv2.resize(soft, (side, side), interpolation=cv2.INTER_AREA), np.float32)

    def _box(self, layer: Layer, half_x: float, half_y: float, value: float, x: float = 0.0, y: float = 0.0) -> None:
        corners = np.array(
            [[x - half_x, y - half_y], [x + half_x, y - half_y], [x + half_x, y + half_y], [x - half_x, y + half_y]]
        )
        c, s = math.cos(self._turn), math.sin(self._turn)
        turned = corners @ np.array([[c, s], [-s, c]]) * _FINER + self._middle
        cv2.fillPoly(layer, [np.rint(turned).astype(np.int32)], value)

    def _plate(self) -> None:
        self._shade[:] = self._any
        half = self._size / 2.0
        self._box(self._cover, half, half * float(self._random.uniform(0.3, 1.0)), 1.0)

    def _frame(self) -> None:
        self._shade[:] = self._bright
        self._box(self._cover, 0.65 * self._size, 0.65 * self._size, 1.0)
        self._box(self._shade, self._size / 2.0, self._size / 2.0, self._dark)
        half = self._size / 2.0 * float(self._random.uniform(0.2, 0.8))
        self._box(self._shade, half, half, self._any)

    def _code(self) -> None:
        bits = int(self._random.integers(4, 8))
        cell = self._size / (bits + 2)
        self._shade[:] = self._bright
        self._box(self._cover, self._size / 2.0 + cell, self._size / 2.0 + cell, 1.0)
        self._box(self._shade, self._size / 2.0, self._size / 2.0, self._dark)
        for row, column in np.argwhere(self._random.random((bits, bits)) < 0.5).tolist():
            x, y = (column - (bits - 1) / 2.0) * cell, (row - (bits - 1) / 2.0) * cell
            self._box(self._shade, cell / 2.0, cell / 2.0, self._bright, x, y)

    def _disc(self) -> None:
        self._shade[:] = self._any
        radius = float(self._random.uniform(0.3, 1.0)) * self._size / 2.0 * _FINER
        cv2.circle(self._cover, (round(float(self._middle[0])), round(float(self._middle[1]))), round(radius), 1.0, -1)

    def _stripes(self) -> None:
        self._shade[:] = self._bright
        self._box(self._cover, self._size / 2.0, self._size / 2.0, 1.0)
        count = int(self._random.integers(2, 6))
        for index in range(count):
            y = (index - (count - 1) / 2.0) * self._size / count
            self._box(self._shade, self._size / 2.0, self._size / 4.0 / count, self._dark, 0.0, y)
