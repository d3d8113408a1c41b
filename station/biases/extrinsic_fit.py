"""Estimates what physically causes the bias: robust nonlinear least squares over the raw corners."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from schemas.settings.geolocator import Correction, Extrinsic
from station.biases.cylindrical_fit import FitError
from station.biases.extrinsic_model import NAMES, PARAMETERS, BelievedCamera, predicted_px
from station.biases.sightings import Array, Sightings, thinned_to, together

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
"""Neighbouring frames share the attitude's error; over more than this they hardly do."""

_PRIOR = np.array([parameter.prior_sigma for parameter in PARAMETERS])
_NOMINAL = np.array([parameter.nominal for parameter in PARAMETERS])
_LEAST_FRAMES = 20
_CONVERGED = 1e-6
_COUNT = len(NAMES)


@dataclass(frozen=True)
class AttitudeErrors:
    """How far the attitude of a recording may be off all the time: an error of its own for each recording, found with the rest.

    A compass that is off by the same angle in every recording is not told apart from a turned mount; one that differs is.
    """

    tilt_sigma_deg: float
    """About north and about east, a priori."""
    heading_sigma_deg: float
    """About down, a priori."""

    def prior_sigma_rad(self) -> Array:
        """(3,)."""
        return np.radians([self.tilt_sigma_deg, self.tilt_sigma_deg, self.heading_sigma_deg])


AUTOPILOT = AttitudeErrors(tilt_sigma_deg=0.2, heading_sigma_deg=1.0)
"""An autopilot with a compass."""
REFERENCE = AttitudeErrors(tilt_sigma_deg=0.0, heading_sigma_deg=0.0)
"""Motion capture, or the truth of a simulation."""


@dataclass(frozen=True)
class ExtrinsicFit:
    """The parameters in the order of `NAMES`, in their units."""

    values: Array
    covariance: Array
    """(P, P); from ten recordings on a sandwich estimate over them, so that what lasts through one (a compass, say) is counted once."""
    rms_before_px: float
    """Of the corners, everything being built as believed."""
    rms_px: float
    """After the fit."""
    frames: int
    heading_error_deg: Array
    """Of each recording, (K,), as far as it is told apart from a turned mount; zeros where the attitude is a reference."""

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
        """What the geolocator undoes. The pad's height, azimuth and tilt are no part of it: the pad truly lies so."""
        known = {name: float(value) for name, value in zip(NAMES, self.values, strict=True) if name in _CORRECTED}
        return Correction(method="extrinsic", extrinsic=Extrinsic(**known))

    def value(self, name: str) -> float:
        """One parameter."""
        return float(self.values[NAMES.index(name)])

    def sigma(self, name: str) -> float:
        """Standard deviation of one parameter."""
        return float(self.sigmas[NAMES.index(name)])


_CORRECTED = frozenset(Extrinsic.model_fields)


def fit_extrinsic(
    sightings: Sequence[Sightings],
    camera: BelievedCamera,
    pad_azimuth_deg: float = 0.0,
    attitude_errors: AttitudeErrors = AUTOPILOT,
) -> ExtrinsicFit:
    """Fit all parameters, each with its prior, and an attitude error of each recording with its own.

    The noise of neighbouring frames is much the same (attitude, compass), which least squares does not know. So it is done twice:
    the second time the corners count as much less as the scatter from block to block says that they should.

    Args:
        sightings: One element a recording.
        camera: As believed.
        pad_azimuth_deg: Roughly; from the fixes.
        attitude_errors: Whose attitude it is.

    Raises:
        FitError: If too few frames show the pad, or the fit does not converge.
    """
    used = thinned_to([one for one in sightings if len(one)], MOST_FRAMES)
    frames = sum(len(one) for one in used)
    if frames < _LEAST_FRAMES:
        raise FitError(f"{frames} frames show the pad: at least {_LEAST_FRAMES} are needed")
    problem = _Problem(used, camera, pad_azimuth_deg, attitude_errors)
    before = problem.residuals(problem.start)
    state = problem.solved(problem.start, inflation=1.0)
    inflation = problem.inflation(state)
    state = problem.solved(state, inflation)
    return ExtrinsicFit(
        state[:_COUNT],
        problem.covariance(state, inflation),
        _rms(before),
        _rms(problem.residuals(state)),
        frames,
        np.degrees(problem.turns(state)[:, 2]),
    )


