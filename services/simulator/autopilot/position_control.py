"""Position P and velocity PID: from a setpoint to the thrust vector, with PX4's limits."""

import math
from math import isnan

from services.simulator.autopilot.parameters import Parameters
from services.simulator.autopilot.setpoint import Setpoint
from services.simulator.body import GRAVITY_MPS2
from services.simulator.estimator import Estimate


class PositionControl:
    """The outer loops of the multicopter cascade. Thrust is in commands of 0 to 1 of the four rotors together."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._version = -1
        self.in_ = self.ie = self.id = 0.0
        """Integral of the velocity error, m/s^2."""
        self.setpoint = Setpoint()
        """What is flown: the position asked for, the velocity and acceleration that follow from it."""
        self.thrust = (0.0, 0.0, 0.0)
        """Thrust vector, north, east, down."""

    def reset(self, down_integral: float = 0.0) -> None:
        """Forget the integrals."""
        self.in_ = self.ie = 0.0
        self.id = down_integral

    def step(self, ask: Setpoint, estimate: Estimate, up_bound_mps: float, step_s: float) -> None:
        """One step of the outer loops.

        Args:
            ask: The setpoint.
            estimate: The navigation solution.
            up_bound_mps: Upper bound of the climb rate; negative while the takeoff ramp still presses down.
            step_s: Time step.
        """
        if self._version != self._parameters.version:
            self._load()
        vn, ve, vd = self._velocity(ask, estimate, up_bound_mps)
        error_n, error_e, error_d = vn - estimate.vn, ve - estimate.ve, vd - estimate.vd
        an = self._p_xy * error_n + self.in_ - self._d_xy * estimate.an + ask.an
        ae = self._p_xy * error_e + self.ie - self._d_xy * estimate.ae + ask.ae
        ad = self._p_z * error_d + self.id - self._d_z * estimate.ad + ask.ad
        tn, te, td = self._thrust(an, ae, ad)
        per_thrust = GRAVITY_MPS2 / self._hover
        produced_n, produced_e = tn * per_thrust, te * per_thrust
        if an * an + ae * ae > produced_n * produced_n + produced_e * produced_e:
            # What the saturation cut off unwinds the integral.
            unwind = 2.0 / self._p_xy
            error_n -= unwind * (an - produced_n)
            error_e -= unwind * (ae - produced_e)
        if (td >= -self._thrust_min and error_d >= 0.0) or (td <= -self._thrust_max and error_d <= 0.0):
            error_d = 0.0
        self.in_ += self._i_xy * error_n * step_s
        self.ie += self._i_xy * error_e * step_s
        self.id = max(-GRAVITY_MPS2, min(GRAVITY_MPS2, self.id + self._i_z * error_d * step_s))
        self.setpoint = Setpoint(ask.north, ask.east, ask.down, vn, ve, vd, an, ae, ad, ask.yaw, ask.yaw_rate)
        self.thrust = (tn, te, td)

    def _velocity(self, ask: Setpoint, estimate: Estimate, up_bound_mps: float) -> tuple[float, float, float]:
        """Position error times gain plus feed-forward; the way to the position has priority within the speed limit."""
        to_n = 0.0 if isnan(ask.north) else self._pos_p_xy * (ask.north - estimate.north)
        to_e = 0.0 if isnan(ask.east) else self._pos_p_xy * (ask.east - estimate.east)
        to_d = 0.0 if isnan(ask.down) else self._pos_p_z * (ask.down - estimate.down)
        forward_n = 0.0 if isnan(ask.vn) else ask.vn
        forward_e = 0.0 if isnan(ask.ve) else ask.ve
        vn, ve = bounded_sum(to_n, to_e, forward_n, forward_e, self._speed_max)
        vd = to_d + (0.0 if isnan(ask.vd) else ask.vd)
        return vn, ve, max(-min(up_bound_mps, self._up_max), min(self._down_max, vd))

    def _thrust(self, an: float, ae: float, ad: float) -> tuple[float, float, float]:
        """Thrust vector for an acceleration: tilt bounded, the vertical part served first."""
        horizontal = math.hypot(an, ae)
        body_z = GRAVITY_MPS2
        tilt_tan = min(horizontal / body_z, self._tilt_max_tan)
        lift = max((1.0 - ad / GRAVITY_MPS2) * self._hover, 0.0)
        cos_tilt = 1.0 / math.sqrt(1.0 + tilt_tan * tilt_tan)
        along = max(lift / cos_tilt, self._thrust_min)
        td, txy = along * cos_tilt, along * cos_tilt * tilt_tan
        margin = min(txy, self._margin_xy)
        td = min(td, math.sqrt(self._thrust_max**2 - margin * margin))
        txy = min(txy, math.sqrt(max(0.0, self._thrust_max**2 - td * td)))
        scale = txy / horizontal if horizontal > 1e-9 else 0.0
        return an * scale, ae * scale, -td

    def _load(self) -> None:
        value = self._parameters.__getitem__
        self._version = self._parameters.version
        self._pos_p_xy, self._pos_p_z = value("MPC_XY_P"), value("MPC_Z_P")
        self._p_xy, self._i_xy, self._d_xy = (
            value("MPC_XY_VEL_P_ACC"),
            value("MPC_XY_VEL_I_ACC"),
            value("MPC_XY_VEL_D_ACC"),
        )
        self._p_z, self._i_z, self._d_z = value("MPC_Z_VEL_P_ACC"), value("MPC_Z_VEL_I_ACC"), value("MPC_Z_VEL_D_ACC")
        self._speed_max, self._up_max, self._down_max = (
            value("MPC_XY_VEL_MAX"),
            value("MPC_Z_VEL_MAX_UP"),
            value("MPC_Z_VEL_MAX_DN"),
        )
        self._tilt_max_tan = math.tan(math.radians(min(value("MPC_TILTMAX_AIR"), 80.0)))
        self._hover, self._margin_xy = value("MPC_THR_HOVER"), value("MPC_THR_XY_MARG")
        self._thrust_min, self._thrust_max = value("MPC_THR_MIN"), value("MPC_THR_MAX")


def bounded_sum(first_n: float, first_e: float, second_n: float, second_e: float, bound: float) -> tuple[float, float]:
    """The sum of two vectors, of a length of at most `bound`, where the first one keeps its direction and gives way last."""
    total_n, total_e = first_n + second_n, first_e + second_e
    if total_n * total_n + total_e * total_e <= bound * bound:
        return total_n, total_e
    first = math.hypot(first_n, first_e)
    if first >= bound:
        return first_n * bound / first, first_e * bound / first
    # As much of the second as fits: |first + s second| = bound.
    second2 = second_n * second_n + second_e * second_e
    dot = first_n * second_n + first_e * second_e
    s = (math.sqrt(max(0.0, dot * dot - second2 * (first * first - bound * bound))) - dot) / second2
    return first_n + s * second_n, first_e + s * second_e
