"""Estimates what physically causes the bias: robust nonlinear least squares over the raw corners."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from schemas.settings.geolocator import Correction, Extrinsic
from station.biases.cylindrical_fit import FitError
from station.biases.extrinsic_model import NAMES, PARAMETERS, BelievedCamera, predicted_px
from station.biases.sightings import Array, Sightings, thinned_to

MOST_FRAMES = 3000
HUBER = 1.345
"""Residuals beyond this many sigmas count by their size and no longer by its square: 95 % efficient for normal noise."""
NOT_EXCITED = 0.5
"""A parameter that the flights leave more than this part of its prior sigma unsure of is not excited by them."""
MISTAKEN = 0.7
"""Correlation from which on two parameters are said not to be told apart."""
MOST_STEPS = 40
LEAST_BLOCKS = 10
BLOCK_S = 5.0

_PRIOR = np.array([parameter.prior_sigma for parameter in PARAMETERS])
_NOMINAL = np.array([parameter.nominal for parameter in PARAMETERS])
_LEAST_FRAMES = 20
_CONVERGED = 1e-6


@dataclass(frozen=True)
class ExtrinsicFit:
    """The parameters in the order of `NAMES`, in their units."""

    values: Array
    covariance: Array
    """(P, P); sandwich estimate over recordings, so that errors which last through one (a compass, say) are counted once."""
    rms_before_px: float
    """Of the corners, everything being built as believed."""
    rms_px: float
    """After the fit."""
    frames: int

    @property
    def sigmas(self) -> Array:
        """Standard deviations, (P,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), float)

    def warnings(self) -> list[str]:
        """What the flights do not show: parameters that stay about where the prior puts them, and what they are mistaken for."""
        sigmas = self.sigmas
        correlation = self.covariance / np.outer(sigmas, sigmas) - np.eye(len(NAMES))
        said = []
        for index, parameter in enumerate(PARAMETERS):
            if sigmas[index] <= NOT_EXCITED * parameter.prior_sigma:
                continue
            others = [
                f"{name} ({share:+.2f})"
                for name, share in zip(NAMES, correlation[index], strict=True)
                if abs(share) > MISTAKEN
            ]
            said.append(
                f"{parameter.name} is not excited by these flights: known to {sigmas[index]:.2g}, believed to "
                f"{parameter.prior_sigma:g} before them"
                + (f"; not told apart from {', '.join(others)}" if others else "")
            )
        return said

    def correction(self) -> Correction:
        """What the geolocator undoes. The pad's height and azimuth are no part of it: the pad truly lies so."""
        known = {name: float(value) for name, value in zip(NAMES, self.values, strict=True) if name in _CORRECTED}
        return Correction(method="extrinsic", extrinsic=Extrinsic(**known))

    def value(self, name: str) -> float:
        """One parameter."""
        return float(self.values[NAMES.index(name)])


_CORRECTED = frozenset(Extrinsic.model_fields)


def fit_extrinsic(sightings: Sequence[Sightings], camera: BelievedCamera, pad_azimuth_deg: float = 0.0) -> ExtrinsicFit:
    """Fit all parameters, each with its prior.

    The noise of neighbouring frames is much the same (attitude, compass), which least squares does not know. So it is done twice:
    the second time the corners count as much less as the scatter from recording to recording says that they should.

    Args:
        sightings: One element a recording.
        camera: As believed.
        pad_azimuth_deg: Roughly; from the fixes.

    Raises:
        FitError: If too few frames show the pad, or the fit does not converge.
    """
    used = thinned_to([one for one in sightings if len(one)], MOST_FRAMES)
    frames = sum(len(one) for one in used)
    if frames < _LEAST_FRAMES:
        raise FitError(f"{frames} frames show the pad: at least {_LEAST_FRAMES} are needed")
    start = _NOMINAL.copy()
    start[NAMES.index("pad_azimuth_deg")] = pad_azimuth_deg
    problem = _Problem(used, camera, start)
    before = problem.residuals(start)
    values = problem.solved(start, inflation=1.0)
    inflation = problem.inflation(values)
    values = problem.solved(values, inflation)
    return ExtrinsicFit(
        values, problem.covariance(values, inflation), _rms(before), _rms(problem.residuals(values)), frames
    )


