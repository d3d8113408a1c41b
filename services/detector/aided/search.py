"""Finding places where the pattern may be, at the size at which it is expected, turned any way."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from services.detector.aided.one_thread import product
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
_LEAST_ROUND_SCORE = 0.1
_PLACES, _FEWEST_PLACES = 320, 80
_PIXELS_A_PLACE = 700
_CLOSER = 48
_KEENER = 20
_RING_CELLS = 1.05
_APART_PX = 2.5
_CHANGES = ((0.4, 0.0, 0.0, 0.0), (0.0, 0.4, 0.0, 0.0), (0.0, 0.0, 0.06, 0.0), (0.0, 0.0, 0.0, 0.05))
"""Small changes of a pattern: to the right and down in pixels, turn in rad, growth as a logarithm."""
_LARGEST_CHANGE = 2.5


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
        x, y = x.ravel()[inside], y.ravel()[inside]
        raw = np.array([_rendered(pattern, side, yaw, x, y) for side, yaw in shapes])
        self._bank = self._unit(raw - (raw @ self._smooth) @ self._smooth.T)
        self._tangents, self._inverses = self._tangent_spaces(pattern, shapes, x, y)
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
        keen = np.argsort(-scores)[:_KEENER]
        return self._distinct(self._sharpened(around, rows[keen], columns[keen], found[keen]), most)

    @staticmethod
    def _unit(rows: Array) -> Field:
        return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True), np.float32)

    def _tangent_spaces(
        self, pattern: Pattern, shapes: list[tuple[float, float]], x: Array, y: Array
    ) -> tuple[Field, Array]:
        """For each shape an orthonormal basis of itself and its changes with place, turn and size, and the way back to these."""
        bases, inverses = [], []
        for side, yaw in shapes:
            columns = [_rendered(pattern, side, yaw, x, y)]
            for dx, dy, turn, growth in _CHANGES:
                ahead, behind = (
                    _rendered(pattern, side * math.exp(sign * growth), yaw + sign * turn, x - sign * dx, y - sign * dy)
                    for sign in (1.0, -1.0)
                )
                columns.append((ahead - behind) / 2.0)
            J = np.stack(columns, axis=1)
            Q, R = np.linalg.qr(J - self._smooth @ (self._smooth.T @ J))
            bases.append(Q)
            inverses.append(np.linalg.inv(R))
        return np.array(bases, np.float32), np.array(inverses)

    def _sharpened(
        self, around: Field, rows: NDArray[np.intp], columns: NDArray[np.intp], found: NDArray[np.intp]
    ) -> list[Proposal]:
        """Proposals between the bank's steps, to first order, with the score that they have there."""
        shape, rows, columns = found[:, 0], rows + found[:, 1], columns + found[:, 2]
        parts = self._parts(around, rows, columns)
        along = np.einsum("ij,ijk->ik", parts, self._tangents[shape])
        scores = np.linalg.norm(along, axis=1) / (self._spread(parts) + self._floor)
        factors = np.einsum("ijk,ik->ij", self._inverses[shape], along)
        steps = np.clip(factors[:, 1:] / np.maximum(factors[:, :1], 1e-6), -_LARGEST_CHANGE, _LARGEST_CHANGE)
        proposals = []
        for index in np.flatnonzero(factors[:, 0] > 0.0).tolist():
            side_px, yaw_rad = self._shapes[int(shape[index])]
            dx, dy, turn, growth = (steps[index] @ np.array(_CHANGES)).tolist()
            place = (float(columns[index]) + dx, float(rows[index]) + dy)
            proposals.append(Proposal(*place, side_px * math.exp(growth), yaw_rad + turn, float(scores[index])))
        return proposals

    def _parts(self, around: Field, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Field:
        """The disc around each place, (n, N)."""
        width = around.shape[1]
        inner_y, inner_x = np.divmod(self._inside, self._disc.shape[1])
        starts = (rows + 1) * width + columns + 1
        return np.asarray(np.take(around, starts[:, None] + inner_y * width + inner_x), np.float32)

    def _spread(self, parts: Field) -> Field:
        """Norm of what the smooth part of the light does not explain, (n,)."""
        smooth = product(parts, self._smooth)
        squares = np.einsum("ij,ij->i", parts, parts) - np.einsum("ij,ij->i", smooth, smooth)
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)), np.float32)

    def _mean_over_turns(self, turned: Array) -> Field:
        ring = np.zeros(self._disc.shape, np.float32)
        mean = turned.mean(axis=0)
        mean -= mean.mean()
        ring[self._disc] = (mean / np.linalg.norm(mean)).astype(np.float32)
        return ring

    def _round_places(self, light: Field) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        box = (self._box, self._box)
        mean = cv2.boxFilter(light, -1, box, borderType=cv2.BORDER_REPLICATE)
        spread = np.asarray(cv2.sqrBoxFilter(light, cv2.CV_32F, box, borderType=cv2.BORDER_REPLICATE), np.float32)
        # In place: at this size of arrays it is memory that takes the time.
        spread -= np.asarray(cv2.multiply(mean, mean, dst=mean), np.float32)
        np.maximum(spread, 0.0, out=spread)
        np.sqrt(spread, out=spread)
        spread *= np.float32(math.sqrt(float(self._disc.sum())))
        spread += np.float32(self._floor)
        score = np.asarray(cv2.filter2D(light, -1, self._ring, borderType=cv2.BORDER_REPLICATE), np.float32)
        score /= spread
        score[score <= _LEAST_ROUND_SCORE] = -1.0
        peaks = np.flatnonzero((score == cv2.dilate(score, np.ones((3, 3), np.uint8))) & (score > 0.0))
        most = min(max(light.size // _PIXELS_A_PLACE, _FEWEST_PLACES), _PLACES)
        if len(peaks) > most:
            values = score.ravel()[peaks]
            peaks = np.sort(peaks[np.argpartition(-values, most)[:most]])
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
        offsets = np.array([(dy, dx) for dy in down for dx in right])
        every_row = (rows[:, None] + offsets[:, 0]).ravel()
        parts = self._parts(around, every_row, (columns[:, None] + offsets[:, 1]).ravel())
        scores = product(parts, self._bank.T) / (self._spread(parts) + self._floor)[:, None]
        shape = scores.argmax(axis=1)
        best = scores[np.arange(len(shape)), shape].reshape(len(rows), -1)
        choice = best.argmax(axis=1)
        row = np.arange(len(rows))
        found = np.column_stack((shape.reshape(best.shape)[row, choice], offsets[choice]))
        return best[row, choice], found

    @staticmethod
    def _distinct(proposals: list[Proposal], most: int) -> list[Proposal]:
        kept: list[Proposal] = []
        for proposal in sorted(proposals, key=lambda each: -each.score):
            if all(max(abs(proposal.x_px - k.x_px), abs(proposal.y_px - k.y_px)) > _APART_PX for k in kept):
                kept.append(proposal)
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
