"""Whether what was fitted is the pad's marker, and nothing that looks like it."""

import math

import numpy as np

from services.detector.aided.alignment import Aligner, Alignment
from services.detector.aided.marker_view import TiltPrior
from services.detector.aided.one_thread import gram
from services.detector.detector import Prior

LEAST_LIKENESS = 0.905
"""Of the whole fit."""
LEAST_CODE_LIKENESS = 0.975
"""Of the code, with the picture's noise taken out, where the marker may be anywhere. Measured on rendered frames with other seeds than the benches': of
1170 pads from 8 m to 40 m, the edges of shadows across many of them, six have less, two of which have 0.945 to 0.975; in 240 frames strewn with other
square patterns two places have 0.950 and 0.952."""
LEAST_FORETOLD_CODE_LIKENESS = 0.945
"""The same where place and height are known, or the marker was a moment ago."""
LEAST_NOISY_LIKENESS = 0.88
"""Of the code, the noise not taken out."""
LEAST_CODE_TO_NOISE = 2.8
"""How much more the code must stand out than the noise does: chance fits a pattern to noise."""
LEAST_FORETOLD_CODE_TO_NOISE = 2.0
"""The same where height and place are known: of so few places chance makes fewer look like a marker. Deep shadows at 40 m leave 2.1 and more."""
LARGEST_CELL_ERROR = 0.55
"""How far the likeliest brightness of any cell may be from its colour, as a part of the contrast. Pads at 40 m reach 0.5: there the picture hardly tells."""

LARGEST_FAINT_CELL_ERROR = 0.35
"""The same for a code that stands out so little. Those pads reach 0.23."""

LARGEST_CORNER_SIGMA_PX = 1.5
"""Of a pad so near that much of it is out of the picture the far corners are made up. Below 0.5 m one fix of 65 descents
was 4.7 cm off, of a pad whose corners claimed 3 px before the claims of such fits were raised, see `alignment`."""

_CELL_SIGMA = 0.35
_LEAST_SIDE_PX = 5.5
_TILT_SIGMAS = 3.5
_LEAST_NOISE = 1.0


def is_marker(alignment: Alignment, aligner: Aligner, noise: float, tilt: TiltPrior, prior: Prior | None) -> bool:
    """Whether a fit that may have begun anywhere, or only near a prediction, shows the marker, lying as it can lie."""
    foretold = prior is not None and prior.height_m is not None and prior.centre_px is not None
    least = LEAST_FORETOLD_CODE_TO_NOISE if foretold else LEAST_CODE_TO_NOISE
    like = LEAST_FORETOLD_CODE_LIKENESS if foretold else LEAST_CODE_LIKENESS
    if not (_shows(alignment, noise, tilt, like, least) and _fits_height(alignment, prior)):
        return False
    faint = alignment.unexplained_without_code < LEAST_CODE_TO_NOISE * noise
    largest = LARGEST_FAINT_CELL_ERROR if faint else LARGEST_CELL_ERROR
    return largest_cell_error(alignment, aligner, noise) <= largest


def is_still_marker(alignment: Alignment, noise: float, tilt: TiltPrior) -> bool:
    """Whether a fit that began where the marker was a moment ago shows it."""
    return _shows(alignment, noise, tilt, LEAST_FORETOLD_CODE_LIKENESS, LEAST_CODE_TO_NOISE)


def _shows(
    alignment: Alignment, noise: float, tilt: TiltPrior, least_code_likeness: float, least_code_to_noise: float
) -> bool:
    return (
        alignment.plausible
        and alignment.likeness >= LEAST_LIKENESS
        and alignment.code_likeness() >= LEAST_NOISY_LIKENESS
        and alignment.code_likeness(noise) >= least_code_likeness
        and alignment.unexplained_without_code >= least_code_to_noise * noise
        and alignment.side_px >= _LEAST_SIDE_PX
        and alignment.corner_sigma_px <= LARGEST_CORNER_SIGMA_PX
        and _fits_tilt(alignment, tilt)
    )


def largest_cell_error(alignment: Alignment, aligner: Aligner, noise: float) -> float:
    """How far that cell is from its colour that is furthest, as a part of the contrast, for all that the picture can tell.

    The most probable brightnesses of all cells at once, given the residual and that cells are about as printed.
    """
    side = aligner.pattern.count + 2
    shares = (
        aligner.cell_shares(alignment).reshape(-1, side, side)[:, 1:-1, 1:-1].reshape(len(alignment.differences), -1)
    )
    shares = shares * aligner.contrast(alignment)[:, None]
    A = gram(shares) + max(noise, _LEAST_NOISE) ** 2 / _CELL_SIGMA**2 * np.eye(shares.shape[1])
    error = np.linalg.solve(A, np.einsum("ij,i->j", shares, alignment.differences))
    return float(np.abs(error).max())


def _fits_tilt(alignment: Alignment, tilt: TiltPrior) -> bool:
    cosine = float(np.asarray(alignment.view.R[:, 2]) @ tilt.normal_camera)
    return cosine > 0.0 and math.acos(min(cosine, 1.0)) <= _TILT_SIGMAS * tilt.sigma_rad + 0.05


def _fits_height(alignment: Alignment, prior: Prior | None) -> bool:
    if prior is None or prior.height_m is None:
        return True
    height_m = -float(np.asarray(alignment.view.R[:, 2]) @ alignment.view.t)
    return abs(height_m - prior.height_m) <= 4.0 * prior.height_sigma_m + 0.1 * prior.height_m
