"""Where to look first: around the place where the pad was in the last frame."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_LARGEST_GAP_NS = 500_000_000
_MARGIN_SIDES = 0.35
_LEAST_MARGIN_PX = 16.0
_REDUCED_SIDE_PX = 64.0


@dataclass(frozen=True)
class Window:
    """A part of the picture, and by how much to shrink it before the search."""

    left: int
    top: int
    right: int
    bottom: int
    shrink: int
    """Whole number; a large marker is found as well in a smaller picture."""
    side_px: float
    """About how long the marker's sides are in the whole picture."""


class SearchWindow:
    """Follows the pad from frame to frame."""

    def __init__(self) -> None:
        self._corners_px: NDArray[np.float64] | None = None
        self._velocity_px_per_ns: NDArray[np.float64] = np.zeros(2)
        self._seen_at_ns = 0

    def predicted(self, at_ns: int, width_px: int, height_px: int) -> Window | None:
        """The window for a frame; None if the pad was not in the last one or that was too long ago."""
        elapsed_ns = at_ns - self._seen_at_ns
        if self._corners_px is None or not 0 < elapsed_ns <= _LARGEST_GAP_NS:
            return None
        shift_px = self._velocity_px_per_ns * elapsed_ns
        low, high = self._corners_px.min(axis=0) + shift_px, self._corners_px.max(axis=0) + shift_px
        spread_px = float((high - low).max())
        side_px = float(np.linalg.norm(self._corners_px - np.roll(self._corners_px, 1, axis=0), axis=1).mean())
        margin_px = max(_MARGIN_SIDES * spread_px, _LEAST_MARGIN_PX) + float(np.abs(shift_px).max())
        left, top = (max(math.floor(value), 0) for value in (low - margin_px).tolist())
        right = min(math.ceil(float(high[0]) + margin_px), width_px)
        bottom = min(math.ceil(float(high[1]) + margin_px), height_px)
        if right - left < _LEAST_MARGIN_PX or bottom - top < _LEAST_MARGIN_PX:
            return None
        return Window(left, top, right, bottom, max(int(side_px / _REDUCED_SIDE_PX), 1), side_px)

    def seen(self, corners_px: NDArray[np.float64], at_ns: int) -> None:
        """The pad is here."""
        elapsed_ns = at_ns - self._seen_at_ns
        if self._corners_px is not None and 0 < elapsed_ns <= _LARGEST_GAP_NS:
            self._velocity_px_per_ns = (corners_px.mean(axis=0) - self._corners_px.mean(axis=0)) / elapsed_ns
        else:
            self._velocity_px_per_ns = np.zeros(2)
        self._corners_px, self._seen_at_ns = corners_px, at_ns

    def lost(self) -> None:
        """The pad is nowhere in the frame."""
        self._corners_px = None
