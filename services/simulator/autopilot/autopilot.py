"""The autopilot's state: armed or not, which mode, which failsafe; and from it the commands of the rotors."""

import math
from enum import IntEnum

from services.simulator.autopilot.attitude_control import AttitudeControl, attitude_for
from services.simulator.autopilot.guidance import Guidance
from services.simulator.autopilot.land_detector import LandDetector
from services.simulator.autopilot.mode import STICK_MODES, Mode
from services.simulator.autopilot.offboard import Offboard
from services.simulator.autopilot.parameters import Parameters
from services.simulator.autopilot.position_control import PositionControl
from services.simulator.autopilot.result import Result
from services.simulator.autopilot.setpoint import NAN, OffboardSetpoint, Setpoint
from services.simulator.autopilot.sticks import Sticks
from services.simulator.body import Motors
from services.simulator.estimator import Estimate

SLOW_STEPS = 5
"""The outer loops run at every fifth step: 50 Hz."""
POSITION_VALID_S = 3.4
"""Since boot: GLOBAL_POSITION_INT begins."""
HOME_VALID_S = 3.0
CAN_ARM_S = 4.3
STANDBY_S = 5.0
"""Since boot: system_status 3 and the pre-arm bit of SYS_STATUS."""
RAMP_DELAY_S = 0.4
"""Between the end of the spool-up and the beginning of the takeoff ramp."""
TAKEOFF_DETECTED_S = 0.85
"""After the end of the spool-up."""
RAMP_INTEGRAL_MPS2 = 5.0
"""The vertical integral at the beginning of the takeoff ramp: presses the vehicle down."""
GCS_TIMEOUT_LAG_S = 2.0
"""PX4 acts this much later than COM_DL_LOSS_T."""
BATTERY_EMPTY_S = 1500.0
"""Armed time from a full to an empty battery."""

OFF: Motors = (0.0, 0.0, 0.0, 0.0)
IDLE: Motors = (0.05, 0.05, 0.05, 0.05)


class Severity(IntEnum):
    """MAV_SEVERITY as far as it is used."""

    CRITICAL = 2
    WARNING = 4
    INFO = 6


class Failsafe(IntEnum):
    """Which failsafe is flown."""

    NONE = 0
    OFFBOARD_LOST = 1
    STICKS_LOST = 2
    GCS_LOST = 3


_OFFBOARD_LOSS_MODE = {4: Mode.LAND, 5: Mode.LOITER}
"""COM_OBL_RC_ACT; every other value means RTL where no pilot has sticks."""
_GCS_LOSS_MODE = {1: Mode.LOITER, 2: Mode.RTL, 3: Mode.LAND}
"""NAV_DLL_ACT."""


