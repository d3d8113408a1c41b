"""What the automatic modes fly: takeoff, hold and reposition, return, land."""

import math

from services.simulator.autopilot.parameters import Parameters
from services.simulator.autopilot.setpoint import NAN, Setpoint
from services.simulator.autopilot.trajectory import Limits, SmoothHeading, SmoothPath
from services.simulator.estimator import Estimate

TURN_TO_TARGET_M = 10.0
"""A reposition without a yaw turns the nose to its target if that is further away."""
RETURN_CONE_M = 2.0
"""Close to home the return climbs only by this much."""
ARRIVED_M = 1.0
TAKEOFF_DONE_M = 0.4
"""The climb counts as finished this close to its altitude."""


class Guidance:
    """The targets of the automatic modes in the local frame, and the smooth path to them."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self.path = SmoothPath()
        self.heading = SmoothHeading()
        self.target_north = self.target_east = self.target_down = 0.0
        self.target_yaw = NAN
        self.cruise_mps = NAN
        """Speed asked for by the last reposition; NaN for MPC_XY_CRUISE."""
        self.takeoff_north = self.takeoff_east = self.takeoff_down = 0.0
        self.returning = False
        """Whether RTL still flies home; afterwards it lands."""
        self.return_level_reached = False

    def begin(self, estimate: Estimate) -> None:
        """Take over from another mode, in the vehicle's present motion."""
        self.path.reset((estimate.north, estimate.east, estimate.down), (estimate.vn, estimate.ve, estimate.vd))
        self.heading.reset(estimate.yaw)

    def hold_here(self, estimate: Estimate) -> None:
        """Aim at the point where the vehicle comes to rest when it brakes now."""
        speed = math.hypot(estimate.vn, estimate.ve)
        lead_s = 1.3 * speed / (2.0 * self._parameters["MPC_ACC_HOR"])
        self.target_north = estimate.north + lead_s * estimate.vn
        self.target_east = estimate.east + lead_s * estimate.ve
        self.target_down = estimate.down
        self.target_yaw = self.heading.yaw
        self.cruise_mps = NAN

    def reposition(self, target: tuple[float, float, float], yaw: float, speed_mps: float, estimate: Estimate) -> None:
        """Fly to a point (north, east, down) and hold there; NaN keeps what it was."""
        north, east, down = target
        if not (math.isnan(north) or math.isnan(east)):
            away_n, away_e = north - estimate.north, east - estimate.east
            self.target_north, self.target_east = north, east
            if math.isnan(yaw) and math.hypot(away_n, away_e) > TURN_TO_TARGET_M:
                yaw = math.atan2(away_e, away_n)
        if not math.isnan(down):
            self.target_down = down
        if not math.isnan(yaw):
            self.target_yaw = yaw
        self.cruise_mps = speed_mps

    def begin_return(self, home: tuple[float, float, float], estimate: Estimate) -> float:
        """Start RTL; returns the level (down) at which it flies home."""
        self.hold_here(estimate)
        distance = math.hypot(home[0] - estimate.north, home[1] - estimate.east)
        full = home[2] - self._parameters["RTL_RETURN_ALT"]
        # Within the cone around home it does not climb all the way.
        level = max(full, min(estimate.down - RETURN_CONE_M, home[2] - distance - RETURN_CONE_M))
        self.target_down = min(level, estimate.down)
        self.returning, self.return_level_reached = True, False
        return self.target_down

    def hold(self, estimate: Estimate, step_s: float) -> Setpoint:
        """LOITER: stay at, or fly to, the target."""
        self._horizontally(estimate, step_s)
        value = self._parameters
        up = (
            value["MPC_Z_V_AUTO_UP"]
            if estimate.height_above_ground_m > value["MPC_LAND_ALT1"]
            else value["MPC_TKO_SPEED"]
        )
        self._level(estimate.down, up, value["MPC_Z_V_AUTO_DN"], step_s)
        return self._setpoint(step_s)

    def take_off(self, estimate: Estimate, step_s: float) -> tuple[Setpoint, bool]:
        """TAKEOFF: straight up; also whether the altitude is reached."""
        self.target_north, self.target_east, self.target_down = self.takeoff_north, self.takeoff_east, self.takeoff_down
        ask = self.hold(estimate, step_s)
        return ask, abs(estimate.down - self.takeoff_down) < TAKEOFF_DONE_M

    def land(self, estimate: Estimate, step_s: float) -> Setpoint:
        """LAND: down at a speed that falls with the height above the ground."""
        value = self._parameters
        self._horizontally(estimate, step_s)
        height, low, high = estimate.height_above_ground_m, value["MPC_LAND_ALT2"], value["MPC_LAND_ALT1"]
        share = max(0.0, min(1.0, (height - low) / max(high - low, 1e-3)))
        speed = value["MPC_LAND_SPEED"] + share * (value["MPC_Z_V_AUTO_DN"] - value["MPC_LAND_SPEED"])
        if height < value["MPC_LAND_ALT3"]:
            speed = min(speed, value["MPC_LAND_CRWL"])
        self.path.advance_at_rate(speed, Limits(value["MPC_ACC_DOWN_MAX"], value["MPC_JERK_AUTO"]), step_s)
        return self._setpoint(step_s)

    def return_home(self, home: tuple[float, float, float], estimate: Estimate, step_s: float) -> tuple[Setpoint, bool]:
        """RTL: up to the return level, home, then land; also whether the landing has just begun."""
        if not self.returning:
            return self.land(estimate, step_s), False
        if not self.return_level_reached:
            self.return_level_reached = abs(estimate.down - self.target_down) < ARRIVED_M
        elif self.target_north != home[0] or self.target_east != home[1]:
            self.target_north, self.target_east = home[0], home[1]
        elif math.hypot(estimate.north - home[0], estimate.east - home[1]) < ARRIVED_M:
            self.returning = False
            return self.land(estimate, step_s), True
        return self.hold(estimate, step_s), False

    def _horizontally(self, estimate: Estimate, step_s: float) -> None:
        value = self._parameters
        cruise = self.cruise_mps if self.cruise_mps > 0.0 else value["MPC_XY_CRUISE"]
        self.path.advance_horizontally(
            (self.target_north, self.target_east),
            (estimate.north, estimate.east),
            min(cruise, value["MPC_XY_VEL_MAX"]),
            Limits(value["MPC_ACC_HOR"], value["MPC_JERK_AUTO"], value["MPC_XY_ERR_MAX"]),
            step_s,
        )

    def _level(self, vehicle_down: float, up_mps: float, down_mps: float, step_s: float) -> None:
        value = self._parameters
        acceleration = value["MPC_ACC_DOWN_MAX"] if self.target_down > self.path.down.x else value["MPC_ACC_UP_MAX"]
        limits = Limits(acceleration, value["MPC_JERK_AUTO"])
        self.path.advance_to_level(self.target_down, vehicle_down, (up_mps, down_mps), limits, step_s)

    def _setpoint(self, step_s: float) -> Setpoint:
        value = self._parameters
        if not math.isnan(self.target_yaw):
            rate, acceleration = math.radians(value["MPC_YAWRAUTO_MAX"]), math.radians(value["MPC_YAWRAUTO_ACC"])
            self.heading.advance(self.target_yaw, rate, acceleration, step_s)
        north, east, down = self.path.north, self.path.east, self.path.down
        return Setpoint(
            north.x,
            east.x,
            down.x,
            north.v,
            east.v,
            down.v,
            north.a,
            east.a,
            down.a,
            self.heading.yaw,
            self.heading.rate,
        )