class _Problem:
    """Residuals, their derivatives, and the steps. Inside, parameters are in units of their prior sigmas."""

    def __init__(self, sightings: Sequence[Sightings], camera: BelievedCamera, centre: Array) -> None:
        self._sightings, self._camera, self._centre = sightings, camera, centre
        self._blocks = _blocks(sightings)

    def residuals(self, values: Array) -> Array:
        """Seen minus predicted, (R,), pixels.

        Raises:
            FitError: If a corner would be behind the camera.
        """
        parts = [(one.corners_px - predicted_px(values, one, self._camera)).ravel() for one in self._sightings]
        together = np.concatenate(parts)
        if not np.isfinite(together).all():
            raise FitError("the reference puts the pad behind the camera: check the mount and the pad's place")
        return together

    def solved(self, values: Array, inflation: float) -> Array:
        """Levenberg-Marquardt with Huber weights and the priors, from a start.

        Raises:
            FitError: If it does not converge.
        """
        damping = 1e-3
        cost = self._cost(values, inflation, _scale(self.residuals(values)))
        for _ in range(MOST_STEPS):
            r, J = self.residuals(values), self._jacobian(values)
            scale = _scale(r)
            H, gradient = self._normal(values, r, J, scale, inflation)
            cost = self._cost(values, inflation, scale)
            for _ in range(12):
                step = np.linalg.solve(H + damping * np.diag(np.diag(H)), gradient)
                tried = values + step * _PRIOR
                try:
                    better = self._cost(tried, inflation, scale) <= cost
                except FitError:
                    better = False
                if better:
                    break
                damping *= 5.0
            else:
                return values
            values, damping = tried, max(damping / 5.0, 1e-9)
            if np.abs(step).max() < _CONVERGED:
                return values
        raise FitError(f"no convergence in {MOST_STEPS} steps: do the reference and the corners belong together?")

    def inflation(self, values: Array) -> float:
        """How many times the variance of the scores is what independent corners would give; at least 1."""
        r, J = self.residuals(values), self._jacobian(values)
        w = _weights(r, _scale(r))
        H = J.T @ (w[:, None] * J) / _scale(r) ** 2
        ratio = np.linalg.lstsq(H, self._meat(r, J, w, _scale(r)), rcond=1e-9)[0]
        return max(1.0, float(np.trace(ratio)) / len(NAMES))

    def covariance(self, values: Array, inflation: float) -> Array:
        """Of the values, in their units: the inverse of the information around what the scores of data and priors scatter by."""
        r, J = self.residuals(values), self._jacobian(values)
        scale = _scale(r)
        w = _weights(r, scale)
        H, _ = self._normal(values, r, J, scale, inflation)
        middle = self._meat(r, J, w, scale) / inflation**2 + np.eye(len(NAMES))
        inverse = np.linalg.inv(H)
        return np.asarray(inverse @ middle @ inverse * np.outer(_PRIOR, _PRIOR), float)

    def _normal(self, values: Array, r: Array, J: Array, scale: float, inflation: float) -> tuple[Array, Array]:
        weights = _weights(r, scale) / (scale**2 * inflation)
        H = J.T @ (weights[:, None] * J) + np.eye(len(NAMES))
        return H, J.T @ (weights * r) - (values - self._centre) / _PRIOR

    def _cost(self, values: Array, inflation: float, scale: float) -> float:
        size = np.abs(self.residuals(values)) / scale
        huber = np.where(size <= HUBER, 0.5 * size**2, HUBER * (size - 0.5 * HUBER))
        return float(huber.sum() / inflation + 0.5 * np.sum(((values - self._centre) / _PRIOR) ** 2))

    def _jacobian(self, values: Array) -> Array:
        """Of the prediction by each parameter in prior sigmas, (R, P), by central differences."""
        columns = []
        for index, sigma in enumerate(_PRIOR):
            step = np.zeros(len(NAMES))
            step[index] = 1e-4 * sigma
            columns.append((self.residuals(values - step) - self.residuals(values + step)) / 2e-4)
        return np.stack(columns, axis=1)

    def _meat(self, r: Array, J: Array, w: Array, scale: float) -> Array:
        """Scatter of the scores over blocks of data that know nothing of each other, (P, P)."""
        scores = J * (w * r / scale**2)[:, None]
        sums = np.stack([scores[self._blocks == block].sum(axis=0) for block in np.unique(self._blocks)])
        count = len(sums)
        return np.asarray(sums.T @ sums * count / max(count - 1, 1), float)


def _blocks(sightings: Sequence[Sightings]) -> Array:
    """The block of each residual, (R,): a recording each, or where those are few, some seconds of one."""
    blocks, first = [], 0
    for one in sightings:
        since_s = one.captured_s - one.captured_s[0]
        within = np.zeros(len(one), int) if len(sightings) >= LEAST_BLOCKS else (since_s // BLOCK_S).astype(int)
        blocks.append(np.repeat(first + within, one.corners_px[0].size))
        first += int(within.max()) + 1
    return np.concatenate(blocks)


def _scale(r: Array) -> float:
    return max(1.4826 * float(np.median(np.abs(r))), 1e-3)


def _weights(r: Array, scale: float) -> Array:
    size = np.abs(r) / scale
    return np.where(size <= HUBER, 1.0, HUBER / np.maximum(size, HUBER))


def _rms(r: Array) -> float:
    return float(np.sqrt(np.mean(2.0 * r**2)))
