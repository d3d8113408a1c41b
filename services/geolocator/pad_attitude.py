"""A pad whose lie is surveyed tells the attitude better than compass and horizon: how the print is turned and tilted is the attitude's error."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alight.geometry.flat_matrix import Flat3
from alight.geometry.rotation import wrap_pi
from alight.runtime.clock import seconds
from schemas.fix import FixInput
from schemas.message import Vector3
from schemas.settings.geolocator import GeolocatorSettings

Array = NDArray[np.float64]

_GATE2 = 4.0**2
"""In squared sigmas. A pad that seems to be turned or tilted by more does not lie as it was surveyed, or it is another."""
_COMPLAIN_AFTER = 10
_LASTING_PART, _LASTING_S = 0.5, 5.0
"""What a picture says of the print's orientation is wrong by something that lasts (corners that blur alike, where they fall on the pixels)
besides what is new in each: by this part of the variance, for so long."""
_FIRST_EXCESS, _LOOKS, _NEXT_S = 4.0, 30, 0.2
"""By how much the orientation scatters more than the pose's covariance says, as a factor of the variance: what is believed at first,
over how many looks it is learnt, and how soon a look must follow another to be compared with it. Never less than 1."""
_ERRORS, _LASTING = slice(0, 3), slice(3, 6)
_TILT: tuple[int, ...] = (0, 1)
_HEADING: tuple[int, ...] = (2,)
_EYE3, _DOWN_FIRST, _DIAGONAL = np.eye(3), np.ix_([2, 0, 1], [2, 0, 1]), np.diag_indices(6)


class Lie(NamedTuple):
    """How the print lies, as one picture and the autopilot's attitude have it."""

    captured_at_ns: int
    normal_ned: Vector3
    """Out of the print, unit vector: (0, 0, -1) if it is level."""
    azimuth_rad: float
    noise_rad2: Flat3
    """Covariance of a small turn about north, east and down that the picture errs by."""


class AttitudeAid(NamedTuple):
    """The attitude's error as the pad tells it: turns about north, east and down, rad."""

    turn_rad: Vector3
    """By how much the attitude is turned too far."""
    tilt_north_rad: Vector3
    """What is left of the error, as three independent turns of one standard deviation each. Of the three only the last changes the heading."""
    tilt_east_rad: Vector3
    heading_rad: Vector3
    inputs: tuple[FixInput, ...]
    """What of the pad's lie was surveyed."""


