"""Whether what was fitted is the pad's marker, and nothing that looks like it."""

import math

import numpy as np

from services.detector.aided.alignment import Alignment
from services.detector.aided.marker_view import TiltPrior
from services.detector.detector import Prior

LEAST_LIKENESS = 0.93
LEAST_CODE_LIKENESS = 0.935
"""Measured on rendered frames with other seeds than the benches': pads from 12 m to 40 m, shadows' edges across many of them, have 0.945 and
more; of some 3000 places in frames with other square patterns, the likeliest ones of each frame, one has 0.914 and the next 0.90."""
_LEAST_SIDE_PX = 5.5
_TILT_SIGMAS = 3.5


def is_marker(alignment: Alignment, noise: float, tilt: TiltPrior, prior: Prior | None) -> bool:
    """Whether a fit is good enough, and lies as it can lie."""
    return (
        alignment.code_likeness(noise) >= LEAST_CODE_LIKENESS
        and alignment.likeness >= LEAST_LIKENESS
        and alignment.plausible
        and alignment.side_px >= _LEAST_SIDE_PX
        and _fits_tilt(alignment, tilt)
        and _fits_height(alignment, prior)
    )


def _fits_tilt(alignment: Alignment, tilt: TiltPrior) -> bool:
    cosine = float(np.asarray(alignment.view.R[:, 2]) @ tilt.normal_camera)
    return cosine > 0.0 and math.acos(min(cosine, 1.0)) <= _TILT_SIGMAS * tilt.sigma_rad + 0.05


def _fits_height(alignment: Alignment, prior: Prior | None) -> bool:
    if prior is None or prior.height_m is None:
        return True
    height_m = -float(np.asarray(alignment.view.R[:, 2]) @ alignment.view.t)
    return abs(height_m - prior.height_m) <= 4.0 * prior.height_sigma_m + 0.1 * prior.height_m
