"""The navigation solution: what the autopilot believes of the vehicle, which is the truth plus honest errors."""

import math

import numpy as np

from schemas.settings.simulator import SensorErrors
from services.simulator.body import Body
from services.simulator.noise import GaussMarkov, Normals, SmoothGaussMarkov

NOISE_TIME_S = 0.1
VELOCITY_TIME_S = 0.5
TILT_TIME_S = 5.0
YAW_TIME_S = 10.0
GNSS_TIME_S = 10.0
ERROR_PERIOD_STEPS = 5
"""The errors move at 50 Hz; the state they are added to at every step."""


class Estimate:
    """Position, velocity, attitude and rates in the autopilot's local frame (north, east, down from its origin).

    The errors are Gauss-Markov processes (see `SensorErrors`); the acceleration is that of the body, as the accelerometers tell it well.
    """

    def __init__(
        self, errors: SensorErrors, generator: np.random.Generator, step_s: float, origin_down_m: float
    ) -> None:
        normals = Normals(generator)
        period_s = step_s * ERROR_PERIOD_STEPS

        def process(sigma: float, time_s: float) -> GaussMarkov:
            return GaussMarkov(normals, sigma, time_s, period_s)

        def wander(sigma: float, time_s: float) -> GaussMarkov | SmoothGaussMarkov:
            if not errors.wander_smoothing_s:
                return process(sigma, time_s)
            return SmoothGaussMarkov(normals, sigma, time_s, errors.wander_smoothing_s, period_s)

        self._wander = tuple(wander(errors.position_wander_m, errors.position_wander_time_s) for _ in range(2))
        self._drift = wander(errors.altitude_wander_m, errors.altitude_wander_time_s)
        self._noise = tuple(process(errors.position_noise_m, NOISE_TIME_S) for _ in range(3))
        self._velocity = tuple(process(errors.velocity_noise_mps, VELOCITY_TIME_S) for _ in range(3))
        self._tilt = tuple(process(math.radians(errors.tilt_noise_deg), TILT_TIME_S) for _ in range(2))
        self._yaw_bias_rad = math.radians(errors.yaw_bias_deg) * normals.next()
        self._yaw = process(math.radians(errors.yaw_noise_deg), YAW_TIME_S)
        self._gnss = tuple(process(errors.gnss_noise_m, GNSS_TIME_S) for _ in range(3))
        self._processes = (
            *self._wander,
            self._drift,
            *self._noise,
            *self._velocity,
            *self._tilt,
            self._yaw,
            *self._gnss,
        )
        self._rate_sigma = math.radians(errors.rate_noise_dps)
        self._normals = normals
        self._origin_down_m = origin_down_m
        self._steps = 0
        self.north = self.east = self.down = 0.0
        self.vn = self.ve = self.vd = 0.0
        self.an = self.ae = self.ad = 0.0
        self.qw, self.qx, self.qy, self.qz = 1.0, 0.0, 0.0, 0.0
        self.p = self.q = self.r = 0.0
        self.yaw = 0.0
        self.height_above_ground_m = 0.0
        self._spread()

    def update(self, body: Body, ground_down_m: float) -> None:
        """Take the body's state of this step."""
        self._steps += 1
        if self._steps >= ERROR_PERIOD_STEPS:
            self._steps = 0
            for process in self._processes:
                process.advance()
            self._spread()
        self.north = body.north_m + self._dn
        self.east = body.east_m + self._de
        self.down = body.down_m - self._origin_down_m + self._dd
        self.vn, self.ve, self.vd = body.vn + self._dvn, body.ve + self._dve, body.vd + self._dvd
        self.an, self.ae, self.ad = body.an, body.ae, body.ad
        draw, sigma = self._normals.next, self._rate_sigma
        self.p, self.q, self.r = body.p + sigma * draw(), body.q + sigma * draw(), body.r + sigma * draw()
        # q_est = q_error * q: small rotation about north, east and down.
        ex, ey, ez = self._ex, self._ey, self._ez
        w, x, y, z = body.qw, body.qx, body.qy, body.qz
        self.qw = qw = w - ex * x - ey * y - ez * z
        self.qx = qx = x + ex * w + ey * z - ez * y
        self.qy = qy = y + ey * w + ez * x - ex * z
        self.qz = qz = z + ez * w + ex * y - ey * x
        self.yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
        self.height_above_ground_m = ground_down_m - body.down_m

    @property
    def gnss_error_ned_m(self) -> tuple[float, float, float]:
        """What GPS_RAW_INT says beyond the solution, north, east, down, metres."""
        north, east, down = self._gnss
        return north.value, east.value, 1.5 * down.value

    def _spread(self) -> None:
        self._dn = self._wander[0].value + self._noise[0].value
        self._de = self._wander[1].value + self._noise[1].value
        self._dd = self._drift.value + self._noise[2].value
        self._dvn, self._dve, self._dvd = (process.value for process in self._velocity)
        self._ex, self._ey = 0.5 * self._tilt[0].value, 0.5 * self._tilt[1].value
        self._ez = 0.5 * (self._yaw_bias_rad + self._yaw.value)
