"""Jerk-limited smoothing of positions and velocities for the automatic modes."""

import math
from typing import NamedTuple

SETTLE_S = 0.1
"""Near its target the acceleration follows the velocity error over this time instead of the square root, which would chatter."""


class Limits(NamedTuple):
    """Bounds of a smooth motion."""

    acceleration_mps2: float
    jerk_mps3: float
    lag_m: float = 1.0
    """How far the vehicle may fall behind before the path stands still, metres."""


def speed_to_stop(distance_m: float, limits: Limits) -> float:
    """The highest speed from which the vehicle still stops within a distance.

    Stopping from v takes v^2 / (2 a) at full deceleration, and 2 a / j seconds more at v while the deceleration builds up.
    """
    acceleration = limits.acceleration_mps2
    half_delay = 2.0 * acceleration * acceleration / limits.jerk_mps3
    return math.sqrt(half_delay * half_delay + 2.0 * acceleration * distance_m) - half_delay


class Axis:
    """Position, velocity and acceleration along one axis, moved with bounded jerk."""

    __slots__ = ("a", "v", "x")

    def __init__(self) -> None:
        self.x = self.v = self.a = 0.0

    def reset(self, x: float, v: float, a: float) -> None:
        """Start from here."""
        self.x, self.v, self.a = x, v, a

    def advance(self, target_v: float, limits: Limits, step_s: float) -> None:
        """Move on by `step_s` towards the velocity `target_v`, as fast as jerk and acceleration allow."""
        if step_s <= 0.0:
            return
        jerk = limits.jerk_mps3
        # The velocity error that will be left when the present acceleration has been taken back to zero.
        error = target_v - self.v - self.a * abs(self.a) / (2.0 * jerk)
        wanted = min(math.sqrt(2.0 * jerk * abs(error)), abs(error) / SETTLE_S, limits.acceleration_mps2)
        if error < 0.0:
            wanted = -wanted
        if abs(error) < 1e-3:
            wanted = 0.0
        change = max(-jerk * step_s, min(jerk * step_s, wanted - self.a))
        mean_a = self.a + 0.5 * change
        self.x += step_s * (self.v + 0.5 * step_s * mean_a)
        self.v += step_s * mean_a
        self.a += change


class SmoothPath:
    """A point that runs ahead of the vehicle, with bounded speed, acceleration and jerk, and waits when the vehicle falls behind."""

    def __init__(self) -> None:
        self.north, self.east, self.down = Axis(), Axis(), Axis()

    def reset(self, position: tuple[float, float, float], velocity: tuple[float, float, float]) -> None:
        """Start from the vehicle's present motion."""
        for axis, x, v in zip((self.north, self.east, self.down), position, velocity, strict=True):
            axis.reset(x, v, 0.0)

    def advance_horizontally(
        self, target: tuple[float, float], vehicle: tuple[float, float], speed: float, limits: Limits, step_s: float
    ) -> None:
        """Move on towards a point.

        Args:
            target: Where to, north and east, metres.
            vehicle: Where the vehicle is, north and east, metres.
            speed: Upper bound of the speed, m/s.
            limits: Bounds of the motion.
            step_s: Time step.
        """
        ahead_n, ahead_e = self.north.x - vehicle[0], self.east.x - vehicle[1]
        if ahead_n * self.north.v + ahead_e * self.east.v > 0.0:
            step_s *= 1.0 - min(math.hypot(ahead_n, ahead_e) / limits.lag_m, 1.0)
        to_n, to_e = target[0] - self.north.x, target[1] - self.east.x
        distance = math.hypot(to_n, to_e)
        speed = min(speed, speed_to_stop(distance, limits))
        scale = speed / distance if distance > 1e-6 else 0.0
        self.north.advance(to_n * scale, limits, step_s)
        self.east.advance(to_e * scale, limits, step_s)

    def advance_to_level(
        self, target: float, vehicle: float, speed_up_down: tuple[float, float], limits: Limits, step_s: float
    ) -> None:
        """Move on towards a level (down coordinate); wait for a vehicle that lags."""
        ahead = self.down.x - vehicle
        if ahead * self.down.v > 0.0:
            step_s *= 1.0 - min(abs(ahead) / limits.lag_m, 1.0)
        distance = target - self.down.x
        speed = min(speed_up_down[1 if distance > 0.0 else 0], speed_to_stop(abs(distance), limits))
        self.down.advance(math.copysign(speed, distance), limits, step_s)

    def advance_at_rate(self, down_mps: float, limits: Limits, step_s: float) -> None:
        """Move on downwards at a rate."""
        self.down.advance(down_mps, limits, step_s)


class SmoothHeading:
    """An azimuth that turns with bounded rate and acceleration."""

    def __init__(self) -> None:
        self.yaw = self.rate = 0.0

    def reset(self, yaw_rad: float) -> None:
        """Start from here."""
        self.yaw, self.rate = yaw_rad, 0.0

    def advance(self, target_rad: float, rate_bound: float, acceleration: float, step_s: float) -> None:
        """Turn on towards an azimuth the short way."""
        error = math.remainder(target_rad - self.yaw, math.tau)
        wanted = math.copysign(
            min(rate_bound, math.sqrt(2.0 * acceleration * abs(error)), abs(error) / SETTLE_S / 5.0), error
        )
        self.rate += max(-acceleration * step_s, min(acceleration * step_s, wanted - self.rate))
        self.yaw = math.remainder(self.yaw + step_s * self.rate, math.tau)
