"""Places where the pad may be, from something else than the search for its pattern."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from services.detector.detector import View


@dataclass(frozen=True)
class Place:
    """Where to look for the pattern. It may well be something else: what is looked at there is verified."""

    x_px: float
    y_px: float
    """Centre of the pad's largest marker in the picture; the upper left pixel's centre is (0, 0)."""
    side_px: float
    """About how long the marker's sides are there, pixels."""
    reach_px: float
    """By how much the centre may be off to each side, pixels."""

    def side_at_unit_distance(self, camera: PinholeCamera, normal_camera: NDArray[np.float64]) -> float:
        """How long the marker's sides are if the plane of the print is one unit below the camera; NaN if it is not below there.

        Args:
            camera: Of the picture.
            normal_camera: Unit vector out of the print, camera frame, (3,).
        """
        half = self.side_px / 2.0
        steps = np.array(((half, 0.0), (0.0, half), (-half, 0.0), (0.0, -half)))
        rays = np.column_stack((camera.undistorted(steps + np.array((self.x_px, self.y_px))), np.ones(4)))
        depths = -(rays @ normal_camera)
        if not (np.isfinite(depths).all() and depths.min() > 0.0):
            return float("nan")
        on_print = rays / depths[:, None]
        return float(np.linalg.norm(on_print[:2] - on_print[2:], axis=1).mean())


class Places(Protocol):
    """Says where the pad may be."""

    name: str
    """Of the detector that looks there."""

    def places(self, view: View) -> Sequence[Place]:
        """Of one frame, the likeliest first."""
        ...

    def counters(self) -> Mapping[str, int]:
        """Its own counters since start, for `health`."""
        ...
