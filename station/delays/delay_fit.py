"""Finds the delay: shifted by how much do attitude and position explain the pad's motion in the picture best?

Only what changes within a second counts (`high_pass`): the navigation solution's wander, the compass's and the mount's errors and the
pad's place fall out of it. What is left is a residual in pixels that depends on the delay as the picture's velocity does. The quick
noise of position and attitude is smoothed away first (`smoothing`).
"""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from station.biases.extrinsic_model import NAMES, PARAMETERS, BelievedCamera, predicted_px
from station.biases.sightings import Array, Sightings
from station.delays.high_pass import high_passed
from station.delays.smoothing import smoothed

SEARCHED_S = (-0.1, 0.5)
"""Delays that are looked for, seconds; the stamp minus the light, so that a positive one is a picture older than its stamp."""
STEP_S = 0.01
MAX_SIGMA_S = 0.005
"""A delay that is known less well than this is refused."""
MAX_SCATTER = 3.0
"""Recordings that contradict each other by more than so many sigmas, and by more than `MAX_SIGMA_S`, have no delay in common."""
BLOCK_S = 4.0
LEAST_BLOCKS = 3
SMOOTHED_S = 0.05
CORRELATED = 0.1
"""So much of the residual is granted to go with the motion: the autopilot answers its own navigation noise, so that the two are not
independent. In hovers in gusts of 0.5 m/s (seeds 1 to 8) the delay was off by 0.09 of what it would be if they were one."""
HUBER = 1.345
_OUTLIER, _LEAST_USUAL_PX = 6.0, 0.02
_MOST_STEPS = 15
_CONVERGED_S = 1e-6
_FREE = tuple(NAMES.index(name) for name in ("image_latency_s", "mount_yaw_deg", "focal_scale", "pad_scale"))
"""Beside the delay, what scales or turns the motion; its errors must not pass for a delay."""
_STEPS = np.array([1e-3, 1e-2, 1e-4, 1e-4])
_NOMINAL = np.array([PARAMETERS[index].nominal for index in _FREE])
_PRIOR = np.array([1.0, *(PARAMETERS[index].prior_sigma for index in _FREE[1:])])


class DelayError(ValueError):
    """Flights that do not show the delay, in one line with the remedy."""


@dataclass(frozen=True)
class Motion:
    """One recording as the fit wants it."""

    sightings: Sightings
    """`position` is relative to where the fixes have the pad; roughly right is enough."""
    pad_azimuth_deg: float
    """Roughly."""


@dataclass(frozen=True)
class Delay:
    """What one or more recordings say."""

    delay_s: float
    """Stamp minus light."""
    sigma_s: float
    """Standard deviation: sandwich estimate over blocks of four seconds, and what of the residual may go with the motion."""
    frames: int
    moved_px: float
    """Root mean square of what a hundredth of a second of delay moves in the picture: what the flights have to show it by."""


def fit_delay(motions: Sequence[Motion], camera: BelievedCamera, *, refuse: bool = True) -> Delay:
    """The delay that all recordings have in common.

    Args:
        motions: The recordings.
        camera: As believed.
        refuse: Whether one that is known to less than `MAX_SIGMA_S` is refused.

    Raises:
        DelayError: If they are too short, or do not show it.
    """
    delay = _Problem(motions, camera).solved()
    if refuse and delay.sigma_s > MAX_SIGMA_S:
        raise DelayError(
            f"the delay is not to be seen in these flights: known to {1e3 * delay.sigma_s:.1f} ms only, {1e3 * MAX_SIGMA_S:g} are wanted; "
            "fly above the pad while the vehicle rocks: wind, or short pushes of the stick"
        )
    return delay


def check_agreement(each: Sequence[Delay]) -> None:
    """Recordings that each show the delay must show the same.

    Raises:
        DelayError: If they do not: then it is not constant.
    """
    sure = [one for one in each if one.sigma_s <= MAX_SIGMA_S]
    if len(sure) < 2:
        return
    weights = np.array([1.0 / one.sigma_s**2 for one in sure])
    mean_s = float(weights @ [one.delay_s for one in sure] / weights.sum())
    worst = max(sure, key=lambda one: abs(one.delay_s - mean_s) / one.sigma_s)
    if abs(worst.delay_s - mean_s) > max(MAX_SIGMA_S, MAX_SCATTER * worst.sigma_s):
        raise DelayError(
            f"the delay is not constant: {1e3 * worst.delay_s:.1f} ms in one recording, {1e3 * mean_s:.1f} ms in the mean of all; "
            "no setting can undo that: look for a clock that is set in flight, or a camera without stamps of its own"
        )


