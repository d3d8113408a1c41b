"""What a fit seeks: where a marker is, how blurred, and how it is lit."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from services.detector.aided.light import ShadowEdge
from services.detector.aided.marker_view import MarkerView

Array = NDArray[np.float64]

BLUR_PX = 0.8
"""How blurred pictures mostly are."""

_LEAST_BLUR_PX = 0.35
_LARGEST_BLUR_STEP = 0.3
_LARGEST_EDGE_STEP = np.array((0.2, 0.6, 0.3))


@dataclass(frozen=True)
class Blur:
    """Of lens, pixel and motion: standard deviations along the marker's axes, and the moment between them, pixels of the whole picture."""

    u_px: float = BLUR_PX
    v_px: float = BLUR_PX
    uv_px2: float = 0.0


@dataclass(frozen=True)
class Guess:
    """Where a fit begins, and where it has come to."""

    view: MarkerView
    blur: Blur = Blur()
    edge: ShadowEdge | None = None

    def moved(self, step: Array) -> "Guess":
        """This and a step: shift as a part of the distance (3), turn (3), logarithms of both blurs and their moment, light, and the shadow's edge (3)."""
        shift, turn = step[:3] * float(self.view.t[2]), step[3:6]
        log_u, log_v, moment = step[6:9].tolist()
        R = np.asarray(cv2.Rodrigues(turn)[0], float) @ self.view.R
        blur = Blur(_limited(self.blur.u_px, log_u), _limited(self.blur.v_px, log_v), self.blur.uv_px2 + moment)
        edge = self.edge
        if edge is not None:
            angle, offset, growth = np.clip(step[-3:], -_LARGEST_EDGE_STEP, _LARGEST_EDGE_STEP).tolist()
            edge = ShadowEdge(edge.angle_rad + angle, edge.offset + offset, edge.log_factor + growth)
        return Guess(MarkerView(R, self.view.t + shift), blur, edge)


def _limited(blur_px: float, log_step: float) -> float:
    bounded = min(max(log_step, -_LARGEST_BLUR_STEP), _LARGEST_BLUR_STEP)
    return max(blur_px * math.exp(bounded), _LEAST_BLUR_PX)
