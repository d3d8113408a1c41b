"""Guidance `glide`: a setpoint that travels down a straight line to a point above the pad, and then straight down.

The setpoint is a point with a bounded acceleration. Whatever a new estimate says, it goes on from where it is, so a change of aim is a
bend and never a jump. It waits for the vehicle (leash), and it goes down only inside a funnel: the less sure the place is, or the
farther the vehicle is beside the setpoint, the higher it stays.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from alight.geometry.local_frame import LocalFrame
from alight.geometry.rotation import wrap_pi
from alight.runtime.clock import seconds
from schemas.message import GlobalPosition, Vector3
from schemas.settings.commander import GlideSettings
from schemas.vehicle import VehicleState

MAX_STEP_S = 0.1
"""After a pause the setpoint goes on as if no more time than this had passed."""
BRAKING_PART = 0.8
"""Part of the allowed acceleration that is planned for braking before the slow stretch."""
FRESH_PART = 0.4
"""Up to this part of the staleness limit an estimate counts as fresh; then the descent slows down to nothing at the limit."""
TOUCHDOWN_LEAD_M = 0.5
"""On the ground the setpoint goes no deeper than this below the vehicle, so that the thrust falls gently."""
MAX_TRIM_M = 0.4
MAX_TRIM_MPS = 0.15
ACCELERATION_TIME_S = 0.1
"""Over this time the acceleration that is sent along is smoothed."""
PROMPT_S = 0.06
"""A vehicle state up to this old stiffens fully: PX4's streams and a good link give 0.01 to 0.04 s."""
LATE_S = 0.16
"""One this old stiffens no more. What comes back so late arrives when the vehicle swings the other way, and drives the swing on."""
MAX_STIFFENING_MPS = 3.0
"""More than this is not added to the setpoint's velocity: a position that jumps must not become a dash."""
VIEW_MARGIN_RAD = math.radians(10.0)
"""So far inside the edge of the camera's view the pad does not slow the descent: what a vehicle leans that speeds up and flies against the wind."""
FINAL_MPS = 1.0
"""Fastest horizontal motion of the setpoint below the end of the line, m/s."""
CONTACT_MPS = 0.1
"""As much of it is left at the contact: a vehicle that touches the ground sideways falls over."""
SIDEWAYS_PER_HEIGHT_PER_S = 0.25
"""So much faster it may be in the touchdown for each metre that is left: a pad that is suddenly seen elsewhere is not run after."""


@dataclass(frozen=True)
class Aim:
    """What is flown to."""

    position: GlobalPosition
    """The pad's centre."""
    azimuth_rad: float | None
    """The heading to turn to; None to keep the present one."""
    sigma_m: float
    """Horizontal standard deviation of the position, metres."""
    drift_ned_mps: Vector3 = (0.0, 0.0, 0.0)
    """How the position drifts in the vehicle's navigation solution."""


@dataclass(frozen=True)
class Target:
    """A setpoint as it goes to the autopilot."""

    position: GlobalPosition
    velocity_ned_mps: Vector3
    acceleration_ned_mps2: Vector3
    yaw_ned_rad: float


def funnel_radius_m(settings: GlideSettings, height_above_pad_m: float) -> float:
    """The horizontal error allowed at a height, metres."""
    return settings.funnel_floor_m + settings.funnel_slope * max(height_above_pad_m, 0.0)


def view_part(settings: GlideSettings, beside_m: float, height_above_pad_m: float) -> float:
    """How fast to go down for the sake of the camera: 0 for a pad at the edge of its view or beyond, 1 for one well inside it."""
    inside_rad = math.radians(settings.view_edge_deg) - math.atan2(beside_m, height_above_pad_m)
    return min(max(inside_rad / VIEW_MARGIN_RAD, 0.0), 1.0)


def descent_speed_mps(settings: GlideSettings, height_above_pad_m: float) -> float:
    """Vertical speed of the line at a height, m/s: slow near the ground, and braking towards that in time."""
    above_m = height_above_pad_m - settings.slow_below_m
    slow_mps = min(settings.slow_mps, settings.descent_mps)
    if above_m <= 0.0:
        return slow_mps
    braking_mps2 = BRAKING_PART * settings.acceleration_mps2
    return min(settings.descent_mps, math.sqrt(slow_mps**2 + 2.0 * braking_mps2 * above_m))


