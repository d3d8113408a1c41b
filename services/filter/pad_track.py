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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alight.geometry.horizontal_sigma import horizontal_sigma
from alight.geometry.rotation import wrap_pi
from alight.runtime.clock import seconds
from schemas.message import Vector3
from schemas.settings.filter import Kalman
from services.filter.pad_motion import DRIFT, PLACE, SHARED, SIZE, PadMotion
from services.filter.quick_noise import QuickNoise
from services.filter.sighting import Sighting

Array = NDArray[np.float64]

_EYE3 = np.eye(3)


class Innovation(NamedTuple):
    """A sighting against what was expected of it. Its covariance is S = L L^T."""

    away_m: Vector3
    """Sighting minus expectation."""
    variances_m2: Vector3
    """The diagonal of S."""
    whitener: Array
    """(3, 3), inverse of L, transposed; 1/m."""
    white: Array
    """(3,), the innovation in units of its own standard deviations: L^-1 away."""
    gain_m: Array
    """(17, 3), covariance of the state with the whitened innovation: what the state learns of each of its parts."""
    turn_rad: float
    """The azimuth's sighting minus expectation."""
    turn_variance_rad2: float
    nis: float
    """Both together, squared and normalised: chi-square with four degrees of freedom; infinite if S is no covariance."""