class Autopilot:
    """Decides and controls. Times are seconds since boot; positions are in the local frame (see `Estimate`)."""

    def __init__(self, parameters: Parameters, origin_altitude_amsl_m: float) -> None:
        self.parameters = parameters
        self.origin_altitude_amsl_m = origin_altitude_amsl_m
        self.now_s = 0.0
        self.armed = False
        self.intended = Mode.LOITER
        """The mode that the user asked for."""
        self.mode = Mode.LOITER
        """The mode that is flown; another one while a failsafe acts."""
        self.failsafe = Failsafe.NONE
        self.home: tuple[float, float, float] | None = None
        self.home_yaw_rad = 0.0
        self.home_version = 0
        self.texts: list[tuple[Severity, str]] = []
        """Messages for people since the last look; who sends them empties the list."""
        self.armed_total_s = 0.0
        self.gcs_heard_at_s = NAN
        self.guidance = Guidance(parameters)
        self.offboard = Offboard(parameters)
        self.sticks = Sticks(parameters)
        self.position_control = PositionControl(parameters)
        self.land_detector = LandDetector(parameters)
        self._attitude_control = AttitudeControl(parameters)
        self._last_armable = Mode.LOITER
        self._armed_at_s = self._landed_at_s = 0.0
        self._lift_wanted_at_s = NAN
        self._gcs_failsafe_at_s = NAN
        self._gcs_overridden = False
        self._steps = 0
        self._attitude = (1.0, 0.0, 0.0, 0.0)
        self._thrust = 0.0
        self._yaw_rate = 0.0
        self._motors = OFF

    @property
    def landed(self) -> bool:
        """What the land detector believes."""
        return self.land_detector.landed

    @property
    def can_arm(self) -> bool:
        """Whether the checks pass for the mode that is set."""
        return self.now_s >= CAN_ARM_S and self._armable(self.intended)

    @property
    def landing(self) -> bool:
        """Whether a mode brings it down (MAV_LANDED_STATE_LANDING)."""
        return self.mode is Mode.LAND or (self.mode is Mode.RTL and not self.guidance.returning)

    @property
    def battery_remaining(self) -> float:
        """Charge, 1 to 0.1."""
        return max(0.1, 1.0 - self.armed_total_s / BATTERY_EMPTY_S)

    @property
    def thrust(self) -> float:
        """Collective thrust commanded, 0 to 1."""
        return self._thrust

    @property
    def attitude_setpoint(self) -> tuple[float, float, float, float]:
        """Attitude commanded, w, x, y, z."""
        return self._attitude

    # -- what is asked of it ------------------------------------------------------------------------------------------

    def arm(self, estimate: Estimate) -> Result:
        """Start the motors if the checks pass."""
        if self.armed:
            return Result.ACCEPTED
        if not self.can_arm:
            self.say(Severity.CRITICAL, "Arming denied: Resolve system health failures first")
            return Result.TEMPORARILY_REJECTED
        self._start(estimate)
        self.say(Severity.INFO, "Armed by external command")
        return Result.ACCEPTED

    def start_airborne(self, estimate: Estimate, trim_ne_mps2: tuple[float, float]) -> None:
        """Be in the air, armed and holding; the trim is the acceleration that stands against the wind."""
        self._start(estimate)
        self.position_control.in_, self.position_control.ie = trim_ne_mps2
        self.land_detector.take_off()
        self._lift_wanted_at_s = self.now_s - 60.0
        self.guidance.begin(estimate)
        self.guidance.hold_here(estimate)
        self.texts.clear()

    def disarm(self, forced: bool) -> Result:
        """Stop the motors; in the air only if forced."""
        if self.armed and not self.landed and not forced:
            self.say(Severity.CRITICAL, "Disarming denied: not landed")
            return Result.TEMPORARILY_REJECTED
        if self.armed:
            self._stop("Disarmed by external command")
        return Result.ACCEPTED

    def request_mode(self, mode: Mode, estimate: Estimate) -> Result:
        """Change the mode on a user's or a pilot's demand."""
        if self.armed and not self._enterable(mode):
            return Result.TEMPORARILY_REJECTED
        self._override_gcs_failsafe()
        self.intended = mode
        if self._armable(mode):
            self._last_armable = mode
        if not (self.failsafe is Failsafe.OFFBOARD_LOST and mode is Mode.OFFBOARD):
            self.failsafe = Failsafe.NONE
            self._enter(mode, estimate)
        return Result.ACCEPTED

    def take_off(self, down_m: float, estimate: Estimate) -> Result:
        """Climb straight up to a level (down, local frame); NaN for MIS_TAKEOFF_ALT above here."""
        if math.isnan(down_m):
            height = self.parameters["MIS_TAKEOFF_ALT"]
            down_m = estimate.down - height
            self.say(Severity.INFO, f"Using default takeoff altitude: {height:.1f} m")
        guidance = self.guidance
        guidance.takeoff_north, guidance.takeoff_east, guidance.takeoff_down = estimate.north, estimate.east, down_m
        return self.request_mode(Mode.TAKEOFF, estimate)

    def reposition(
        self, target: tuple[float, float, float], yaw: float, speed_mps: float, change_mode: bool, estimate: Estimate
    ) -> Result:
        """Fly to a point (north, east, down) in LOITER; NaN keeps what was. Without effect on the ground."""
        if self.mode is not Mode.LOITER and not change_mode:
            return Result.DENIED
        if change_mode and (self.mode is not Mode.LOITER or self.failsafe):
            self.request_mode(Mode.LOITER, estimate)
        if self.armed and not self.landed:
            self.guidance.reposition(target, yaw, speed_mps, estimate)
        return Result.ACCEPTED

    def take_offboard_setpoint(self, setpoint: OffboardSetpoint) -> None:
        """A setpoint came over a link."""
        self.offboard.take(setpoint, self.now_s)

    def hear_gcs(self) -> None:
        """A heartbeat of a ground control station came."""
        if self._gcs_lost():
            self.say(Severity.INFO, "GCS connection regained")
        self.gcs_heard_at_s = self.now_s
        self._gcs_overridden = False

    def set_home(self, home: tuple[float, float, float], yaw_rad: float) -> None:
        """Move HOME."""
        self.home, self.home_yaw_rad = home, yaw_rad
        self.home_version += 1

    def say(self, severity: Severity, text: str) -> None:
        """Tell the people on the ground."""
        self.texts.append((severity, text + "\t"))

    # -- what it does ---------------------------------------------------------------------------------------------------

    def step(self, estimate: Estimate, step_s: float) -> Motors:
        """One step of everything: 0.004 s."""
        self.now_s += step_s
        self._steps += 1
        if self._steps >= SLOW_STEPS:
            self._steps = 0
            self._step_slowly(estimate, step_s * SLOW_STEPS)
        if not self.armed:
            return OFF
        if self._thrust <= 0.0:
            return IDLE
        return self._attitude_control.step(self._attitude, self._thrust, self._yaw_rate, estimate, step_s)

    def _step_slowly(self, estimate: Estimate, step_s: float) -> None:
        if self.home is None and self.now_s >= HOME_VALID_S:
            self._home_here(estimate)
        if not self.armed:
            self._thrust = 0.0
            return
        self.armed_total_s += step_s
        self._watch(estimate)
        since_spooled_s = self.now_s - self._armed_at_s - self.parameters["COM_SPOOLUP_TIME"]
        if self.landed:
            self._wait_on_ground(estimate, since_spooled_s)
        if self.armed and not self.landed:
            self._fly(estimate, step_s)

    def _wait_on_ground(self, estimate: Estimate, since_spooled_s: float) -> None:
        self._thrust = 0.0
        if self._landed_at_s > self._armed_at_s:
            if self.now_s - self._landed_at_s >= self.parameters["COM_DISARM_LAND"] >= 0.0:
                self._stop("Disarmed by landing")
            return
        if since_spooled_s < 0.0 or not self._lift_wanted(estimate):
            self._lift_wanted_at_s = NAN
            if self.now_s - self._armed_at_s > self.parameters["COM_DISARM_PRFLT"] >= 0.0:
                self._stop("Disarmed by auto preflight disarming")
            return
        if math.isnan(self._lift_wanted_at_s):
            self._lift_wanted_at_s = self.now_s
        if self.now_s - self._lift_wanted_at_s >= TAKEOFF_DETECTED_S:
            self.land_detector.take_off()
            self.say(Severity.INFO, "Takeoff detected")
            self._home_here(estimate)
            self.guidance.begin(estimate)
            self.position_control.reset(RAMP_INTEGRAL_MPS2)
            self._attitude_control.reset()

    def _fly(self, estimate: Estimate, step_s: float) -> None:
        ask = self._ask(estimate, step_s)
        control = self.position_control
        ramp_s = self.now_s - self._lift_wanted_at_s - RAMP_DELAY_S
        value = self.parameters
        ramp = value["MPC_TKO_SPEED"] / max(value["MPC_TKO_RAMP_T"], 0.1) * ramp_s
        control.step(ask, estimate, ramp if ramp_s < value["MPC_TKO_RAMP_T"] else math.inf, step_s)
        if self.land_detector.step(ask.vd, control.setpoint.ad, estimate, step_s):
            self.say(Severity.INFO, "Landing detected")
            self._landed_at_s = self.now_s
            self._home_here(estimate)
        if self.land_detector.contact or self.landed:
            self._thrust = 0.0
            control.reset()
            return
        yaw = self._held_yaw(estimate) if math.isnan(ask.yaw) else ask.yaw
        self._attitude, self._thrust = attitude_for(control.thrust, yaw)
        self._yaw_rate = ask.yaw_rate

    def _ask(self, estimate: Estimate, step_s: float) -> Setpoint:
        mode, guidance = self.mode, self.guidance
        if mode is Mode.OFFBOARD:
            return self._ask_offboard(estimate)
        if mode in STICK_MODES:
            return self.sticks.setpoint(estimate)
        if mode is Mode.TAKEOFF:
            ask, reached = guidance.take_off(estimate, step_s)
            if reached and estimate.height_above_ground_m > 0.5:
                self.intended = self.mode = self._last_armable = Mode.LOITER
            return ask
        if mode is Mode.LAND:
            return guidance.land(estimate, step_s)
        if mode is Mode.RTL:
            ask, landing = guidance.return_home(self.home or (0.0, 0.0, 0.0), estimate, step_s)
            if landing:
                self.say(Severity.INFO, "RTL: land at destination")
            return ask
        return guidance.hold(estimate, step_s)

    def _ask_offboard(self, estimate: Estimate) -> Setpoint:
        ask = self.offboard.setpoint()
        if not math.isnan(ask.yaw):
            self.guidance.heading.reset(ask.yaw)
        elif ask.yaw_rate:
            self.guidance.heading.reset(estimate.yaw)
        return ask

    def _held_yaw(self, estimate: Estimate) -> float:
        """Where no yaw is asked for, the nose stays where it was when the mode began."""
        heading = self.guidance.heading
        if self.mode in STICK_MODES and self.sticks.turning:
            heading.reset(estimate.yaw)
        return heading.yaw

    # -- modes and failsafes --------------------------------------------------------------------------------------------

    def _watch(self, estimate: Estimate) -> None:
        """Start, end or go on with a failsafe."""
        if self.landed:
            self.failsafe = Failsafe.NONE
            return
        if self.intended is Mode.OFFBOARD and not self.offboard.fresh(self.now_s):
            action = int(self.parameters["COM_OBL_RC_ACT"])
            self._begin_failsafe(Failsafe.OFFBOARD_LOST, _OFFBOARD_LOSS_MODE.get(action, Mode.RTL), estimate)
        elif self.intended in STICK_MODES and not self.sticks.fresh(self.now_s):
            self._begin_failsafe(Failsafe.STICKS_LOST, Mode.RTL, estimate)
        elif self._gcs_lost() and not self._gcs_overridden and self.parameters["NAV_DLL_ACT"] in _GCS_LOSS_MODE:
            self._act_on_gcs_loss(estimate)
        elif self.failsafe:
            self.failsafe = Failsafe.NONE
            self._enter(self.intended, estimate)

    def _begin_failsafe(self, failsafe: Failsafe, mode: Mode, estimate: Estimate) -> None:
        if self.failsafe is not failsafe:
            self.failsafe = failsafe
            self.say(Severity.CRITICAL, "Failsafe activated")
            self._enter(mode, estimate)

    def _act_on_gcs_loss(self, estimate: Estimate) -> None:
        delay_s = self.parameters["COM_FAIL_ACT_T"]
        if self.failsafe is not Failsafe.GCS_LOST:
            self.failsafe, self._gcs_failsafe_at_s = Failsafe.GCS_LOST, self.now_s
            self.say(Severity.INFO, "Connection to ground station lost")
            self.say(Severity.CRITICAL, f"Failsafe activated: entering Hold for {delay_s:.0f} seconds")
            self._enter(Mode.LOITER, estimate)
        action = _GCS_LOSS_MODE[int(self.parameters["NAV_DLL_ACT"])]
        if self.mode is not action and self.now_s - self._gcs_failsafe_at_s >= delay_s:
            self.say(Severity.CRITICAL, "Failsafe activated")
            self._enter(action, estimate)

    def _override_gcs_failsafe(self) -> None:
        """A user who commands takes the vehicle out of it, until the station is heard again."""
        if self.failsafe is Failsafe.GCS_LOST:
            self._gcs_overridden = True

    def _gcs_lost(self) -> bool:
        """Whether a station that was once heard is silent."""
        return self.now_s - self.gcs_heard_at_s > self.parameters["COM_DL_LOSS_T"] + GCS_TIMEOUT_LAG_S

    def _armable(self, mode: Mode) -> bool:
        if mode is Mode.OFFBOARD:
            return self.offboard.fresh(self.now_s)
        if mode in STICK_MODES:
            return self.sticks.fresh(self.now_s)
        return mode in (Mode.LOITER, Mode.TAKEOFF)

    def _enterable(self, mode: Mode) -> bool:
        """In the air: RTL and LAND are always allowed, MISSION and PRECLAND never (there is no mission, no target)."""
        return mode in (Mode.RTL, Mode.LAND) or self._armable(mode)

    def _enter(self, mode: Mode, estimate: Estimate) -> None:
        previous, self.mode = self.mode, mode
        if not self.armed or self.landed:
            return
        guidance = self.guidance
        if mode is Mode.OFFBOARD or mode in STICK_MODES:
            guidance.heading.reset(estimate.yaw)
            self.sticks.release()
            return
        if previous is Mode.OFFBOARD or previous in STICK_MODES:
            guidance.begin(estimate)
        if mode is Mode.RTL and self.home is not None:
            level = guidance.begin_return(self.home, estimate)
            above = self.home[2] - level
            self.say(
                Severity.INFO, f"RTL: start return at {self._altitude(level):.0f} m ({above:.0f} m above destination)"
            )
        elif mode in (Mode.LOITER, Mode.LAND) and previous is not mode:
            guidance.hold_here(estimate)
        if mode is Mode.LAND:
            self.say(Severity.INFO, "Landing at current position")

    def _altitude(self, down_m: float) -> float:
        return self.origin_altitude_amsl_m - down_m

    def _lift_wanted(self, estimate: Estimate) -> bool:
        if self.mode is Mode.TAKEOFF:
            return self.guidance.takeoff_down < estimate.down - 0.3
        if self.mode is Mode.OFFBOARD:
            return self.offboard.fresh(self.now_s) and self.offboard.lifts(estimate.down)
        return self.mode in STICK_MODES and self.sticks.lifts(self.now_s)

    def _home_here(self, estimate: Estimate) -> None:
        self.set_home((estimate.north, estimate.east, estimate.down), estimate.yaw)

    def _start(self, estimate: Estimate) -> None:
        self.armed = True
        self._armed_at_s, self._landed_at_s = self.now_s, -1.0
        self._lift_wanted_at_s = NAN
        self.mode = self.intended
        self.failsafe = Failsafe.NONE
        self._home_here(estimate)
        self.guidance.begin(estimate)
        self.position_control.reset()
        self._attitude_control.reset()

    def _stop(self, why: str) -> None:
        self.armed = False
        self._thrust = 0.0
        self.failsafe = Failsafe.NONE
        self.land_detector.land_at_once()
        self.say(Severity.INFO, why)
        if not self._armable(self.intended) and self.intended is not Mode.OFFBOARD:
            self.intended = self._last_armable
        if self.intended is Mode.TAKEOFF:
            self.intended = Mode.LOITER
        self.mode = self.intended
