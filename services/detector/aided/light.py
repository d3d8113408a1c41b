"""How a marker is lit: evenly with a gentle slope, or with the edge of a shadow across it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from services.detector.aided.pattern import Shades, normal_distribution

Array = NDArray[np.float64]

_DIRECTIONS = 8
_OFFSETS_HALVES = (-0.7, -0.35, 0.0, 0.35, 0.7)
_RIDGE = 1e-2
_LEAST_SHARE = 0.08
_DEEPEST_SHADOW = 5.0
_LEAST_CONTRAST = 20.0
_DARKEST, _BRIGHTEST = -25.0, 290.0


@dataclass(frozen=True)
class ShadowEdge:
    """A straight edge between light and shadow, in cells from the marker's middle."""

    angle_rad: float
    """Direction of the edge's normal, from u towards v."""
    offset: float
    """Distance of the edge from the middle along the normal, cells."""


@dataclass(frozen=True)
class Lit:
    """Brightness as a sum of known columns with unknown factors."""

    columns: Array
    """(N, k): black ink, white board, ground; then two slopes, or the three once more in the shadow."""
    shadow: Array | None
    """(N,): how much each pixel lies in the shadow."""
    shadow_density: Array | None
    """(N,): its derivative by the distance from the edge."""

    def without_code(self, brightness: Array) -> float:
        """Sum of squares that remains where the board is taken for blank: all that light and ground explain without the code."""
        columns = self.columns
        blank = [columns[:, 0] + columns[:, 1], columns[:, 2]]
        blank += (
            [columns[:, 3] + columns[:, 4], columns[:, 5]]
            if self.shadow is not None
            else [columns[:, 3], columns[:, 4]]
        )
        if self.shadow is None:
            blank[2:] = []
        basis = np.column_stack(blank)
        A = basis.T @ basis
        A.flat[:: len(A) + 1] += _RIDGE
        remaining = brightness - basis @ np.linalg.solve(A, basis.T @ brightness)
        return float(remaining @ remaining)

    def plausible(self, factors: Array) -> bool:
        """Whether these are brightnesses that ink, paper and ground can have, in the shadow darker than beside it."""
        sides = [factors[:3]] if self.shadow is None else [factors[:3], factors[3:]]
        if self.shadow is not None:
            board = self.columns[:, [0, 3]] + self.columns[:, [1, 4]]
            shares = board.sum(axis=0) / max(float(board.sum()), 1e-9)
            sides = [side for side, share in zip(sides, shares, strict=True) if share > _LEAST_SHARE]
        if any(not _is_light(*side.tolist()) for side in sides):
            return False
        if len(sides) < 2:
            return True
        contrasts = [float(side[1] - side[0]) for side in sides]
        return max(contrasts) / min(contrasts) < _DEEPEST_SHADOW and (contrasts[0] < contrasts[1]) == (
            sides[0][1] < sides[1][1]
        )

    def edge_slopes(self, factors: Array, u: Array, v: Array, half: float, edge: ShadowEdge) -> tuple[Array, Array]:
        """Derivatives of the brightness by the angle and the offset of the shadow's edge, each (N,)."""
        if self.shadow is None or self.shadow_density is None:
            raise ValueError("there is no shadow")
        bright = self.columns[:, :3] @ factors[:3] / np.maximum(1.0 - self.shadow, 1e-9)
        dark = self.columns[:, 3:] @ factors[3:] / np.maximum(self.shadow, 1e-9)
        slope = (dark - bright) * self.shadow_density
        sideways = (v - half) * math.cos(edge.angle_rad) - (u - half) * math.sin(edge.angle_rad)
        return slope * sideways, -slope

    def local(self, factors: Array) -> tuple[Array | float, Array | float, Array | float]:
        """Brightness of ink, board and ground at each pixel."""
        if self.shadow is None:
            return float(factors[0]), float(factors[1]), float(factors[2])
        dark = self.shadow
        ink, paper, ground = (factors[i] + (factors[i + 3] - factors[i]) * dark for i in range(3))
        return ink, paper, ground


def lit(white: Array, shades: Shades, u: Array, v: Array, half: float, edge: ShadowEdge | None, width: float) -> Lit:
    """The columns for places (u, v) of a marker whose half side is `half` cells; `width` is the edge's blur in cells."""
    ink, ground = shades.board - white, 1.0 - shades.board
    if edge is None:
        return Lit(
            np.column_stack((ink, white, ground, (u / half - 1.0) * white, (v / half - 1.0) * white)), None, None
        )
    z = ((u - half) * math.cos(edge.angle_rad) + (v - half) * math.sin(edge.angle_rad) - edge.offset) / width
    dark = normal_distribution(z)
    bright = 1.0 - dark
    columns = np.column_stack((ink * bright, white * bright, ground * bright, ink * dark, white * dark, ground * dark))
    return Lit(columns, dark, np.exp(-0.5 * z * z) / (math.sqrt(2.0 * math.pi) * width))


def likeliest_edge(shades: Shades, u: Array, v: Array, half: float, width: float, brightness: Array) -> ShadowEdge:
    """The edge that, of a coarse choice, explains the picture best."""
    angles = np.arange(_DIRECTIONS) * math.pi / _DIRECTIONS
    along = (u - half)[None] * np.cos(angles)[:, None] + (v - half)[None] * np.sin(angles)[:, None]
    offsets = np.array(_OFFSETS_HALVES) * half
    z = (along[:, None] - offsets[None, :, None]).reshape(-1, len(u)) / width
    dark = normal_distribution(z)
    parts = np.stack((shades.board - shades.white, shades.white, 1.0 - shades.board))
    columns = np.concatenate((parts[None] * (1.0 - dark)[:, None], parts[None] * dark[:, None]), axis=1)
    A = columns @ columns.transpose(0, 2, 1)
    A += _RIDGE * np.eye(6)
    b = columns @ brightness
    explained = np.einsum("ij,ij->i", b, np.linalg.solve(A, b[..., None])[..., 0])
    best = int(np.argmax(explained))
    return ShadowEdge(float(angles[best // len(offsets)]), float(offsets[best % len(offsets)]))


def _is_light(ink: float, paper: float, ground: float) -> bool:
    return (
        paper - ink >= _LEAST_CONTRAST
        and ink >= _DARKEST
        and paper <= _BRIGHTEST
        and ground >= _DARKEST - (paper - ink)
        and ground <= _BRIGHTEST + (paper - ink)
    )
