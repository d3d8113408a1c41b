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
_RING_TERMS = 2
_PLACES, _FEWEST_PLACES = 320, 80
_PIXELS_A_PLACE = 700
_CLOSER, _CLOSER_MORE = 24, 16
"""How many places are looked at closer, of one picture and for each more."""
_KEENER, _KEENER_OF_ONE = 20, 12
_RING_CELLS = 1.05
_APART_PX = 2.5
_CHANGES = ((0.4, 0.0, 0.0, 0.0), (0.0, 0.4, 0.0, 0.0), (0.0, 0.0, 0.06, 0.0), (0.0, 0.0, 0.0, 0.05))
"""Small changes of a pattern: to the right and down in pixels, turn in rad, growth as a logarithm."""
_LARGEST_CHANGE = 2.5
_HERE = np.zeros((1, 2), np.intp)
_AROUND = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1), indexing="ij"), axis=-1).reshape(-1, 2)


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
    picture: int = 0
    """Which of the pictures that were searched, counted from 0."""


class _Sheets:
    """The logarithms of several pictures, each with a margin, one after the other."""

    def __init__(self, lights: list[Field], margin: int) -> None:
        around = [np.pad(light, margin, mode="edge") for light in lights]
        self._margin = margin
        self._flat = np.concatenate([sheet.ravel() for sheet in around])
        self._widths = np.array([sheet.shape[1] for sheet in around])
        self._starts = np.concatenate(([0], np.cumsum([sheet.size for sheet in around])[:-1]))

    def parts(self, places: "_Places", down: NDArray[np.intp], right: NDArray[np.intp]) -> Field:
        """What lies so many pixels down and to the right, each (N,), of each of n places, (n, N)."""
        width = self._widths[places.picture]
        first = self._starts[places.picture] + (places.row + self._margin) * width + places.column + self._margin
        return np.asarray(np.take(self._flat, first[:, None] + down * width[:, None] + right), np.float32)


