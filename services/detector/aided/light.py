"""How a marker is lit: evenly with a gentle slope, or with the edge of a shadow across it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from services.detector.aided.one_thread import product
from services.detector.aided.pattern import normal_distribution

Array = NDArray[np.float64]

GROUND_LEVEL = 128.0

_DIRECTIONS = 8
_OFFSETS_HALVES = (-1.12, -0.75, -0.38, 0.0, 0.38, 0.75, 1.12)
_FACTORS = (0.35, 0.5, 0.7, 1.4, 2.0, 2.9)
_PAIRS = np.divmod(np.arange(9), 3)
_RIDGE = 1e-2
_LARGEST_SHADOW_SHARE = 0.75
"""What the edge may leave of the square that even light leaves. It leaves 0.68 and less of that of pads which a shadow's edge does cross."""
_LEAST_CONTRAST = 18.0
_DARKEST, _BRIGHTEST = -25.0, 290.0
_DEEPEST = 6.0
_WEIGHTS = np.array((1e3, 1e3, 100.0, 20.0, 20.0)) ** -2.0
_MEANS = np.array((0.0, 0.0, GROUND_LEVEL, 0.0, 0.0))
"""Of ink and board nothing is known; the ground is about grey and the light about even."""


@dataclass(frozen=True)
class ShadowEdge:
    """A straight edge between two lights."""

    angle_rad: float
    """Direction of the edge's normal, from u towards v."""
    offset: float
    """Distance of the edge from the marker's middle along the normal, cells."""
    log_factor: float
    """Logarithm of the light beyond the edge against that before it."""


@dataclass(frozen=True)
class Lit:
    """Brightness as a sum of known columns with unknown factors."""

    columns: tuple[Array, ...]
    """k of (N,): black ink, white board and ground, each lit; then, in even light, two slopes of the board's brightness."""
    light: Array | None
    """(N,): how bright the light is at each pixel; None for even light."""
    beyond: Array | None
    """(N,): how much each pixel lies beyond the edge."""
    density: Array | None
    """(N,): its derivative by the distance from the edge."""

    def local(self, factors: Array) -> tuple[Array | float, Array | float, Array | float]:
        """Brightness of ink, board and ground at each pixel."""
        ink, paper, ground = factors[:3].tolist()
        if self.light is None:
            return ink, paper, ground
        return ink * self.light, paper * self.light, ground * self.light

    def edge_slopes(
        self, factors: Array, u: Array, v: Array, half: float, edge: ShadowEdge
    ) -> tuple[Array, Array, Array]:
        """Derivatives of the brightness by angle, offset and logarithmic factor of the edge, each (N,)."""
        if self.light is None or self.beyond is None or self.density is None:
            raise ValueError("there is no edge")
        ink, white, ground = self.columns
        paint = (factors[0] * ink + factors[1] * white + factors[2] * ground) / self.light
        factor = math.exp(edge.log_factor)
        slope = paint * (factor - 1.0) * self.density
        sideways = (v - half) * math.cos(edge.angle_rad) - (u - half) * math.sin(edge.angle_rad)
        return slope * sideways, -slope, paint * factor * self.beyond


def light_prior(count: int) -> tuple[Array, Array]:
    """What is known beforehand of the factors of so many columns: inverse variances and means, each (count,)."""
    return _WEIGHTS[:count], _MEANS[:count]


def is_plausible(factors: Array, edge: ShadowEdge | None) -> bool:
    """Whether these are brightnesses that ink, paper and ground can have."""
    ink, paper, ground = (float(value) for value in factors[:3])
    factor = math.exp(edge.log_factor) if edge is not None else 1.0
    contrast, brightest = (paper - ink) * min(factor, 1.0), max(factor, 1.0)
    return (
        contrast >= _LEAST_CONTRAST
        and ink >= _DARKEST
        and paper * brightest <= _BRIGHTEST
        and abs(ground - (paper + ink) / 2.0) <= 2.0 * (paper - ink)
        and 1.0 / _DEEPEST < factor < _DEEPEST
    )


def light_columns(
    white: Array, board: Array, u: Array, v: Array, half: float, edge: ShadowEdge | None, width: float
) -> Lit:
    """The columns for places (u, v) of a marker whose half side is `half` cells; `width` is the edge's blur in cells."""
    ink, ground = board - white, 1.0 - board
    if edge is None:
        return Lit((ink, white, ground, (u / half - 1.0) * white, (v / half - 1.0) * white), None, None, None)
    z = ((u - half) * math.cos(edge.angle_rad) + (v - half) * math.sin(edge.angle_rad) - edge.offset) / width
    beyond = normal_distribution(z)
    light = 1.0 + (math.exp(edge.log_factor) - 1.0) * beyond
    density = np.exp(-0.5 * z * z) / (math.sqrt(2.0 * math.pi) * width)
    return Lit((ink * light, white * light, ground * light), light, beyond, density)


def light_at(u: Array, v: Array, half: float, edge: ShadowEdge, width: float) -> Array:
    """How bright the light is at places (u, v), (N,); 1 before the edge."""
    z = ((u - half) * math.cos(edge.angle_rad) + (v - half) * math.sin(edge.angle_rad) - edge.offset) / width
    light: Array = 1.0 + (math.exp(edge.log_factor) - 1.0) * normal_distribution(z)
    return light


def likeliest_edge(
    white: Array, board: Array, u: Array, v: Array, half: float, width: float, brightness: Array
) -> ShadowEdge | None:
    """The edge that, of a coarse choice, explains the picture best; None if none explains it much better than even light."""
    angles = np.arange(_DIRECTIONS) * math.pi / _DIRECTIONS
    along = (u - half)[None] * np.cos(angles)[:, None] + (v - half)[None] * np.sin(angles)[:, None]
    offsets = np.array(_OFFSETS_HALVES) * half
    steps = ((along[:, None] - offsets[None, :, None]).reshape(-1, len(u)) / width).astype(np.float32)
    beyond = normal_distribution(steps)
    light = np.float32(1.0) + (np.array(_FACTORS, np.float32)[:, None, None] - np.float32(1.0)) * beyond[None]
    light = np.concatenate((light.reshape(-1, len(u)), np.ones((1, len(u)), np.float32)))
    parts = np.stack((board - white, white, 1.0 - board))
    # Each product of two parts, and of one with the picture, lit by each light: all at once.
    pairs = np.concatenate((parts[_PAIRS[0]] * parts[_PAIRS[1]], parts * brightness)).astype(np.float32)
    A = product(light * light, pairs[:9].T).reshape(-1, 3, 3).astype(np.float64) + _RIDGE * np.eye(3)
    b = product(light, pairs[9:].T).astype(np.float64)
    unexplained = brightness @ brightness - np.einsum("ij,ij->i", b, np.linalg.solve(A, b[..., None])[..., 0])
    best = int(np.argmin(unexplained[:-1]))
    if unexplained[best] > _LARGEST_SHADOW_SHARE * unexplained[-1]:
        return None
    factor, place = divmod(best, len(angles) * len(offsets))
    angle, offset = divmod(place, len(offsets))
    return ShadowEdge(float(angles[angle]), float(offsets[offset]), math.log(_FACTORS[factor]))
