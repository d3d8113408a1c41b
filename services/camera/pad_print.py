"""The print itself: the marker on its white board, as textures whose every texel is an exact mean over its area."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.markers.family import marker_cells

Texture = NDArray[np.uint8]

BLUR_TEXELS = 1.0
"""Standard deviation of the blur that every texture has, texels: what is sampled once a pixel must hold no finer detail than that."""

_MARGIN_TEXELS = 4
_STEPS_PER_OCTAVE = 4
_LARGEST_SIDE_TEXELS = 1448


class PadPrint:
    """A square board with the marker in its middle, in two shades of grey."""

    def __init__(
        self, family: str, number: int, *, side_m: float, board_m: float, black_level: float, white_level: float
    ) -> None:
        """Look the marker up.

        Args:
            family: Marker family.
            number: The marker's number in it.
            side_m: The marker's black outer edge, metres.
            board_m: Edge of the white board around it, metres; not smaller than the marker.
            black_level: Brightness of the ink, grey levels.
            white_level: Brightness of the board, grey levels.
        """
        cells = marker_cells(family, number)
        self.side_m = side_m
        self.board_m = max(board_m, side_m)
        count = cells.shape[0]
        self._shades = np.full((count + 2, count + 2), white_level)
        self._shades[1:-1, 1:-1] = black_level + (white_level - black_level) * cells
        margin = (self.board_m - side_m) / 2.0
        self._edges_m = np.concatenate(([0.0], margin + np.linspace(0.0, side_m, count + 1), [self.board_m]))
        self._textures: dict[int, Texture] = {}

    def texture(self, texel_m: float) -> tuple[Texture, float]:
        """The whole board with texels of about the wanted size (within an eighth of an octave).

        Args:
            texel_m: Wanted edge of one texel, metres.

        Returns:
            The texture (n, n, 2), first row at the print's upper edge, and its true texel size in metres. The first channel is the
            brightness, a mean over the texel's area, so that cells of any size keep theirs; the second says 255: covered.
        """
        step = round(_STEPS_PER_OCTAVE * math.log2(self.board_m / max(texel_m, self.board_m / _LARGEST_SIDE_TEXELS)))
        step = max(step, 0)
        if step not in self._textures:
            self._textures[step] = self._averaged(max(round(2.0 ** (step / _STEPS_PER_OCTAVE)), 1))
        texture = self._textures[step]
        return texture, self.board_m / (texture.shape[0] - 2 * _MARGIN_TEXELS)

    def _averaged(self, side_texels: int) -> Texture:
        """Area means, then the blur; both act on rows and columns apart, so they are done on the rows' shares alone."""
        bounds = np.linspace(0.0, self.board_m, side_texels + 1)
        upper = np.minimum(bounds[1:, None], self._edges_m[None, 1:])
        lower = np.maximum(bounds[:-1, None], self._edges_m[None, :-1])
        share = np.clip(upper - lower, 0.0, None) * (side_texels / self.board_m)
        share = np.pad(share, ((_MARGIN_TEXELS, _MARGIN_TEXELS), (0, 0)))
        soft = np.asarray(cv2.GaussianBlur(share, (1, 9), BLUR_TEXELS, borderType=cv2.BORDER_CONSTANT), np.float32)
        levels = (soft @ self._shades.astype(np.float32)) @ soft.T
        cover = soft.sum(axis=1)
        # Shades and shares are never negative: half a level more makes cutting off round.
        return np.asarray(cv2.merge([_cut(levels), _cut(np.outer(255.0 * cover, cover))]), np.uint8)


def _cut(levels: NDArray[np.float32]) -> Texture:
    levels += np.float32(0.5)
    return np.minimum(levels, np.float32(255.0), out=levels).astype(np.uint8)