class Glide:
    """One descent. All vectors are NED at `origin`, which is frozen: neither home nor the vehicle moves the frame."""

    def __init__(self, settings: GlideSettings, origin: GlobalPosition, yaw_ned_rad: float, now_ns: int) -> None:
        """Begin at the vehicle's place.

        Args:
            settings: Speeds, funnel and limits.
            origin: Where the vehicle is now; the setpoint starts here.
            yaw_ned_rad: Where its nose points.
            now_ns: The time, UTC ns.
        """
        self._settings = settings
        self._frame = LocalFrame(origin)
        self._place: Vector3 = (0.0, 0.0, 0.0)
        self._velocity: Vector3 = (0.0, 0.0, 0.0)
        self._acceleration: Vector3 = (0.0, 0.0, 0.0)
        self._trim: tuple[float, float] = (0.0, 0.0)
        self._yaw_rad = yaw_ned_rad
        self._yaw_wanted_rad = yaw_ned_rad
        self._pad: Vector3 | None = None
        self._drift: Vector3 = (0.0, 0.0, 0.0)
        self._sigma_m = 0.0
        self._then_ns = now_ns
        self._closed_since_ns: int | None = None
        self._touching_down = False

    def aim(self, aim: Aim) -> None:
        """Take a new estimate."""
        self._pad = self._frame.ned_of(aim.position)
        self._drift = aim.drift_ned_mps
        self._sigma_m = aim.sigma_m
        if aim.azimuth_rad is not None:
            self._yaw_wanted_rad = aim.azimuth_rad

    def displace(self, jump_ned_m: Vector3) -> None:
        """The navigation solution has jumped by so much: setpoint and pad are where they were, and are called otherwise."""
        self._place = _sum(self._place, jump_ned_m)
        self._pad = None if self._pad is None else _sum(self._pad, jump_ned_m)

    def touch_down(self) -> None:
        """From now on go down whatever comes."""
        self._touching_down = True
        self._closed_since_ns = None

    def closed_for_s(self, now_ns: int) -> float:
        """For how long the funnel has been closed, seconds; 0 if it is open."""
        return 0.0 if self._closed_since_ns is None else seconds(now_ns - self._closed_since_ns)

    def advance(self, vehicle: VehicleState, freshness: float, flown: bool, now_ns: int) -> Target:
        """Move the setpoint on to `now_ns`.

        Args:
            vehicle: Where the vehicle is and how fast.
            freshness: 1 for a fresh estimate down to 0 for one at the staleness limit; scales the vertical speed. Sideways it goes on:
                the pad stays where it was seen last, and the nearer, the better it comes into view again.
            flown: Whether the autopilot flies these setpoints already; until then the setpoint stays where it is.
            now_ns: The time, UTC ns.
        """
        step_s = min(seconds(now_ns - self._then_ns), MAX_STEP_S)
        self._then_ns = now_ns
        north, east, down = self._frame.ned_of(vehicle.position)
        if flown and step_s > 0.0:
            self._move((north, east, down), freshness, step_s, now_ns)
            self._turn(step_s)
        place = (self._place[0] + self._trim[0], self._place[1] + self._trim[1], self._place[2])
        age_s = seconds(now_ns - vehicle.at_ns)
        velocity = self._stiffened((north, east), vehicle.velocity_ned_mps, age_s) if flown else self._velocity
        return Target(self._frame.point_at(*place), velocity, self._acceleration, wrap_pi(self._yaw_rad))

    def _stiffened(self, vehicle: tuple[float, float], velocity: Vector3, age_s: float) -> Vector3:
        """The setpoint's velocity, and horizontally more against the vehicle's error.

        PX4's own gain (MPC_XY_P, 0.95 a second) is meant for flying about; wind pushes a vehicle far off at it. This closes a second
        loop around the link, so it fades with the age of what it goes by.
        """
        stiffness, damping = self._settings.stiffness_per_s, self._settings.damping
        vn, ve, vd = self._velocity
        more_n = stiffness * (self._place[0] - vehicle[0]) + damping * (vn - velocity[0])
        more_e = stiffness * (self._place[1] - vehicle[1]) + damping * (ve - velocity[1])
        part = promptness_of(age_s) * min(1.0, MAX_STIFFENING_MPS / max(math.hypot(more_n, more_e), 1e-9))
        return (vn + part * more_n, ve + part * more_e, vd)

    def _move(self, vehicle: Vector3, freshness: float, step_s: float, now_ns: int) -> None:
        wanted = self._wanted_velocity(vehicle, freshness, now_ns)
        change = self._allowed_change(wanted, step_s)
        vn, ve, vd = (v + c for v, c in zip(self._velocity, change, strict=True))
        self._smooth_acceleration([c / step_s for c in change], step_s)
        n, e, d = self._place
        self._velocity = (vn, ve, vd)
        # The drift moves the place and is no velocity: it is the solution's position that drifts, and a vehicle above the pad drifts along
        # in it without flying. Left out here, the setpoint would stay behind the pad by drift / gain.
        self._place = (n + (vn + self._drift[0]) * step_s, e + (ve + self._drift[1]) * step_s, d + vd * step_s)
        on_ground = False
        if self._touching_down:
            deepest_m = vehicle[2] + TOUCHDOWN_LEAD_M
            on_ground = self._place[2] > deepest_m
            if on_ground:
                # A place that drifts away from a vehicle that stands would lean it over.
                self._place, self._velocity = (n, e, deepest_m), (0.0, 0.0, vd)
        if not on_ground:
            self._adjust_trim(vehicle, step_s)

    def _allowed_change(self, wanted: Vector3, step_s: float) -> Vector3:
        """What the velocity may change in one step, towards the wanted one.

        On the line the horizontal speed grows slowly: a vehicle that leans into its acceleration turns a fixed camera away from the
        pad, which at the start of a line lies near the edge of the picture.
        """
        cn, ce, cd = (w - v for w, v in zip(wanted, self._velocity, strict=True))
        acceleration = self._settings.acceleration_mps2
        scale = min(1.0, acceleration * step_s / max(math.hypot(cn, ce, cd), 1e-9))
        quicker = math.hypot(*wanted[:2]) > math.hypot(*self._velocity[:2])
        if quicker and self._pad is not None and self._pad[2] - self._place[2] > self._settings.vertical_below_m:
            # One scale for all axes: it must not sink below the line meanwhile, either.
            scale = min(scale, self._settings.line_acceleration_mps2 * step_s / max(math.hypot(cn, ce), 1e-9))
        return (cn * scale, ce * scale, cd * scale)

    def _adjust_trim(self, vehicle: Vector3, step_s: float) -> None:
        """Off the line, work off what the autopilot leaves of the error.

        After a change of speed its velocity integrator (MPC_XY_VEL_I_ACC) takes more than four seconds to settle, during which the
        vehicle hangs up to 0.2 m beside the setpoint: longer than the last metres last.
        """
        on_line = self._pad is not None and self._pad[2] - self._place[2] > self._settings.vertical_below_m
        gain = self._settings.trim_gain_per_s
        north, east = self._trim
        rate_n = -north if on_line else gain * (self._place[0] - vehicle[0])
        rate_e = -east if on_line else gain * (self._place[1] - vehicle[1])
        slowed = min(1.0, MAX_TRIM_MPS / max(math.hypot(rate_n, rate_e), 1e-9))
        north += rate_n * slowed * step_s
        east += rate_e * slowed * step_s
        shrink = min(1.0, MAX_TRIM_M / max(math.hypot(north, east), 1e-9))
        self._trim = (north * shrink, east * shrink)

    def _smooth_acceleration(self, acceleration: Sequence[float], step_s: float) -> None:
        """The acceleration as it is sent: what two steps differ by is noise to the vehicle."""
        weight = step_s / (step_s + ACCELERATION_TIME_S)
        an, ae, ad = (old + weight * (new - old) for old, new in zip(self._acceleration, acceleration, strict=True))
        self._acceleration = (an, ae, ad)

    def _wanted_velocity(self, vehicle: Vector3, freshness: float, now_ns: int) -> Vector3:
        if self._pad is None:
            return (0.0, 0.0, 0.0)
        north, east = self._pad[0] - self._place[0], self._pad[1] - self._place[1]
        height_m = self._pad[2] - self._place[2]
        if self._touching_down:
            fastest_mps = min(FINAL_MPS, CONTACT_MPS + SIDEWAYS_PER_HEIGHT_PER_S * max(height_m, 0.0))
            return (*self._towards_axis(north, east, fastest_mps), self._settings.touchdown_mps)
        is_open = self._is_open(vehicle, math.hypot(north, east), height_m, now_ns)
        if height_m > self._settings.vertical_below_m:
            return self._along_the_line(north, east, height_m, freshness) if is_open else (0.0, 0.0, 0.0)
        down_mps = descent_speed_mps(self._settings, height_m) * freshness if is_open else 0.0
        return (*self._towards_axis(north, east, FINAL_MPS), down_mps)

    def _along_the_line(self, north: float, east: float, height_m: float, freshness: float) -> Vector3:
        """Towards the end of the line, so that horizontal and vertical distance become nothing together while the estimate is fresh.

        From where the pad is at the edge of the view, it flies nearly level at first, and the line begins later, and steeper.
        """
        down_m = height_m - self._settings.vertical_below_m
        down_mps = descent_speed_mps(self._settings, height_m)
        slope = math.hypot(north, east) / down_m
        if slope * down_mps > self._settings.max_horizontal_mps:
            down_mps = self._settings.max_horizontal_mps / slope
        slowed = freshness * view_part(self._settings, math.hypot(north, east), height_m)
        return (*self._towards_axis(north, east, slope * down_mps), down_mps * slowed)

    def _towards_axis(self, north: float, east: float, fastest_mps: float) -> tuple[float, float]:
        distance_m = math.hypot(north, east)
        speed_mps = min(self._settings.approach_gain_per_s * distance_m, fastest_mps)
        return (north / distance_m * speed_mps, east / distance_m * speed_mps) if distance_m > 0.0 else (0.0, 0.0)

    def _is_open(self, vehicle: Vector3, to_axis_m: float, height_m: float, now_ns: int) -> bool:
        """Whether going down is allowed: the vehicle is near the setpoint, the setpoint on the line, and the place known well."""
        beside_m = math.hypot(vehicle[0] - self._place[0], vehicle[1] - self._place[1])
        if height_m <= self._settings.vertical_below_m:
            beside_m = max(beside_m, to_axis_m, math.hypot(vehicle[0] - self._axis(0), vehicle[1] - self._axis(1)))
        behind_m = math.dist(vehicle, self._place)
        narrow = beside_m + 2.0 * self._sigma_m > funnel_radius_m(self._settings, height_m)
        if narrow or behind_m > self._settings.leash_m:
            self._closed_since_ns = now_ns if self._closed_since_ns is None else self._closed_since_ns
            return False
        self._closed_since_ns = None
        return True

    def _axis(self, index: int) -> float:
        return self._pad[index] if self._pad is not None else self._place[index]

    def _turn(self, step_s: float) -> None:
        error = wrap_pi(self._yaw_wanted_rad - self._yaw_rad)
        allowed = math.radians(self._settings.yaw_rate_dps) * step_s
        self._yaw_rad += min(max(error, -allowed), allowed)


def _sum(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def promptness_of(age_s: float) -> float:
    """1 for a vehicle state up to `PROMPT_S` old, then falling to 0 at `LATE_S`."""
    return min(max((LATE_S - age_s) / (LATE_S - PROMPT_S), 0.0), 1.0)


def freshness_of(age_s: float, stale_after_s: float) -> float:
    """1 for an estimate up to 0.4 of the staleness limit old, then falling to 0 at the limit."""
    return min(max((stale_after_s - age_s) / ((1.0 - FRESH_PART) * stale_after_s), 0.0), 1.0)
