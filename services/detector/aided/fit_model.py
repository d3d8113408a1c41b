"""The picture as a guess has it, and how it would change: everything that one step of a fit is worked out from."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from services.detector.aided import print_plane, texture
from services.detector.aided.guess import Guess
from services.detector.aided.light import light_columns, light_prior
from services.detector.aided.one_thread import gram
from services.detector.aided.patch import Patch
from services.detector.aided.texture import PatternTexture

Array = NDArray[np.float64]

POSE = slice(0, 6)
"""Of the unknowns: shift as a part of the distance, turn; then come logarithms of both blurs, their moment, light, and a shadow's edge."""

_PLANE = 9
_LEAST_NOISE = 1.5


@dataclass(frozen=True)
class PrintScale:
    """How large a marker appears."""

    px_per_cell_u: float
    """Pixels of the whole picture a cell, along u, in the marker's middle."""
    px_per_cell_v: float

    def blur_cells(self, guess: Guess, shrink: int) -> tuple[float, float, float]:
        """The blur of a picture made smaller: standard deviations and moment, cells."""
        # A pixel of a smaller picture has a larger area of its own.
        area = (shrink**2 - 1.0) / 12.0
        blur = guess.blur
        return (
            math.sqrt(blur.u_px**2 + area) / self.px_per_cell_u,
            math.sqrt(blur.v_px**2 + area) / self.px_per_cell_v,
            blur.uv_px2 / (self.px_per_cell_u * self.px_per_cell_v),
        )


@dataclass(frozen=True)
class FitModel:
    """A guess laid over a patch."""

    factors: Array
    """Of the light's columns, (k,): brightness of ink, board and ground, and so on."""
    residual: Array
    """(N,): picture minus model, grey levels."""
    normal: Array
    """(m, m): the product of the transposed Jacobian with itself."""
    gradient: Array
    """(m,): of it with the residual."""
    motions: Array
    """(9, 6), how places move with the pose."""
    blank_residual2: float
    """Sum of squares that remains where the board is taken for blank: what light and ground do not explain."""

    @property
    def residual2(self) -> float:
        """Sum of the squared residuals."""
        return float(self.residual @ self.residual)

    @property
    def code_likeness(self) -> float:
        """Correlation of the code alone with what light and ground leave unexplained, 0 to 1."""
        return math.sqrt(max(1.0 - self.residual2 / max(self.blank_residual2, 1e-9), 0.0))


def fit_model(
    pattern: PatternTexture, patch: Patch, guess: Guess, side_m: float, count: int, scale: PrintScale
) -> FitModel:
    """Lay a guess over a patch; the light is that which fits best."""
    plane = print_plane.cells_from_rays(guess.view, side_m, count)
    places = plane @ patch.rays
    places /= places[2]
    u, v = places[0], places[1]
    blur_u, blur_v, moment = scale.blur_cells(guess, patch.shrink)
    shades = pattern.shades(u, v, blur_u, blur_v)
    white = shades[texture.WHITE]
    white += moment * shades[texture.WHITE_UV]
    light = light_columns(white, shades[texture.BOARD], u, v, count / 2.0, guess.edge, (blur_u + blur_v) / 2.0)
    k, edges = len(light.columns), 0 if guess.edge is None else 3
    rows = np.empty((_PLANE + 3 + k + edges + 1, len(u)))
    lights = rows[_PLANE + 3 : _PLANE + 3 + k]
    lights[:] = light.columns
    factors, blank = _brightness(lights, patch.brightness)
    ink, paper, ground = light.local(factors)
    gain, step = paper - ink, ink - ground
    slopes = np.empty((3, len(u)))
    slopes[0] = gain * shades[texture.WHITE_U] + step * shades[texture.BOARD_U]
    slopes[1] = gain * shades[texture.WHITE_V] + step * shades[texture.BOARD_V]
    slopes[2] = -(slopes[0] * u + slopes[1] * v)
    np.multiply(slopes[:, None], places[None], out=rows[:_PLANE].reshape(3, 3, -1))
    blur, px2 = guess.blur, scale.px_per_cell_u * scale.px_per_cell_v
    weights = (blur.u_px / scale.px_per_cell_u) ** 2, (blur.v_px / scale.px_per_cell_v) ** 2, 1.0 / px2
    np.multiply(shades[texture.WHITE_UU :], np.array(weights)[:, None], out=rows[_PLANE : _PLANE + 3])
    rows[_PLANE : _PLANE + 3] *= gain
    if guess.edge is not None:
        rows[-4:-1] = light.edge_slopes(factors, u, v, count / 2.0, guess.edge)
    np.subtract(patch.brightness, factors @ lights, out=rows[-1])
    motions = print_plane.motions(guess.view, side_m, count, plane)
    normal, gradient = _by_unknowns(gram(rows.T), motions)
    return FitModel(factors, rows[-1], normal, gradient, motions, blank)


def _by_unknowns(products: Array, motions: Array) -> tuple[Array, Array]:
    """From products of the homography's rows to those of the pose's."""
    m = len(products) - _PLANE + 6
    full = np.empty((m, m))
    above = motions.T @ products[:_PLANE]
    full[:6, :6] = above[:, :_PLANE] @ motions
    full[:6, 6:] = above[:, _PLANE:]
    full[6:, :6] = above[:, _PLANE:].T
    full[6:, 6:] = products[_PLANE:, _PLANE:]
    return full[:-1, :-1], full[:-1, -1]


def _brightness(lights: Array, brightness: Array) -> tuple[Array, float]:
    """The light that fits best, given what is known of it beforehand, and the sum of squares that a blank board would leave."""
    k = len(lights)
    A, b = lights @ lights.T, lights @ brightness
    weights, means = light_prior(k)
    M = A.copy()
    M.flat[:: k + 1] += _LEAST_NOISE**2 * weights
    _, solved = cv2.solve(M, b + _LEAST_NOISE**2 * weights * means, flags=cv2.DECOMP_CHOLESKY)
    factors = np.asarray(solved, np.float64).ravel()
    # Blank: ink and board are one.
    a11, a12, a22 = A[0, 0] + 2.0 * A[0, 1] + A[1, 1] + 1e-2, A[0, 2] + A[1, 2], A[2, 2] + 1e-2
    b1, b2 = b[0] + b[1], b[2]
    explained = (a22 * b1 * b1 - 2.0 * a12 * b1 * b2 + a11 * b2 * b2) / (a11 * a22 - a12 * a12)
    return factors, max(float(brightness @ brightness - explained), 0.0)