class PadAttitude:
    """Follows the attitude's error by a Kalman filter.

    State: the error about north, east and down (first-order Gauss-Markov processes of the sizes in `geolocator.uncertainty`), and as
    much again for what pictures are lastingly wrong by, in standard deviations. Each look measures the sum of both. A pose that claims
    more than the looks bear out counts as much less.
    """

    def __init__(self, settings: GeolocatorSettings) -> None:
        tilt, heading, errors = settings.tilt, settings.heading, settings.uncertainty
        self._lie_rad = np.radians([*(tilt.pad_tilt_deg or (0.0, 0.0)), heading.pad_azimuth_deg or 0.0])
        tilt_deg = math.hypot(errors.roll_pitch_deg, errors.mount_roll_pitch_deg)
        sizes = np.radians([tilt_deg, tilt_deg, errors.yaw_deg])
        by_tilt = tilt.pad_tilt_deg is not None and tilt_deg > 0.0
        by_heading = heading.pad_azimuth_deg is not None and errors.yaw_deg > 0.0
        self._surveyed = [rows for rows, known in ((_TILT, by_tilt), (_HEADING, by_heading)) if known]
        self._rows = [row for rows in self._surveyed for row in rows]
        self._within = np.ix_(self._rows, self._rows)
        survey_rad = np.radians([tilt.sigma_deg, tilt.sigma_deg, heading.sigma_deg])
        self._survey2 = np.diag([survey_rad[row] ** 2 if row in self._rows else 0.0 for row in range(3)])
        self._inputs = tuple(FixInput.PAD_TILT if rows is _TILT else FixInput.PAD_AZIMUTH for rows in self._surveyed)
        self._times_s = np.array([tilt.time_s, tilt.time_s, heading.time_s, *[_LASTING_S] * 3])
        self._prior2 = np.array([*sizes**2, 1.0, 1.0, 1.0])
        self._x, self._P = np.zeros(6), np.diag(self._prior2)
        self._excess = {_TILT: _FIRST_EXCESS, _HEADING: _FIRST_EXCESS}
        self._scatter = {rows: [_FIRST_EXCESS, _FIRST_EXCESS] for rows in (_TILT, _HEADING)}
        self._last: tuple[Array, Array] | None = None
        self._at_ns: int | None = None
        self._contradictions = 0
        self._off_rad = np.zeros(3)
        self._off_by = _HEADING
        self.heading_refused = 0
        """Looks at a pad whose azimuth contradicts the survey."""
        self.tilt_refused = 0
        """The same of its tilt."""

    @property
    def is_surveyed(self) -> bool:
        """Whether there is anything to go by."""
        return bool(self._rows)

    def complaints(self) -> tuple[str, ...]:
        """Says so if the pad keeps lying otherwise than surveyed."""
        if self._contradictions < _COMPLAIN_AFTER:
            return ()
        north_deg, east_deg, down_deg = np.degrees(self._off_rad).tolist()
        if self._off_by is _HEADING:
            off = f"turned by {down_deg:+.1f} deg against geolocator.heading.pad_azimuth_deg"
        else:
            off = f"tilted by {north_deg:+.1f} and {east_deg:+.1f} deg against geolocator.tilt.pad_tilt_deg"
        return (f"the pad is {off}: survey it anew, or leave the key out",)

    def aid(self, lie: Lie) -> AttitudeAid | None:
        """What a look at the pad tells of the attitude; None if nothing was surveyed, or the pad does not lie as surveyed."""
        if not self._rows:
            return None
        since_s = self._predict(lie.captured_at_ns)
        noise, off = np.array(lie.noise_rad2).reshape(3, 3), self._off(lie)
        excess = np.sqrt([self._excess[_TILT], self._excess[_TILT], self._excess[_HEADING]])
        lasting = math.sqrt(_LASTING_PART) * excess[:, None] * np.linalg.cholesky(noise)
        H = np.concatenate((_EYE3, lasting), axis=1)
        away = off - H @ self._x
        HP = H @ self._P
        S = HP @ H.T + excess[:, None] * noise * excess
        expected = (S + self._survey2).tolist()
        refused = next((rows for rows in self._surveyed if not _normalised2(away, expected, rows) <= _GATE2), None)
        if refused is not None:
            self._refuse(refused, off)
            return None
        self._contradictions = 0
        self._learn(away, off, noise, since_s)
        self._take(HP[self._rows], away[self._rows], S[self._within])
        return self._told()

    def _off(self, lie: Lie) -> Array:
        """How the print is turned against the survey about north, east and down, (3,), rad: a turn w moves its normal (0, 0, -1) by (-w_e, w_n, 0)."""
        north, east, _ = lie.normal_ned
        tilt_n, tilt_e, azimuth = self._lie_rad.tolist()
        return np.array((east - tilt_n, -north - tilt_e, wrap_pi(lie.azimuth_rad - azimuth)))

    def _predict(self, at_ns: int) -> float:
        """Go on to the time of a look; returns how long after the last one that is, seconds."""
        since_s = math.inf if self._at_ns is None else max(0.0, seconds(at_ns - self._at_ns))
        if self._at_ns is not None:
            keep = np.exp(-since_s / self._times_s)
            self._x = keep * self._x
            self._P = self._P * (keep[:, None] * keep)
            self._P[_DIAGONAL] += (1.0 - keep * keep) * self._prior2
        self._at_ns = at_ns
        return since_s

    def _refuse(self, rows: tuple[int, ...], off: Array) -> None:
        self._contradictions += 1
        self._off_rad, self._off_by, self._last = off, rows, None
        if rows is _HEADING:
            self.heading_refused += 1
        else:
            self.tilt_refused += 1

    def _learn(self, away: Array, off: Array, noise: Array, since_s: float) -> None:
        """By how much the looks scatter more than the poses claim: about what was expected, and from one look to the next.

        The second does not depend on how uncertain the attitude is, which changes little meanwhile; the first sees what lasts for some
        looks, too. The larger one counts.
        """
        claimed = (self._P[_ERRORS, _ERRORS] + noise).tolist()
        last, self._last = self._last, (off, noise)
        for rows in self._surveyed:
            ratios = [_normalised2(away, claimed, rows)]
            if last is not None and since_s <= _NEXT_S:
                last_off, last_noise = last
                ratios.append(_normalised2(off - last_off, (noise + last_noise).tolist(), rows))
            means = self._scatter[rows]
            for number, ratio in enumerate(ratios):
                means[number] += (ratio / len(rows) - means[number]) / _LOOKS
            self._excess[rows] = max(1.0, *means)

    def _take(self, HP: Array, away: Array, S: Array) -> None:
        gain = np.linalg.solve(S, HP).T
        self._x = self._x + gain @ away
        P = self._P - gain @ HP
        self._P = (P + P.T) / 2.0

    def _told(self) -> AttitudeAid:
        L = np.linalg.cholesky((self._P[_ERRORS, _ERRORS] + self._survey2)[_DOWN_FIRST])
        # Down first: the heading's error is then one of the three turns alone.
        heading, tilt_n, tilt_e = ((column[1], column[2], column[0]) for column in L.T.tolist())
        turn_n, turn_e, turn_d = self._x[_ERRORS].tolist()
        return AttitudeAid((turn_n, turn_e, turn_d), tilt_n, tilt_e, heading, self._inputs)


def _normalised2(away: Array, covariance: list[list[float]], rows: tuple[int, ...]) -> float:
    """The square of some of a vector's parts in units of their covariance: of one part or of two."""
    first = rows[0]
    x, xx = float(away[first]), covariance[first][first]
    if len(rows) == 1:
        return x * x / xx
    last = rows[1]
    y, xy, yy = float(away[last]), covariance[first][last], covariance[last][last]
    return (x * x * yy - 2.0 * x * y * xy + y * y * xx) / (xx * yy - xy * xy)
