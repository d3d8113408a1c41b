"""Finding places where the pattern may be, at the size at which it is expected, turned any way."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from services.detector.aided.pattern import Pattern
from services.detector.detector import GreyPicture

Array = NDArray[np.float64]
Field = NDArray[np.float32]

BANK_SIDE_PX = 8.1
"""Side of the marker in the middle one of the bank's three sizes, pixels."""
SIZE_STEP = 1.14
"""Ratio between neighbouring sizes. A bank finds markers up to half a step beyond its outermost sizes."""

_YAWS = 36
_BLUR_PX = 0.85
_DARKEST = 15.0
_INK, _PAPER, _GROUND = 28.0, 218.0, 118.0
_FLOOR = 0.06
"""Contrast, as a difference of logarithms a pixel, below which a place is taken for flat."""
_PLACES = 320
_CLOSER = 48
_RING_CELLS = 1.05


@dataclass(frozen=True)
class Proposal:
    """A place where the pattern may be."""

    x_px: float
    y_px: float
    """The marker's centre in the picture that was searched."""
    side_px: float
    """About how long its sides are there."""
    yaw_rad: float
    """How the marker's upper edge is turned in the picture, from right towards down."""
    score: float
    """Correlation with the pattern, up to 1."""


class PatternSearch:
    """Correlates a picture with the pattern in a few sizes and all turns.

    Brightness is taken as its logarithm, in which a shadow's edge is a step and no factor, and slopes and bends of it are taken out.
    First a filter that is the same all around, the pattern's mean over all turns, picks some hundred places; only there is the whole
    bank of turned patterns tried.
    """

    def __init__(self, pattern: Pattern) -> None:
        sides = [BANK_SIDE_PX / SIZE_STEP, BANK_SIDE_PX, BANK_SIDE_PX * SIZE_STEP]
        quiet = 1.0 + 2.0 * _RING_CELLS / pattern.count
        self._reach = math.ceil(0.5 * sides[-1] * quiet * 1.1)
        along = np.arange(-self._reach, self._reach + 1.0)
        x, y = np.meshgrid(along, along)
        self._disc = np.hypot(x, y) <= 0.5 * sides[-1] * quiet * 1.13
        inside = self._disc.ravel()
        self._smooth = np.linalg.qr(
            np.stack([np.ones_like(x), x, y, x * y, x * x - y * y], axis=-1).reshape(-1, 5)[inside]
        )[0].astype(np.float32)
        shapes = [(side, math.tau * number / _YAWS) for side in sides for number in range(_YAWS)]
        raw = np.array([_rendered(pattern, side, yaw, x.ravel()[inside], y.ravel()[inside]) for side, yaw in shapes])
        bank = raw - (raw @ self._smooth) @ self._smooth.T
        self._bank = (bank / np.linalg.norm(bank, axis=1, keepdims=True)).astype(np.float32)
        self._shapes = shapes
        self._ring = self._mean_over_turns(raw[_YAWS : 2 * _YAWS])
        # A square is quicker than the disc, and as good where places are only picked.
        self._box = 2 * round(math.sqrt(float(self._disc.sum())) / 2.0 - 0.5) + 1
        self._floor = _FLOOR * math.sqrt(float(self._disc.sum()))
        self._inside = np.flatnonzero(inside)

    def proposals(self, picture: GreyPicture, most: int) -> list[Proposal]:
        """The likeliest places, best first.

        Args:
            picture: (height, width), in which the marker is about `BANK_SIDE_PX` large.
            most: How many at most.
        """
        light = _logarithm(picture)
        rows, columns = self._round_places(light)
        if len(rows) == 0:
            return []
        around = np.pad(light, self._reach + 1, mode="edge")
        centred, _ = self._tried(around, rows, columns, (0,), (0,))
        best = np.argsort(-centred)[:_CLOSER]
        rows, columns = rows[best], columns[best]
        scores, found = self._tried(around, rows, columns, (-1, 0, 1), (-1, 0, 1))
        return self._distinct(rows, columns, scores, found, most)

    def _mean_over_turns(self, turned: Array) -> Field:
        ring = np.zeros(self._disc.shape, np.float32)
        mean = turned.mean(axis=0)
        mean -= mean.mean()
        ring[self._disc] = (mean / np.linalg.norm(mean)).astype(np.float32)
        return ring

    def _round_places(self, light: Field) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        box = (self._box, self._box)
        mean = cv2.boxFilter(light, -1, box, borderType=cv2.BORDER_REPLICATE)
        squares = cv2.sqrBoxFilter(light, cv2.CV_32F, box, borderType=cv2.BORDER_REPLICATE)
        deviation = np.sqrt(np.maximum(squares - mean * mean, 0.0) * np.float32(self._disc.sum()))
        response = cv2.filter2D(light, -1, self._ring, borderType=cv2.BORDER_REPLICATE)
        score = np.asarray(response / (deviation + np.float32(self._floor)), np.float32)
        peaks = np.flatnonzero((score >= cv2.dilate(score, np.ones((3, 3), np.uint8))) & (score > 0.1))
        if len(peaks) > _PLACES:
            values = score.ravel()[peaks]
            peaks = np.sort(peaks[np.argpartition(-values, _PLACES)[:_PLACES]])
        rows, columns = np.divmod(peaks, light.shape[1])
        return rows, columns

    def _tried(
        self,
        around: Field,
        rows: NDArray[np.intp],
        columns: NDArray[np.intp],
        down: tuple[int, ...],
        right: tuple[int, ...],
    ) -> tuple[Field, NDArray[np.intp]]:
        """The whole bank at places and their neighbours: best score of each place, and (shape, dy, dx) of it."""
        width = around.shape[1]
        offsets = np.array([(dy, dx) for dy in down for dx in right])
        inner_y, inner_x = np.divmod(self._inside, self._disc.shape[1])
        steps = inner_y * width + inner_x
        starts = (rows[:, None] + 1 + offsets[:, 0]) * width + columns[:, None] + 1 + offsets[:, 1]
        parts = np.take(around, starts.reshape(-1, 1) + steps)
        smooth = parts @ self._smooth
        spread = np.sqrt(np.maximum(np.einsum("ij,ij->i", parts, parts) - np.einsum("ij,ij->i", smooth, smooth), 0.0))
        scores = (parts @ self._bank.T) / (spread + self._floor)[:, None]
        shape = scores.argmax(axis=1)
        best = scores[np.arange(len(shape)), shape].reshape(len(rows), -1)
        choice = best.argmax(axis=1)
        row = np.arange(len(rows))
        found = np.column_stack((shape.reshape(best.shape)[row, choice], offsets[choice]))
        return best[row, choice], found

    def _distinct(
        self, rows: NDArray[np.intp], columns: NDArray[np.intp], scores: Field, found: NDArray[np.intp], most: int
    ) -> list[Proposal]:
        kept: list[Proposal] = []
        for index in np.argsort(-scores).tolist():
            shape, dy, dx = found[index].tolist()
            x, y = float(columns[index] + dx), float(rows[index] + dy)
            if all(max(abs(x - other.x_px), abs(y - other.y_px)) > 2.5 for other in kept):
                side_px, yaw_rad = self._shapes[shape]
                kept.append(Proposal(x, y, side_px, yaw_rad, float(scores[index])))
            if len(kept) >= most:
                break
        return kept


def _rendered(pattern: Pattern, side_px: float, yaw_rad: float, x: Array, y: Array) -> Array:
    """Logarithm of the brightness of a turned pattern on grey ground."""
    cell_px, half = side_px / pattern.count, pattern.count / 2.0
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    blur = _BLUR_PX / cell_px
    shades = pattern.shades((c * x + s * y) / cell_px + half, (c * y - s * x) / cell_px + half, blur, blur)
    level = _INK * (shades.board - shades.white) + _PAPER * shades.white + _GROUND * (1.0 - shades.board)
    return np.log(level + _DARKEST)


def _logarithm(picture: GreyPicture) -> Field:
    return np.asarray(_LOGARITHMS[picture], np.float32)


_LOGARITHMS = np.log(np.arange(256) + _DARKEST).astype(np.float32)