class _Problem:
    """Residuals, their derivatives, and the steps.

    The state is the parameters in their units, then for each recording its attitude error about north, east and down, rad.
    Inside, all are in units of their prior sigmas.
    """

    def __init__(
        self, sightings: Sequence[Sightings], camera: BelievedCamera, pad_azimuth_deg: float, errors: AttitudeErrors
    ) -> None:
        self._all, self._camera = together(sightings), camera
        self._count = len(sightings)
        self._of_frame = np.repeat(np.arange(self._count), [len(one) for one in sightings])
        free = bool(errors.prior_sigma_rad().any())
        own = np.tile(errors.prior_sigma_rad(), len(sightings)) if free else np.zeros(0)
        self._prior = np.concatenate([_PRIOR, own])
        self.start: Array = np.concatenate([_NOMINAL, np.zeros(len(own))])
        self.start[NAMES.index("pad_azimuth_deg")] = pad_azimuth_deg
        self._recordings = np.repeat(self._of_frame, self._all.corners_px[0].size)
        self._blocks = _blocks(sightings)

    def turns(self, state: Array) -> Array:
        """The recordings' attitude errors, (K, 3), rad."""
        own = state[_COUNT:]
        return own.reshape(-1, 3) if len(own) else np.zeros((self._count, 3))

    def residuals(self, state: Array) -> Array:
        """Seen minus predicted, (R,), pixels.

        Raises:
            FitError: If a corner would be behind the camera.
        """
        predicted = predicted_px(state[:_COUNT], self._all, self._camera, self.turns(state)[self._of_frame])
        if not np.isfinite(predicted).all():
            raise FitError("the reference puts the pad behind the camera: check the mount and the pad's place")
        return np.asarray((self._all.corners_px - predicted).ravel(), float)

    def solved(self, state: Array, inflation: float) -> Array:
        """Levenberg-Marquardt with Huber weights and the priors, from a start.

        Raises:
            FitError: If it does not converge.
        """
        damping = 1e-3
        for _ in range(MOST_STEPS):
            r, J = self.residuals(state), self._jacobian(state)
            scale = _scale(r)
            H, gradient = self._normal(state, r, J, scale, inflation)
            cost = self._cost(state, inflation, scale)
            for _ in range(12):
                step = np.linalg.solve(H + damping * np.diag(np.diag(H)), gradient)
                tried = state + step * self._prior
                try:
                    better = self._cost(tried, inflation, scale) <= cost
                except FitError:
                    better = False
                if better:
                    break
                damping *= 5.0
            else:
                return state
            state, damping = tried, max(damping / 5.0, 1e-9)
            if np.abs(step).max() < _CONVERGED:
                return state
        raise FitError(f"no convergence in {MOST_STEPS} steps: do the reference and the corners belong together?")

    def inflation(self, state: Array) -> float:
        """How many times the variance of the scores is what independent corners would give; at least 1."""
        r, J = self.residuals(state), self._jacobian(state)
        w = _weights(r, _scale(r))
        H = J.T @ (w[:, None] * J) / _scale(r) ** 2
        ratio = np.linalg.lstsq(H, _meat(r, J, w, _scale(r), self._blocks), rcond=1e-9)[0]
        return max(1.0, float(np.trace(ratio)) / len(H))

    def covariance(self, state: Array, inflation: float) -> Array:
        """Of the parameters, (P, P), in their units, whatever the recordings' attitude errors are.

        From ten recordings on: the inverse of the information around what the scores of recordings and priors scatter by. Of fewer, the
        scatter says nothing, and the information alone decides.
        """
        r, J = self.residuals(state), self._jacobian(state)
        scale = _scale(r)
        w = _weights(r, scale)
        H, _ = self._normal(state, r, J, scale, inflation)
        shared, own = H[:_COUNT, :_COUNT], H[_COUNT:, _COUNT:]
        across = H[:_COUNT, _COUNT:]
        inverse = np.linalg.inv(shared - across @ np.linalg.solve(own, across.T)) if len(own) else np.linalg.inv(shared)
        units = np.outer(_PRIOR, _PRIOR)
        if self._count < LEAST_BLOCKS:
            return np.asarray(inverse * units, float)
        # With the attitude errors at their best, the derivative of the cost by the parameters is that with these errors held.
        middle = _meat(r, J[:, :_COUNT], w, scale, self._recordings) / inflation**2 + np.eye(_COUNT)
        return np.asarray(inverse @ middle @ inverse * units, float)

    def _normal(self, state: Array, r: Array, J: Array, scale: float, inflation: float) -> tuple[Array, Array]:
        weights = _weights(r, scale) / (scale**2 * inflation)
        H = J.T @ (weights[:, None] * J) + np.eye(len(state))
        return H, J.T @ (weights * r) - (state - self.start) / self._prior

    def _cost(self, state: Array, inflation: float, scale: float) -> float:
        size = np.abs(self.residuals(state)) / scale
        huber = np.where(size <= HUBER, 0.5 * size**2, HUBER * (size - 0.5 * HUBER))
        return float(huber.sum() / inflation + 0.5 * np.sum(((state - self.start) / self._prior) ** 2))

    def _jacobian(self, state: Array) -> Array:
        """Of the prediction by each unknown in prior sigmas, (R, P + 3 K), by central differences.

        An attitude error moves its own recording alone, so that one difference tells of all recordings' errors about one axis.
        """
        J = np.zeros((len(self._recordings), len(state)))
        for index in range(_COUNT):
            J[:, index] = self._difference(state, slice(index, index + 1))
        if len(state) > _COUNT:
            rows = np.arange(len(J))
            for axis in range(3):
                J[rows, _COUNT + 3 * self._recordings + axis] = self._difference(state, slice(_COUNT + axis, None, 3))
        return J

    def _difference(self, state: Array, moved: slice) -> Array:
        """What the prediction changes by, (R,), for one prior sigma of some unknowns."""
        step = np.zeros(len(state))
        step[moved] = 1e-4 * self._prior[moved]
        return np.asarray((self.residuals(state - step) - self.residuals(state + step)) / 2e-4, float)


def _meat(r: Array, J: Array, w: Array, scale: float, blocks: NDArray[np.int64]) -> Array:
    """Scatter of the scores over blocks of data that know nothing of each other, (P, P)."""
    scores = J * (w * r / scale**2)[:, None]
    sums = np.stack([np.bincount(blocks, column) for column in scores.T], axis=1)
    count = len(np.unique(blocks))
    return np.asarray(sums.T @ sums * count / max(count - 1, 1), float)


def _blocks(sightings: Sequence[Sightings]) -> NDArray[np.int64]:
    """The block of each residual, (R,): some seconds of a recording each."""
    blocks, first = [], 0
    for one in sightings:
        within = ((one.captured_s - one.captured_s[0]) // BLOCK_S).astype(int)
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
