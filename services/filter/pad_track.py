"""One hypothesis of the pad: a Kalman filter over its coordinates, their drift, and the errors that fixes share.

The pad does not move, but its coordinates do: the vehicle's navigation solution wanders (GNSS), and the commander steers in
that solution. So the state is the pad's place in the solution *of the moment* and how fast that drifts. A fix is the true
vector from vehicle to pad plus the vehicle's coordinates at capture time, hence it observes that place at capture time,
whatever the solution's error; what is new in each fix (corners) averages out, what lasts (attitude, mount, lens, clock)
does not. The lasting errors are part of the state, each in units of its own standard deviation, so that they are counted
once and not averaged away, and so that a fix from near, to which a turned camera matters little, corrects those from afar.
(Schmidt's consider filter with the considered states estimated; Brown and Hwang, *Introduction to Random Signals and
Applied Kalman Filtering*, on shaping filters for correlated measurement noise.)
"""

import math
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alight.geometry.rotation import wrap_pi
from alight.runtime.clock import seconds
from schemas.settings.filter import Kalman
from services.filter.sighting import Sighting

Array = NDArray[np.float64]

_PLACE, _DRIFT, _SHARED = slice(0, 3), slice(3, 6), slice(6, 14)
_SIZE = 14
_EYE3 = np.eye(3)


@dataclass(frozen=True)
class Innovation:
    """A sighting against what was expected of it."""

    away_m: Array
    """(3,), sighting minus expectation."""
    covariance_m2: Array
    """(3, 3), of it."""
    inverse: Array
    """(3, 3), of the covariance, 1/m^2."""
    cross_m2: Array
    """(14, 3), covariance of the state with the innovation."""
    turn_rad: float
    """The same of the azimuth."""
    turn_variance_rad2: float
    nis: float
    """Both together, squared and normalised: chi-square with four degrees of freedom."""