class PadTrack:
    """State: place (3), drift (3), lasting errors (11), and apart from these the azimuth."""

    def __init__(self, sighting: Sighting, settings: Kalman, motion: PadMotion) -> None:
        """Begin at a sighting."""
        self._motion = motion
        self._quick_noise = QuickNoise(settings.position_noise_m**2)
        C = sighting.H[:, SHARED]
        x, P = np.zeros(SIZE), np.zeros((SIZE, SIZE))
        x[PLACE] = sighting.place_m
        P[PLACE, PLACE] = sighting.noise_m2 + self._quick_noise.most_m2 * _EYE3 + C @ C.T
        P[PLACE, SHARED], P[SHARED, PLACE] = -C, -C.T
        P[SHARED, SHARED] = np.eye(SIZE - 6)
        P[DRIFT, DRIFT] = np.diag(motion.rate_variances)
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
            ahead_s = seconds(at_ns - self.at_ns)
            self._x, self._P = self._predicted(ahead_s)
            self._azimuth_variance += self._motion.azimuth_variance(ahead_s)
            self.at_ns = at_ns

    def place_at(self, at_ns: int) -> tuple[Array, Array, float]:
        """Place (3,), its covariance (3, 3) and the azimuth's variance at a time not before the newest sighting."""
        ahead_s = max(0.0, seconds(at_ns - self.at_ns))
        x, P = self._predicted(ahead_s)
        azimuth_variance = self._azimuth_variance + self._motion.azimuth_variance(ahead_s) + self._heading2
        return x[PLACE], P[PLACE, PLACE], azimuth_variance

    def soon_m(self, ahead_s: float) -> Vector3:
        """The place a moment later, by the drift alone."""
        n, e, d, vn, ve, vd = self._x[:6].tolist()
        return (n + vn * ahead_s, e + ve * ahead_s, d + vd * ahead_s)

    @property
    def place_m(self) -> Array:
        """(3,), at the time of the newest sighting or prediction."""
        return self._x[PLACE]

    @property
    def horizontal_sigma_m(self) -> float:
        """Standard deviation along the major horizontal axis, metres; NaN if the covariance is none."""
        return horizontal_sigma(float(self._P[0, 0]), float(self._P[0, 1]), float(self._P[1, 1]))

    @property
    def drift_mps(self) -> Vector3:
        """North, east, down."""
        vn, ve, vd = self._x[DRIFT].tolist()
        return (vn, ve, vd)

    @property
    def drift_covariance(self) -> Array:
        """(3, 3), (m/s)^2."""
        return self._P[DRIFT, DRIFT]

    @property
    def azimuth_rad(self) -> float:
        """In (-pi, pi]."""
        return self._azimuth_rad

    @property
    def azimuth_variance_rad2(self) -> float:
        """With the heading's own error, which the fixes share."""
        return self._azimuth_variance + self._heading2

    @property
    def quick_m2(self) -> float:
        """Variance of the quick error of the vehicle's coordinates, each axis, m^2."""
        return self._quick_noise.variance_m2

    def innovation(self, sighting: Sighting) -> Innovation:
        """What a sighting at the track's time says that was not expected."""
        H, q = sighting.H, self.quick_m2
        PHt = self._P @ H.T
        (snn, _, _), (sen, see, _), (sdn, sde, sdd) = (H @ PHt + sighting.noise_m2).tolist()
        xn, xe, xd = (H @ self._x).tolist()
        n, e, d = sighting.place_m
        away = (n - xn, e - xe, d - xd)
        variances = (snn + q, see + q, sdd + q)
        turn = wrap_pi(sighting.azimuth_rad - self._azimuth_rad)
        turn_variance = self._azimuth_variance + sighting.azimuth_noise_rad2
        whitener = np.array(_inverse_lower(variances, sen, sdn, sde)).reshape(3, 3)
        white = away @ whitener
        nis = float(white @ white) + turn * turn / max(turn_variance, 1e-12)
        return Innovation(
            away, variances, whitener, white, PHt @ whitener, turn, turn_variance, nis if nis >= 0.0 else math.inf
        )

    def fuse(self, sighting: Sighting, innovation: Innovation) -> tuple[Vector3, Array]:
        """Take the sighting.

        Returns:
            How much farther the pad is from the vehicle than the sighting says, and the covariance (3, 3) of that vector.
            The vehicle's coordinates at that moment are wrong by their quick noise q, which the fix shares: what is wanted is the
            place plus q, whose covariance with the whitened innovation is W below.
        """
        gain, white, q = innovation.gain_m, innovation.white, self.quick_m2
        W = gain[PLACE] + q * innovation.whitener
        covariance = self._P[PLACE, PLACE] + q * _EYE3 - W @ W.T
        n, e, d = (self._x[PLACE] + W @ white - sighting.place_m).tolist()
        self._P = self._P - gain @ gain.T
        self._x = self._x + gain @ white
        part = self._azimuth_variance / max(innovation.turn_variance_rad2, 1e-12)
        self._azimuth_rad = wrap_pi(self._azimuth_rad + part * innovation.turn_rad)
        self._azimuth_variance *= 1.0 - part
        self._heading2 = sighting.heading_rad**2
        self.fixes += 1
        return (n, e, d), covariance

    def learn(self, innovation: Innovation) -> None:
        """Let an innovation say, whether its sighting is taken or not, how large the quick error of the vehicle's coordinates is."""
        self._quick_noise = self._quick_noise.after(innovation.away_m, innovation.variances_m2)

    def blur(self, sigma_m: float) -> None:
        """The coordinates have become uncertain by so much more, each axis, metres."""
        P = self._P.copy()
        P[PLACE, PLACE] += sigma_m**2 * _EYE3
        self._P = P

    def rename(self, place_m: Vector3) -> None:
        """Call the same place by other coordinates."""
        self._x = np.concatenate((place_m, self._x[3:]))

    def copy(self) -> "PadTrack":
        """The track as it is now, whatever becomes of this one: matrices are replaced, never changed."""
        twin = object.__new__(PadTrack)
        twin.__dict__.update(self.__dict__)
        return twin

    def _predicted(self, ahead_s: float) -> tuple[Array, Array]:
        """State and covariance a moment later."""
        F, Q = self._motion.over(ahead_s)
        P = F @ self._P @ F.T + Q
        if self.walk_m2ps > 0.0:
            P[PLACE, PLACE] += (self.walk_m2ps * ahead_s) * _EYE3
        return F @ self._x, P


def _inverse_lower(variances: Vector3, en: float, dn: float, de: float) -> tuple[float, ...]:
    """(L^-1)^T, row by row, for L L^T = S given by its diagonal and what is below it; NaN if S is not positive definite."""
    nn, ee, dd = variances
    if not nn > 0.0:
        return (math.nan,) * 9
    l_nn = math.sqrt(nn)
    l_en, l_dn = en / l_nn, dn / l_nn
    ee2 = ee - l_en * l_en
    if not ee2 > 0.0:
        return (math.nan,) * 9
    l_ee = math.sqrt(ee2)
    l_de = (de - l_dn * l_en) / l_ee
    dd2 = dd - l_dn * l_dn - l_de * l_de
    if not dd2 > 0.0:
        return (math.nan,) * 9
    a, b, c = 1.0 / l_nn, 1.0 / l_ee, 1.0 / math.sqrt(dd2)
    ba = -l_en * a * b
    return (a, ba, -(l_dn * a + l_de * ba) * c, 0.0, b, -l_de * b * c, 0.0, 0.0, c)
