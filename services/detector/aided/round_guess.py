"""Rounding where a fit begins, so that what it ends with depends on the picture alone, to the last bit.

A fit that follows the pad begins at the last frame's. Were it to go on from there, one frame that was lost to a recording would change the last
digits of all that follow, and no replay could be compared. From a rounded beginning, fits that came to about the same place by
different ways go the same way from there on.
"""

import math

import numpy as np

from alight.geometry.rotation import R_from_quaternion, quaternion_from_R, quaternion_normalised
from services.detector.aided.guess import Blur, Guess
from services.detector.aided.light import ShadowEdge
from services.detector.aided.marker_view import MarkerView

_CELLS = 0.1
_TURN = 2.0**-6
_LOG_DEPTH = 2.0**-6
_BLUR = 2.0**-3
_EDGE_RAD, _EDGE_CELLS, _EDGE_LOG = 2.0**-4, 2.0**-2, 2.0**-3


def rounded(guess: Guess, cell_m: float) -> Guess:
    """The guess on a grid of about a tenth of a cell."""
    x, y, z = guess.view.t.tolist()
    depth_m = math.exp(_to(math.log(z), _LOG_DEPTH))
    # A power of two does not change when the depth changes a little.
    step = 2.0 ** math.floor(math.log2(_CELLS * cell_m / depth_m))
    t = depth_m * np.array((_to(x / z, step), _to(y / z, step), 1.0))
    q = quaternion_from_R(guess.view.R)
    sign = 1.0 if max(q, key=abs) >= 0.0 else -1.0
    w, a, b, c = (_to(sign * part, _TURN) for part in q)
    R = R_from_quaternion(quaternion_normalised((w, a, b, c)))
    blur = guess.blur
    coarse = Blur(_log_to(blur.u_px, _BLUR), _log_to(blur.v_px, _BLUR), _to(blur.uv_px2, _BLUR))
    return Guess(MarkerView(R, t), coarse, _rounded_edge(guess.edge))


def _rounded_edge(edge: ShadowEdge | None) -> ShadowEdge | None:
    if edge is None:
        return None
    return ShadowEdge(_to(edge.angle_rad, _EDGE_RAD), _to(edge.offset, _EDGE_CELLS), _to(edge.log_factor, _EDGE_LOG))


def _to(value: float, step: float) -> float:
    return round(value / step) * step


def _log_to(value: float, step: float) -> float:
    return math.exp(_to(math.log(value), step))