class PadTrack:
    """State: place (3), drift (3), lasting errors (8), and apart from these the azimuth."""

    def __init__(self, sighting: Sighting, settings: Kalman, *, moving: bool) -> None:
        """Begin at a sighting."""
        self._settings = settings
        self._q_noise = settings.position_noise_m**2
        drift2 = settings.drift_mps**2
        self._rate2 = np.array((drift2, drift2, drift2))
        self._rate_time_s = settings.drift_time_s
        if moving:
            pad2 = settings.pad_mps**2
            self._rate2 += (pad2, pad2, 0.0)
            self._rate_time_s = settings.pad_time_s
        times_s = (
            *(math.inf,) * 3,
            *(self._rate_time_s,) * 3,
            *(settings.attitude_time_s,) * 2,
            settings.heading_time_s,
            *(settings.lens_time_s,) * 3,
            settings.timing_time_s,
            settings.size_time_s,
        )
        self._fading_per_s = -1.0 / np.array(times_s)
        C = sighting.shared_m
        x, P = np.zeros(_SIZE), np.zeros((_SIZE, _SIZE))
        x[_PLACE] = sighting.place_m
        P[_PLACE, _PLACE] = sighting.noise_m2 + self._q_noise * _EYE3 + C @ C.T
        P[_PLACE, _SHARED], P[_SHARED, _PLACE] = -C, -C.T
        P[_SHARED, _SHARED] = np.eye(8)
        P[_DRIFT, _DRIFT] = np.diag(self._rate2)
        self._x, self._P = x, P
        self._azimuth_rad = sighting.azimuth_rad
        self._azimuth_variance = sighting.azimuth_noise_rad2
        self._heading2 = sighting.heading_rad**2
        self.at_ns = sighting.captured_at_ns
        """Capture time of the newest sighting, UTC ns."""
        self.fixes = 1
        """How many sightings are in it."""
        self.walk_m2ps = 0.0
        """How much faster than the settings say the navigation solution walks, each axis, m^2 a second."""

    def predict(self, at_ns: int) -> None:
        """Go on to a later time: the drift goes on and fades, everything becomes less certain."""
        if at_ns > self.at_ns:
            self._x, self._P = self._predicted(seconds(at_ns - self.at_ns))
            self._azimuth_variance = self._azimuth_variance_after(seconds(at_ns - self.at_ns))
            self.at_ns = at_ns

    def place_at(self, at_ns: int) -> tuple[Array, Array, float]:
        """Place (3,), its covariance (3, 3) and the azimuth's variance at a time not before the newest sighting."""
        ahead_s = max(0.0, seconds(at_ns - self.at_ns))
        x, P = self._predicted(ahead_s)
        return x[_PLACE], P[_PLACE, _PLACE], self._azimuth_variance_after(ahead_s) + self._heading2

    def soon_m(self, ahead_s: float) -> Array:
        """The place a moment later, by the drift alone, (3,)."""
        return self._x[_PLACE] + self._x[_DRIFT] * ahead_s

    @property
    def place_m(self) -> Array:
        """(3,), at the time of the newest sighting or prediction."""
        return self._x[_PLACE]

    @property
    def horizontal_sigma_m(self) -> float:
        """Standard deviation along the major horizontal axis, metres."""
        nn, ne, ee = float(self._P[0, 0]), float(self._P[0, 1]), float(self._P[1, 1])
        return math.sqrt(max(0.0, 0.5 * (nn + ee) + math.hypot(0.5 * (nn - ee), ne)))

    @property
    def drift_mps(self) -> Array:
        """(3,)."""
        return self._x[_DRIFT]

    @property
    def drift_covariance(self) -> Array:
        """(3, 3), (m/s)^2."""
        return self._P[_DRIFT, _DRIFT]

    @property
    def azimuth_rad(self) -> float:
        """In (-pi, pi]."""
        return self._azimuth_rad

    @property
    def azimuth_variance_rad2(self) -> float:
        """With the heading's own error, which the fixes share."""
        return self._azimuth_variance + self._heading2

    def innovation(self, sighting: Sighting) -> Innovation:
        """What a sighting at the track's time says that was not expected."""
        C, P = sighting.shared_m, self._P
        PHt = P[:, _PLACE] + P[:, _SHARED] @ C.T
        S = PHt[_PLACE] + C @ PHt[_SHARED] + sighting.noise_m2
        S.reshape(9)[::4] += self._q_noise
        away = sighting.place_m - self._x[_PLACE] - C @ self._x[_SHARED]
        inverse: Array = np.asarray(np.linalg.inv(S), float)
        turn = wrap_pi(sighting.azimuth_rad - self._azimuth_rad)
        turn_variance = self._azimuth_variance + sighting.azimuth_noise_rad2
        nis = float(away @ inverse @ away) + turn * turn / max(turn_variance, 1e-12)
        return Innovation(away, S, inverse, PHt, turn, turn_variance, nis)

    def fuse(self, sighting: Sighting, innovation: Innovation) -> tuple[Array, Array]:
        """Take the sighting.

        Returns:
            How much farther the pad is from the vehicle than the sighting says, (3,), and the covariance (3, 3) of that vector.
            The vehicle's coordinates at that moment are wrong by their quick noise q, which the fix shares: what the
            innovation says of q is added to the place.
        """
        K = innovation.cross_m2 @ innovation.inverse
        P = self._P - K @ innovation.cross_m2.T
        self._P = 0.5 * (P + P.T)
        self._x = self._x + K @ innovation.away_m
        gain = self._azimuth_variance / max(innovation.turn_variance_rad2, 1e-12)
        self._azimuth_rad = wrap_pi(self._azimuth_rad + gain * innovation.turn_rad)
        self._azimuth_variance *= 1.0 - gain
        self._heading2 = sighting.heading_rad**2
        self.fixes += 1
        q = self._q_noise
        q_gain = q * innovation.inverse
        cross = q * K[_PLACE]
        covariance = self._P[_PLACE, _PLACE] + q * _EYE3 - q * q_gain - cross - cross.T
        return self._x[_PLACE] + q_gain @ innovation.away_m - sighting.place_m, covariance

    def blur(self, sigma_m: float) -> None:
        """The coordinates have become uncertain by so much more, each axis, metres."""
        P = self._P.copy()
        P[_PLACE, _PLACE] += sigma_m**2 * _EYE3
        self._P = P

    def rename(self, place_m: Array) -> None:
        """Call the same place by other coordinates, (3,)."""
        self._x = np.concatenate((place_m, self._x[3:]))

    def copy(self) -> "PadTrack":
        """The track as it is now, whatever becomes of this one: matrices are replaced, never changed."""
        return copy(self)

    def _predicted(self, ahead_s: float) -> tuple[Array, Array]:
        """State and covariance a moment later.

        The drift is a first-order Gauss-Markov process and the place its integral: van Loan's integrals in closed form, plus a
        random walk of the place; each lasting error a Gauss-Markov process of unit variance.
        """
        keep = math.exp(-ahead_s / self._rate_time_s)
        reach_s = self._rate_time_s * (1.0 - keep)
        F = np.exp(self._fading_per_s * ahead_s)
        x = F * self._x
        x[_PLACE] += reach_s * self._x[_DRIFT]
        P = self._P.copy()
        P[_PLACE] += reach_s * P[_DRIFT]
        P[:, _PLACE] += reach_s * P[:, _DRIFT]
        P *= F[:, None]
        P *= F
        u = ahead_s / self._rate_time_s
        walked = self._rate_time_s**2 * max(0.0, 2.0 * u - 3.0 + 4.0 * keep - keep * keep)
        together = self._rate2 * (self._rate_time_s * (1.0 - keep) ** 2)
        # Strided views of the diagonals of the blocks (place, place), (drift, drift), (place, drift) and so on.
        flat = P.reshape(_SIZE * _SIZE)
        diagonal = flat[:: _SIZE + 1]
        diagonal[_PLACE] += self._rate2 * walked + (self._settings.wander_m**2 + self.walk_m2ps) * ahead_s
        diagonal[_DRIFT] += self._rate2 * (1.0 - keep * keep)
        diagonal[_SHARED] += 1.0 - F[_SHARED] * F[_SHARED]
        flat[3 : 3 + 3 * (_SIZE + 1) : _SIZE + 1] += together
        flat[3 * _SIZE : 3 * _SIZE + 3 * (_SIZE + 1) : _SIZE + 1] += together
        return x, P

    def _azimuth_variance_after(self, ahead_s: float) -> float:
        return self._azimuth_variance + math.radians(self._settings.azimuth_wander_deg) ** 2 * ahead_s