@dataclass(frozen=True)
class _Places:
    """n places in several pictures, each (n,)."""

    picture: NDArray[np.intp]
    row: NDArray[np.intp]
    column: NDArray[np.intp]

    def chosen(self, which: NDArray[np.intp]) -> "_Places":
        return _Places(self.picture[which], self.row[which], self.column[which])

    def beside(self, offsets: NDArray[np.intp]) -> "_Places":
        """Each one's neighbours, (n * k,); offsets (k, 2) count down and to the right."""
        row, column = (self.row[:, None] + offsets[:, 0]).ravel(), (self.column[:, None] + offsets[:, 1]).ravel()
        return _Places(np.repeat(self.picture, len(offsets)), row, column)


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
        self._rings = _separated(self._mean_over_turns(raw[_YAWS : 2 * _YAWS]))
        # A square is quicker than the disc, and as good where places are only picked.
        self._box = 2 * round(math.sqrt(float(self._disc.sum())) / 2.0 - 0.5) + 1
        self._floor = _FLOOR * math.sqrt(float(self._disc.sum()))
        self._down, self._right = (each - self._reach for each in np.nonzero(self._disc))

    def proposals(self, pictures: list[GreyPicture], most: int) -> list[Proposal]:
        """The likeliest places, best first.

        Args:
            pictures: (height, width) each, in each of which the marker may be about `BANK_SIDE_PX` large.
            most: How many at most, in all of them together.
        """
        lights = [_logarithm(picture) for picture in pictures]
        places = self._round_places(lights)
        if len(places.row) == 0:
            return []
        sheets = _Sheets(lights, self._reach + 1)
        centred, _ = self._tried(sheets, places, _HERE)
        places = places.chosen(np.argsort(-centred)[: _CLOSER + _CLOSER_MORE * (len(pictures) - 1)])
        scores, found = self._tried(sheets, places, _AROUND)
        keen = np.argsort(-scores)[: _KEENER if len(pictures) > 1 else _KEENER_OF_ONE]
        return self._distinct(self._sharpened(sheets, places.chosen(keen), found[keen]), most)

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

    def _sharpened(self, sheets: _Sheets, places: _Places, found: NDArray[np.intp]) -> list[Proposal]:
        """Proposals between the bank's steps, to first order, with the score that they have there."""
        shape = found[:, 0]
        places = _Places(places.picture, places.row + found[:, 1], places.column + found[:, 2])
        parts = sheets.parts(places, self._down, self._right)
        along = np.einsum("ij,ijk->ik", parts, self._tangents[shape])
        scores = np.linalg.norm(along, axis=1) / (self._spread(parts) + self._floor)
        factors = np.einsum("ijk,ik->ij", self._inverses[shape], along)
        steps = np.clip(factors[:, 1:] / np.maximum(factors[:, :1], 1e-6), -_LARGEST_CHANGE, _LARGEST_CHANGE)
        proposals = []
        for index in np.flatnonzero(factors[:, 0] > 0.0).tolist():
            side_px, yaw_rad = self._shapes[int(shape[index])]
            dx, dy, turn, growth = (steps[index] @ np.array(_CHANGES)).tolist()
            at = (float(places.column[index]) + dx, float(places.row[index]) + dy)
            size, score, picture = side_px * math.exp(growth), float(scores[index]), int(places.picture[index])
            proposals.append(Proposal(*at, size, yaw_rad + turn, score, picture))
        return proposals

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

    def _round_places(self, lights: list[Field]) -> _Places:
        found = [self._round_peaks(light) for light in lights]
        picture = np.repeat(np.arange(len(found)), [len(rows) for rows, _ in found])
        return _Places(picture, *(np.concatenate(each) for each in zip(*found, strict=True)))

    def _round_peaks(self, light: Field) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        score = self._round_scores(light)
        peaks = cv2.compare(score, cv2.dilate(score, np.ones((3, 3), np.uint8)), cv2.CMP_EQ)
        peaks = cv2.bitwise_and(peaks, np.asarray(score > _LEAST_ROUND_SCORE, np.uint8))
        places = np.flatnonzero(np.asarray(peaks))
        most = min(max(light.size // _PIXELS_A_PLACE, _FEWEST_PLACES), _PLACES)
        if len(places) > most:
            values = score.ravel()[places]
            places = np.sort(places[np.argpartition(-values, most)[:most]])
        rows, columns = np.divmod(places, light.shape[1])
        return rows, columns

    def _round_scores(self, light: Field) -> Field:
        """Correlation with the pattern's mean over all turns around each place, (height, width)."""
        box = (self._box, self._box)
        mean = np.asarray(cv2.boxFilter(light, -1, box, borderType=cv2.BORDER_REPLICATE), np.float32)
        spread = np.asarray(cv2.sqrBoxFilter(light, cv2.CV_32F, box, borderType=cv2.BORDER_REPLICATE), np.float32)
        # The two terms do not add up to nothing, as the filter did.
        score = mean * np.float32(-sum(float(down.sum() * right.sum()) for down, right in self._rings))
        for down, right in self._rings:
            score += np.asarray(cv2.sepFilter2D(light, -1, right, down, borderType=cv2.BORDER_REPLICATE), np.float32)
        # In place: at this size of arrays it is memory that takes the time.
        mean *= mean
        spread -= mean
        np.maximum(spread, 0.0, out=spread)
        np.sqrt(spread, out=spread)
        spread *= np.float32(math.sqrt(float(self._disc.sum())))
        spread += np.float32(self._floor)
        score /= spread
        return score

    def _tried(self, sheets: _Sheets, places: _Places, offsets: NDArray[np.intp]) -> tuple[Field, NDArray[np.intp]]:
        """The whole bank at places and their neighbours: best score of each place, and (shape, dy, dx) of it."""
        parts = sheets.parts(places.beside(offsets), self._down, self._right)
        scores = product(parts, self._bank.T) / (self._spread(parts) + self._floor)[:, None]
        shape = scores.argmax(axis=1)
        row = np.arange(len(places.row))
        best = scores[np.arange(len(shape)), shape].reshape(len(row), -1)
        choice = best.argmax(axis=1)
        found = np.column_stack((shape.reshape(best.shape)[row, choice], offsets[choice]))
        return best[row, choice], found

    @staticmethod
    def _distinct(proposals: list[Proposal], most: int) -> list[Proposal]:
        kept: list[Proposal] = []
        for proposal in sorted(proposals, key=lambda each: -each.score):
            if all(proposal.picture != k.picture or _apart_px(proposal, k) > _APART_PX for k in kept):
                kept.append(proposal)
            if len(kept) >= most:
                break
        return kept


def _apart_px(a: Proposal, b: Proposal) -> float:
    return max(abs(a.x_px - b.x_px), abs(a.y_px - b.y_px))


def _separated(ring: Field) -> list[tuple[Field, Field]]:
    """The filter as a sum of products of one down and one to the right: two of them make 0.98 of it, in half the time."""
    U, s, V = np.linalg.svd(ring.astype(np.float64))
    return [(np.float32(s[k]) * U[:, k].astype(np.float32), V[k].astype(np.float32)) for k in range(_RING_TERMS)]


def _rendered(pattern: Pattern, side_px: float, yaw_rad: float, x: Array, y: Array) -> Array:
    """Logarithm of the brightness of a turned pattern on grey ground."""
    cell_px, half = side_px / pattern.count, pattern.count / 2.0
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    blur = _BLUR_PX / cell_px
    shades = pattern.shades((c * x + s * y) / cell_px + half, (c * y - s * x) / cell_px + half, blur, blur)
    level = _INK * (shades.board - shades.white) + _PAPER * shades.white + _GROUND * (1.0 - shades.board)
    return np.log(level + _DARKEST)


def _logarithm(picture: GreyPicture) -> Field:
    return np.asarray(cv2.LUT(picture, _LOGARITHMS), np.float32)


_LOGARITHMS = np.log(np.arange(256) + _DARKEST).astype(np.float32)