class _Problem:
    """The residuals of all recordings, and the steps."""

    def __init__(self, motions: Sequence[Motion], camera: BelievedCamera) -> None:
        self._motions = [
            dataclasses.replace(
                motion,
                sightings=dataclasses.replace(
                    motion.sightings,
                    position=smoothed(motion.sightings.position, SMOOTHED_S),
                    attitude=smoothed(motion.sightings.attitude, SMOOTHED_S),
                ),
            )
            for motion in motions
        ]
        self._camera = camera
        self._blocks = _blocks(motions)

    def solved(self) -> Delay:
        """A search over all delays, then Gauss-Newton with Huber's weights.

        Raises:
            DelayError: If there is too little to see, or the best delay lies at the end of the search.
        """
        values = self._searched()
        for _ in range(_MOST_STEPS):
            r, J, _ = self._linear(values)
            weights, prior = _weights(r), self._variance(r) / _PRIOR**2
            H = J.T @ (weights[:, None] * J) + np.diag(prior)
            step = np.linalg.solve(H, J.T @ (weights * r) - prior * (values - _NOMINAL))
            values = values + step
            if not SEARCHED_S[0] <= values[0] <= SEARCHED_S[1]:
                raise DelayError(_no_minimum())
            if abs(step[0]) < _CONVERGED_S:
                break
        r, J, blocks = self._linear(values)
        weights = _weights(r)
        inverse = np.linalg.inv(J.T @ (weights[:, None] * J) + np.diag(1.0 / _PRIOR**2) * self._variance(r))
        scores = np.stack([np.bincount(blocks, column) for column in (J * (weights * r)[:, None]).T], axis=1)
        count = int(np.count_nonzero(np.bincount(blocks)))
        if count < LEAST_BLOCKS:
            raise DelayError(
                f"{count * BLOCK_S:.0f} s in view of the pad: at least {LEAST_BLOCKS * BLOCK_S:.0f} are needed"
            )
        covariance = inverse @ (scores.T @ scores) @ inverse * count / (count - 1)
        speed_px_s = float(np.sqrt(np.mean(J[:, 0] ** 2)))
        sigma_s = math.hypot(math.sqrt(covariance[0, 0]), CORRELATED * math.sqrt(float(np.mean(r**2))) / speed_px_s)
        return Delay(float(values[0]), sigma_s, len(r) // 8, 0.01 * speed_px_s)

    def _searched(self) -> Array:
        delays_s = np.arange(SEARCHED_S[0], SEARCHED_S[1] + STEP_S / 2, STEP_S)
        costs = []
        for delay_s in delays_s:
            r, _ = self._residuals(np.array([delay_s, *_NOMINAL[1:]]))
            if len(r) < 8 * 20:
                raise DelayError("too few frames show the pad, one after the other: at least 10 s of them are needed")
            costs.append(float(np.mean(np.abs(r))))
        best = int(np.argmin(costs))
        if best in (0, len(costs) - 1):
            raise DelayError(_no_minimum())
        return np.array([delays_s[best], *_NOMINAL[1:]])

    def _residuals(
        self, values: Array, masks: list[NDArray[np.bool_]] | None = None
    ) -> tuple[Array, list[NDArray[np.bool_]]]:
        """High-passed seen minus predicted, (R,), pixels, NaN left in where `masks` are given; and which frames count."""
        parts, found = [], []
        for number, motion in enumerate(self._motions):
            sightings = motion.sightings
            parameters = np.array([parameter.nominal for parameter in PARAMETERS])
            parameters[list(_FREE)] = values
            parameters[NAMES.index("pad_azimuth_deg")] = motion.pad_azimuth_deg
            raw = (sightings.corners_px - predicted_px(parameters, sightings, self._camera)).reshape(len(sightings), -1)
            valid = _inliers(raw) if masks is None else masks[number]
            parts.append(high_passed(sightings.captured_s, raw, valid).ravel())
            found.append(valid)
        together = np.concatenate(parts)
        return (together[np.isfinite(together)] if masks is None else together), found

    def _linear(self, values: Array) -> tuple[Array, Array, Array]:
        """Residuals (R,), the prediction's derivative (R, P), and the block of each."""
        _, masks = self._residuals(values)
        r, _ = self._residuals(values, masks)
        columns = []
        for index, size in enumerate(_STEPS):
            step = np.zeros(len(_STEPS))
            step[index] = size
            columns.append(
                (self._residuals(values - step, masks)[0] - self._residuals(values + step, masks)[0]) / (2 * size)
            )
        J = np.stack(columns, axis=1)
        known = np.isfinite(r) & np.isfinite(J).all(axis=1)
        return r[known], J[known], self._blocks[known]

    @staticmethod
    def _variance(r: Array) -> float:
        return max(1.4826 * float(np.median(np.abs(r))), 1e-3) ** 2


def _inliers(raw: Array) -> NDArray[np.bool_]:
    """Frames whose corners follow those around them: neither a gross outlier nor behind the camera."""
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(raw).all(axis=1), np.bool_)
    if not finite.any():
        return finite
    level = np.where(finite[:, None], raw, 0.0)
    around = np.stack([np.roll(level, shift, axis=0) for shift in (-2, -1, 0, 1, 2)])
    off = np.abs(level - np.median(around, axis=0)).max(axis=1)
    usual = max(float(np.median(off[finite])), _LEAST_USUAL_PX)
    return np.asarray(finite & (off <= _OUTLIER * usual), np.bool_)


def _blocks(motions: Sequence[Motion]) -> NDArray[np.int64]:
    blocks, first = [], 0
    for motion in motions:
        sightings = motion.sightings
        since = ((sightings.captured_s - sightings.captured_s[0]) // BLOCK_S).astype(int)
        blocks.append(np.repeat(first + since, sightings.corners_px[0].size))
        first += int(since.max()) + 1
    return np.concatenate(blocks)


def _weights(r: Array) -> Array:
    size = np.abs(r) / max(1.4826 * float(np.median(np.abs(r))), 1e-3)
    return np.where(size <= HUBER, 1.0, HUBER / np.maximum(size, HUBER))


def _no_minimum() -> str:
    return (
        f"no delay from {1e3 * SEARCHED_S[0]:.0f} to {1e3 * SEARCHED_S[1]:.0f} ms explains the picture best: the vehicle hardly moved, "
        "or pictures and vehicle states do not belong together"
    )
