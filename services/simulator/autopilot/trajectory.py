"""Jerk-limited smoothing of positions and velocities for the automatic modes."""

import math

SETTLE_S = 0.1
"""Near its target the acceleration follows the velocity error over this time instead of the square root, which would chatter."""


def speed_to_stop(distance_m: float, acceleration_mps2: float, jerk_mps3: float) -> float:
    """The highest speed from which the vehicle still stops within a distance.

    Stopping from v takes v^2 / (2 a) at full deceleration, and 2 a / j seconds more at v while the deceleration builds up.
    """
    half_delay = acceleration_mps2 * acceleration_mps2 / jerk_mps3 * 2.0
    return math.sqrt(half_delay * half_delay + 2.0 * acceleration_mps2 * distance_m) - half_delay


class Axis:
    """Position, velocity and acceleration along one axis, moved with bounded jerk."""

    __slots__ = ("a", "v", "x")

    def __init__(self) -> None:
        self.x = self.v = self.a = 0.0

    def reset(self, x: float, v: float, a: float) -> None:
        """Start from here."""
        self.x, self.v, self.a = x, v, a

    def advance(self, target_v: float, acceleration: float, jerk: float, step_s: float) -> None:
        """Move on by `step_s` towards the velocity `target_v`, as fast as jerk and acceleration allow."""
        if step_s <= 0.0:
            return
        # The velocity error that will be left when the present acceleration has been taken back to zero.
        error = target_v - self.v - self.a * abs(self.a) / (2.0 * jerk)
        wanted = min(math.sqrt(2.0 * jerk * abs(error)), abs(error) / SETTLE_S, acceleration)
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
        self, target: tuple[float, float], vehicle: tuple[float, float], speed: float, acceleration: float, jerk: float, allowed_error: float, step_s: float
    ) -> None:
        """Move on towards a point (north, east).

        Args:
            target: Where to, metres.
            vehicle: Where the vehicle is, metres.
            speed: Upper bound of the speed, m/s.
            acceleration: Upper bound, m/s^2.
            jerk: Upper bound, m/s^3.
            allowed_error: How far the vehicle may lag before the path stands still, metres.
            step_s: Time step.
        """
        ahead_n, ahead_e = self.north.x - vehicle[0], self.east.x - vehicle[1]
        if ahead_n * self.north.v + ahead_e * self.east.v > 0.0:
            step_s *= 1.0 - min(math.hypot(ahead_n, ahead_e) / allowed_error, 1.0)
        to_n, to_e = target[0] - self.north.x, target[1] - self.east.x
        distance = math.hypot(to_n, to_e)
        scale = min(speed, speed_to_stop(distance, acceleration, jerk)) / distance if distance > 1e-6 else 0.0
        self.north.advance(to_n * scale, acceleration, jerk, step_s)
        self.east.advance(to_e * scale, acceleration, jerk, step_s)

    def advance_to_level(self, target: float, up: float, down: float, acceleration: float, jerk: float, step_s: float) -> None:
        """Move on towards a level (down coordinate) at no more than `up` or `down` m/s."""
        distance = target - self.down.x
        bound = down if distance > 0.0 else up
        speed = min(bound, speed_to_stop(abs(distance), acceleration, jerk))
        self.down.advance(math.copysign(speed, distance), acceleration, jerk, step_s)

    def advance_at_rate(self, down_mps: float, acceleration: float, jerk: float, step_s: float) -> None:
        """Move on downwards at a rate."""
        self.down.advance(down_mps, acceleration, jerk, step_s)


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
        wanted = math.copysign(min(rate_bound, math.sqrt(2.0 * acceleration * abs(error)), abs(error) / SETTLE_S / 5.0), error)
        self.rate += max(-acceleration * step_s, min(acceleration * step_s, wanted - self.rate))
        self.yaw = math.remainder(self.yaw + step_s * self.rate, math.tau)
