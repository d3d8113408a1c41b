"""What a marker looks like through a lens: its cells as a smooth function of the place, with derivatives."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.markers.family import marker_cells
from alight.markers.layout import PadLayout, PlacedMarker
from services.detector.aided.one_thread import Real, product

Array = NDArray[np.float64]

_ROOT_2_PI = math.sqrt(2.0 * math.pi)
_HIDDEN_SAMPLES = 8
_BOARDS = ((0, 0), (0, 1), (1, 0))
_VALUES = (*_BOARDS, (0, 2), (2, 0), (1, 1))
"""Which derivatives are drawn: how often by v, how often by u."""


@dataclass(frozen=True)
class Shades:
    """White paint and white board at N places, each (N,); `_u`, `_v` are derivatives by cells to the right and down."""

    white: Array
    """Share of white board in what the pixel sees, 0 to 1."""
    board: Array
    """Share of board, black or white."""
    white_u: Array
    white_v: Array
    board_u: Array
    board_v: Array
    white_uu: Array
    white_uv: Array
    white_vv: Array


class Pattern:
    """One marker with a quiet zone of one white cell around it.

    Places are counted in cells: u to the right and v down from the upper left corner of the black outer edge. A Gaussian blur turns each
    cell into a product of two differences of the normal distribution function, so picture and derivatives are exact and need no texture.
    """

    def __init__(self, cells: NDArray[np.float64]) -> None:
        """Take the cells (n, n), 1 for white, border included, first row on top."""
        self.cells = cells
        self.count = cells.shape[0]
        quiet = np.pad(np.asarray(cells, float), 1, constant_values=1.0)
        self._steps = np.diff(np.diff(np.pad(quiet, 1), axis=0), axis=1)
        self._edges = np.arange(-1.0, self.count + 2.0)

    def shades(self, u: Array, v: Array, blur_u: float, blur_v: float) -> Shades:
        """Everything at the places (u, v), blurred with these standard deviations in cells."""
        across, slope_u, bend_u = self._smooth_steps(u, blur_u)
        down, slope_v, bend_v = self._smooth_steps(v, blur_v)
        rows = across @ self._steps.T
        rows_u = slope_u @ self._steps.T
        cover_u, cover_v = across[:, 0] - across[:, -1], down[:, 0] - down[:, -1]
        return Shades(
            white=_dot(rows, down),
            board=cover_u * cover_v,
            white_u=_dot(rows_u, down),
            white_v=_dot(rows, slope_v),
            board_u=(slope_u[:, 0] - slope_u[:, -1]) * cover_v,
            board_v=cover_u * (slope_v[:, 0] - slope_v[:, -1]),
            white_uu=_dot(bend_u @ self._steps.T, down),
            white_uv=_dot(rows_u, slope_v),
            white_vv=_dot(rows, bend_v),
        )

    def raster(self, u: Array, v: Array, blur_u: float, blur_v: float) -> NDArray[np.float32]:
        """Everything on the grid of all u, (columns,), and all v, (rows,), in the order that `texture` names.

        Returns:
            (rows, columns, 9).
        """
        across, down = (
            np.stack(self._smooth_steps(places.astype(np.float32), blur)) for places, blur in ((u, blur_u), (v, blur_v))
        )
        columns = across @ self._steps.T.astype(np.float32)
        # The board without its code is a single cell.
        cover_u, cover_v = (each[:, :, :1] - each[:, :, -1:] for each in (across, down))
        values = [product(down[row], columns[column].T) for row, column in _VALUES]
        boards = [cover_v[row] * cover_u[column].T for row, column in _BOARDS]
        return np.asarray(cv2.merge([values[0], boards[0], *values[1:3], *boards[1:], *values[3:]]), np.float32)

    def cell_shares(self, u: Array, v: Array, blur_u: float, blur_v: float) -> Array:
        """How much each cell, quiet zone included, contributes to each place, (N, (n + 2)^2)."""
        across, down = (
            -np.diff(normal_distribution((places[:, None] - self._edges) / blur))
            for places, blur in ((u, blur_u), (v, blur_v))
        )
        shares: Array = (down[:, :, None] * across[:, None, :]).reshape(len(u), -1)
        return shares

    def _smooth_steps(self, places: NDArray[Real], blur: float) -> tuple[NDArray[Real], NDArray[Real], NDArray[Real]]:
        """The blurred step at every edge, and its first and second derivatives by the place, each (N, n + 3)."""
        z = (places[:, None] - self._edges.astype(places.dtype)) / blur
        density = np.asarray(np.exp(-0.5 * z * z) / (_ROOT_2_PI * blur), places.dtype)
        return normal_distribution(z), density, -z / blur * density


def _dot(a: Array, b: Array) -> Array:
    product: Array = np.einsum("ij,ij->i", a, b)
    return product


def normal_distribution(z: NDArray[Real]) -> NDArray[Real]:
    """The normal distribution function, wrong by at most 2e-4."""
    return np.asarray(0.5 + 0.5 * np.tanh(0.7978845608 * z * (1.0 + 0.044715 * z * z)), z.dtype)


def pattern_of(marker: PlacedMarker, layout: PadLayout) -> Pattern:
    """The marker as it is printed: where smaller markers lie over it, its cells have the mean brightness of what is there."""
    cells = marker_cells(marker.family, marker.id).astype(float)
    for other in layout.markers:
        if other.side_m < marker.side_m:
            _print_over(cells, marker, other)
    return Pattern(cells)


def _print_over(cells: Array, marker: PlacedMarker, other: PlacedMarker) -> None:
    """Replace what `other` and its quiet zone cover, by sampling."""
    count, codes = cells.shape[0], marker_cells(other.family, other.id)
    along = (np.arange(count * _HIDDEN_SAMPLES) + 0.5) / _HIDDEN_SAMPLES
    u, v = np.meshgrid(along, along)
    cell_m = marker.side_m / count
    x, y = (u - count / 2.0) * cell_m, (count / 2.0 - v) * cell_m
    c, s = math.cos(marker.rotation_rad), math.sin(marker.rotation_rad)
    x, y = marker.x_m - other.x_m + c * x - s * y, marker.y_m - other.y_m + s * x + c * y
    c, s = math.cos(other.rotation_rad), math.sin(other.rotation_rad)
    x, y = c * x + s * y, c * y - s * x
    size, quiet = codes.shape[0], np.pad(codes, 1, constant_values=1)
    column, row = np.floor(x / other.side_m * size + size / 2.0) + 1, np.floor(size / 2.0 - y / other.side_m * size) + 1
    inside = (column >= 0) & (column < size + 2) & (row >= 0) & (row < size + 2)
    fine = np.kron(cells, np.ones((_HIDDEN_SAMPLES, _HIDDEN_SAMPLES)))
    fine[inside] = quiet[row[inside].astype(int), column[inside].astype(int)]
    cells[:] = fine.reshape(count, _HIDDEN_SAMPLES, count, _HIDDEN_SAMPLES).mean(axis=(1, 3))
