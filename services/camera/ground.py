"""The ground around the pad: a surface with something to see at every height, from single grains to fields.

Two layers add up. The fine one is a tile with a pyramid of coarser versions, each a mean over area; the coarse one lies
once over the neighbourhood and hides that the fine one repeats.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

Texture = NDArray[np.uint8]
Field = NDArray[np.float32]

FINE_TEXEL_M = 0.004
_TILE_TEXELS = 2048
_MARGIN_TEXELS = 1280
_LEVELS = 8

COARSE_TEXEL_M = 0.25
_COARSE_TEXELS = 1024

MEAN_LEVEL = 118
_FINE_OCTAVES = ((2048, 7.0), (1024, 7.0), (512, 6.0), (256, 6.0), (128, 6.0), (64, 6.0), (32, 5.0), (16, 5.0))
_COARSE_OCTAVES = ((256, 6.0), (128, 7.0), (64, 8.0), (32, 8.0), (16, 7.0))
_STONES = 420
_CRACKS = 9


class Ground:
    """Textures of the ground plane, in grey levels."""

    def __init__(self, random: np.random.Generator) -> None:
        fine = _noise(random, _TILE_TEXELS, _FINE_OCTAVES) + MEAN_LEVEL
        _strew(random, fine)
        self._levels = [_repeated(level) for level in _pyramid(fine)]
        self.coarse: Texture = _grey(_noise(random, _COARSE_TEXELS, _COARSE_OCTAVES) + 128)
        """The coarse layer, 128 for no change, texels of `COARSE_TEXEL_M`, periodic."""

    def fine(self, texel_m: float) -> tuple[Texture, float, int]:
        """The fine layer at the resolution next to the wanted one.

        Args:
            texel_m: Wanted edge of one texel, metres.

        Returns:
            The texture, its texel size in metres, and its period in texels; it is somewhat larger than one period.
        """
        wanted = math.log2(max(texel_m, FINE_TEXEL_M) / FINE_TEXEL_M)
        level = min(round(wanted), len(self._levels) - 1)
        return self._levels[level], FINE_TEXEL_M * 2**level, _TILE_TEXELS >> level


def _noise(random: np.random.Generator, side: int, octaves: tuple[tuple[int, float], ...]) -> Field:
    total = np.zeros((side, side), np.float32)
    for cells, amplitude in octaves:
        values = random.standard_normal((cells, cells), np.float32) * np.float32(amplitude)
        scale = side // cells
        if scale > 1:
            around = np.pad(values, 2, mode="wrap")
            large = np.asarray(cv2.resize(around, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR), np.float32)
            values = large[2 * scale : -2 * scale, 2 * scale : -2 * scale]
        total += values
    return total


def _strew(random: np.random.Generator, tile: Field) -> None:
    """Stones, leaves and cracks; what crosses the tile's edge goes on at the opposite one."""
    side = tile.shape[0]
    radii_m = 0.006 * 12.0 ** random.random(_STONES)
    for radius_m in radii_m:
        axes = (radius_m / FINE_TEXEL_M) * random.uniform(0.5, 1.0, 2)
        centre, angle = random.uniform(0, side, 2), random.uniform(0, 360)
        shade = MEAN_LEVEL + random.choice((-1.0, 1.0)) * random.uniform(12, 60)
        for shift in _shifts(centre, float(axes.max()), side):
            ellipse = (tuple((centre + shift).tolist()), tuple((2.0 * axes).tolist()), float(angle))
            cv2.ellipse(tile, ellipse, float(shade), -1, cv2.LINE_AA)
    for _ in range(_CRACKS):
        steps = random.normal(0, 14, (160, 2)) + random.normal(0, 9, 2)
        points = np.rint(random.uniform(0, side, 2) + np.cumsum(steps, axis=0)).astype(np.int32)
        for move in ((0, 0), (side, 0), (-side, 0), (0, side), (0, -side)):
            cv2.polylines(tile, [points + np.array(move, np.int32)], False, MEAN_LEVEL - 45.0, 2)


def _shifts(centre: NDArray[np.float64], reach: float, side: int) -> list[NDArray[np.float64]]:
    choices = [
        [0.0] + ([float(side)] if c < reach else []) + ([-float(side)] if c > side - reach else []) for c in centre
    ]
    return [np.array((dx, dy)) for dx in choices[0] for dy in choices[1]]


def _pyramid(fine: Field) -> list[Texture]:
    levels = [fine]
    while len(levels) < _LEVELS:
        side = levels[-1].shape[0] // 2
        levels.append(np.asarray(cv2.resize(levels[-1], (side, side), interpolation=cv2.INTER_AREA)))
    return [_grey(level) for level in levels]


def _repeated(tile: Texture) -> Texture:
    """The tile laid out until a whole view fits in, wherever in the first tile it begins."""
    side = tile.shape[0]
    times = math.ceil((side + _MARGIN_TEXELS) / side)
    wanted = side + _MARGIN_TEXELS
    return np.ascontiguousarray(np.tile(tile, (times, times))[:wanted, :wanted])


def _grey(values: Field) -> Texture:
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)
