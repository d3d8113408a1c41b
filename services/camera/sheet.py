"""A square piece of the print, as textures whose every texel is a mean over its area."""

import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.markers.layout import PlacedMarker
from alight.markers.print_grid import PrintGrid, overlaps_m, turned_whiteness

Plane = NDArray[np.uint8]
Levels = NDArray[np.float32]

BLUR_TEXELS = 1.0
"""Standard deviation of the blur that every texture has, texels: what is sampled once a pixel must hold no finer detail than that."""

_MARGIN_TEXELS = 4
_WHOLLY_INSIDE = 2 * _MARGIN_TEXELS
_STEPS_PER_OCTAVE = 4
_LARGEST_SIDE_TEXELS = 1448
_OUTLINE_POINTS_A_SIDE = 6


@dataclass(frozen=True)
class Texture:
    """A sheet in texels, first row at the print's upper edge; (n, n) each. Two planes are sampled quicker than one with two channels."""

    levels: Plane
    """Brightness, a mean over the texel's area, so that cells of any size keep theirs; 0 beside the sheet."""
    cover: Plane
    """How much of the texel the sheet covers, 0 to 255."""

    @property
    def side_texels(self) -> int:
        """Edge of the whole picture, the empty margin included."""
        return int(self.levels.shape[0])

    def covers(self, texels: Levels) -> bool:
        """Whether all of these places (..., 2), and all between them, lie on the sheet."""
        return float(texels.min()) >= _WHOLLY_INSIDE and float(texels.max()) <= self.side_texels - 1 - _WHOLLY_INSIDE


class Sheet:
    """White with ink on it, in two shades of grey; lies somewhere on the pad, turned somehow."""

    def __init__(
        self,
        grid: PrintGrid,
        side_m: float,
        *,
        black_level: float,
        white_level: float,
        askew: tuple[PlacedMarker, ...] = (),
        place_m: tuple[float, float] = (0.0, 0.0),
        rotation_rad: float = 0.0,
    ) -> None:
        """Take the print.

        Args:
            grid: All that lies square to the sheet.
            side_m: Its edge, metres.
            black_level: Brightness of the ink, grey levels.
            white_level: Brightness of the paper, grey levels.
            askew: Markers over that which do not, in the sheet's own frame (origin in its middle, x right, y up).
            place_m: Its middle, pad frame, metres.
            rotation_rad: How far it is turned counter-clockwise on the pad, rad.
        """
        self.side_m, self.place_m = side_m, place_m
        self._black_level, self._white_level = black_level, white_level
        self._grid, self._askew = grid, askew
        c, s = math.cos(rotation_rad), math.sin(rotation_rad)
        self._R_pad_sheet = np.array([[c, -s], [s, c]])
        self._is_plain = place_m == (0.0, 0.0) and rotation_rad == 0.0
        self._textures: dict[int, Texture] = {}

    @property
    def finest_texel_m(self) -> float:
        """Edge of the smallest texel that `texture` makes, metres."""
        return self.side_m / _LARGEST_SIDE_TEXELS

    @cached_property
    def outline_m(self) -> NDArray[np.float64]:
        """Points around it, (N, 3), pad frame, metres."""
        half_m = self.side_m / 2.0
        along = np.linspace(-half_m, half_m, _OUTLINE_POINTS_A_SIDE)
        edge = np.full_like(along, half_m)
        x = np.concatenate((along, along, edge, -edge))
        y = np.concatenate((edge, -edge, along, along))
        if self._is_plain:
            return np.column_stack((x, y, np.zeros_like(x)))
        placed = np.column_stack((x, y)) @ self._R_pad_sheet.T + self.place_m
        return np.column_stack((placed, np.zeros_like(x)))

    def texels(self, points_m: Levels, texel_m: float, side_texels: int) -> Levels:
        """Where points (..., 2) of the pad, metres, lie in a texture of that texel and size; column and row."""
        own_m = points_m
        if not self._is_plain:
            moved_m = points_m - np.array(self.place_m, np.float32)
            own_m = np.asarray(moved_m @ self._R_pad_sheet.astype(np.float32), np.float32)
        centre = np.float32(side_texels / 2.0 - 0.5)
        return np.asarray(own_m * np.array((1.0 / texel_m, -1.0 / texel_m), np.float32) + centre, np.float32)

    def texture(self, texel_m: float) -> tuple[Texture, float]:
        """The whole sheet with texels of about the wanted size (within an eighth of an octave).

        Args:
            texel_m: Wanted edge of one texel, metres.

        Returns:
            The texture and its true texel size in metres.
        """
        step = max(round(_STEPS_PER_OCTAVE * math.log2(self.side_m / max(texel_m, self.finest_texel_m))), 0)
        if step not in self._textures:
            self._textures[step] = self._averaged(max(round(2.0 ** (step / _STEPS_PER_OCTAVE)), 1))
        texture = self._textures[step]
        return texture, self.side_m / (texture.side_texels - 2 * _MARGIN_TEXELS)

    def draw_all(self, finest_texel_m: float) -> None:
        """Make every texture with texels down to this size now, metres: the largest take longer than a frame may."""
        octaves = math.log2(self.side_m / max(finest_texel_m, self.finest_texel_m))
        for step in range(max(round(_STEPS_PER_OCTAVE * octaves), 0) + 1):
            self.texture(self.side_m / 2.0 ** (step / _STEPS_PER_OCTAVE))

    def _averaged(self, side_texels: int) -> Texture:
        """Area means, then the blur; both act on rows and columns apart, so they are done on the rows' shares alone."""
        hard_down, hard_across = (self._shares(seams_m, side_texels) for seams_m in (self._grid.y_m, self._grid.x_m))
        down, across = _soft(hard_down, (1, 9)), _soft(hard_across, (1, 9))
        cover = down.sum(axis=1)
        if self._askew:
            levels = _soft(self._levels_with_askew(hard_down, hard_across, side_texels), (9, 9))
        else:
            levels = self._levels(down, across)
        # Shades and shares are never negative: half a level more makes cutting off round.
        return Texture(_cut(levels), _cut(np.outer(255.0 * cover, cover)))

    def _shares(self, seams_m: NDArray[np.float64], side_texels: int) -> NDArray[np.float64]:
        bounds = np.linspace(0.0, self.side_m, side_texels + 1)
        share = overlaps_m(bounds, seams_m) * (side_texels / self.side_m)
        return np.pad(share, ((_MARGIN_TEXELS, _MARGIN_TEXELS), (0, 0)))

    def _levels(self, down: Levels, across: Levels) -> Levels:
        shades = self._black_level + (self._white_level - self._black_level) * self._grid.white
        return np.asarray((down @ shades.astype(np.float32)) @ across.T, np.float32)

    def _levels_with_askew(
        self, down: NDArray[np.float64], across: NDArray[np.float64], side_texels: int
    ) -> NDArray[np.float64]:
        levels = self._levels(down.astype(np.float32), across.astype(np.float32)).astype(float)
        for marker in self._askew:
            white, cover = (np.pad(each, _MARGIN_TEXELS) for each in turned_whiteness(marker, self.side_m, side_texels))
            levels = levels * (1.0 - cover) + self._black_level * (cover - white) + self._white_level * white
        return levels


def _soft(values: NDArray[np.float64], kernel: tuple[int, int]) -> Levels:
    return np.asarray(cv2.GaussianBlur(values, kernel, BLUR_TEXELS, borderType=cv2.BORDER_CONSTANT), np.float32)


def _cut(levels: Levels) -> Plane:
    levels += np.float32(0.5)
    return np.minimum(levels, np.float32(255.0), out=levels).astype(np.uint8)
