"""What a phase does once every look around has been taken: the only place that sends what moves the vehicle."""

from collections.abc import Callable

from alight.geometry.local import moved_by_ned
from alight.geometry.rotation import euler_from_quaternion
from alight.runtime.clock import nanoseconds
from schemas.message import GlobalPosition, Vector3
from schemas.mission import Phase
from schemas.setpoint import Setpoint, SetpointKind
from schemas.settings.commander import CommanderSettings
from schemas.vehicle import FlightMode, LandedState
from services.commander import flight_commands as commands
from services.commander.command_queue import Command, Outcome, Result
from services.commander.glide import Aim, Glide, freshness_of
from services.commander.link import AutopilotLink
from services.commander.mode_authority import ModeAuthority
from services.commander.reposition import Reposition
from services.commander.setpoint_stream import SetpointStream
from services.commander.situation import Situation
from services.commander.transitions import ACTIVE

STREAM_BEFORE_OFFBOARD_S = 0.3
"""PX4 refuses OFFBOARD without a stream of setpoints; while another mode is flown, setpoints move nothing."""
ASK_AGAIN_NS = nanoseconds(1.0)
NOT_READY_PATIENCE_S = 10.0
"""After this it tries to arm even if the autopilot does not say that it is ready: its refusal names the reason."""
DISARM_AFTER_S = 6.0
"""Standing on the ground armed for this long, it is told to disarm; PX4 does it by itself after 2 s."""
TRIED_AGAIN = frozenset({Result.TEMPORARILY_REJECTED, Result.NO_ANSWER})
MAX_REFUSALS = 4


_STILL: Vector3 = (0.0, 0.0, 0.0)


class Execution:
    """The commander's hands. `begin` at the start of a phase, `act` at every step of it."""

    def __init__(self, settings: CommanderSettings, link: AutopilotLink, authority: ModeAuthority) -> None:
        self._settings = settings
        self._link = link
        self._authority = authority
        self.stream = SetpointStream(settings.glide.setpoint_period_s)
        self.refusal: Outcome | None = None
        """The command that was refused for good in this phase."""
        self.climbing_asked = False
        self.start: GlobalPosition | None = None
        """Where the landing shall start; None if nobody named a place."""
        self.start_ned_m: Vector3 | None = None
        self._glide: Glide | None = None
        self._reposition: Reposition | None = None
        self._refusals = 0
        self._asked_ns = 0
        self._ending = False
        self._ground_ns: int | None = None
        self._landing_mode = False
        self._mode_accepted = False
        self._standing: tuple[GlobalPosition, float] | None = None
        """Where the last setpoint was, and its yaw (NED, rad): there a vehicle stands that still flies OFFBOARD."""
        self._climb_to_amsl_m: float | None = None
        self._acts: dict[Phase, Callable[[Situation, bool], Setpoint | None]] = {
            Phase.TAKEOFF: self._climb,
            Phase.TRANSIT: self._fly_on,
            Phase.ACQUIRE: self._keep_holding,
            Phase.HOLD: self._keep_holding,
            Phase.DESCEND: self._descend,
            Phase.TOUCHDOWN: self._touch_down,
            Phase.ABORTED: self._end,
            Phase.FAILED: self._end,
        }

    def begin(self, phase: Phase, before: Phase, code: str, s: Situation) -> None:
        """Start a phase. What was under way for the last one is called back first."""
        self._link.recall_flight_commands()
        self.refusal, self._refusals, self._asked_ns = None, 0, 0
        self._ending = self._mode_accepted = False
        if phase not in ACTIVE or before not in ACTIVE:
            self._authority.release()
        if before not in ACTIVE:
            self._standing = None  # of an old flight; who knows where that was
        if phase is Phase.TAKEOFF:
            self._prepare_takeoff(s)
        elif phase is Phase.TRANSIT:
            self._fly_to_start(s)
        elif phase is Phase.DESCEND:
            self._begin_descent(s)
        elif phase is Phase.TOUCHDOWN and self._glide is not None:
            self._glide.touch_down()
        elif _ends_in_hold(phase, before) and code != "at_start" and not s.rebooted:
            self._ending = phase not in ACTIVE
            self._hold(before, s)
        if phase is Phase.LANDED and s.status.mode is not FlightMode.HOLD and not s.deaf:
            # Out of OFFBOARD or LAND, in which PX4 would not arm again.
            self._link.command(commands.set_mode(FlightMode.HOLD), s.now_ns)

    def act(self, s: Situation, fresh: bool) -> Setpoint | None:
        """Do what the phase asks for now.

        Args:
            s: The situation; no transition follows from it.
            fresh: Whether a new estimate has just come.

        Returns:
            The setpoint that was sent, to be published; None if none was.
        """
        act = self._acts.get(s.phase)
        return None if act is None else act(s, fresh)

    def take_outcome(self, outcome: Outcome) -> None:
        """Take what became of a command. ACCEPTED is not done: what is flown is seen in the mode."""
        repositions = outcome.command.id == commands.REPOSITION
        if outcome.result is Result.ACCEPTED or (repositions and outcome.result is Result.UNSUPPORTED):
            # PX4 before June 2026 answers UNSUPPORTED to a reposition without a change of mode, and flies it all the same.
            self._refusals = 0
            self._mode_accepted = self._mode_accepted or outcome.command.id == commands.SET_MODE
            return
        self._refusals += 1
        arming = outcome.command.id == commands.ARM_DISARM
        if outcome.result in TRIED_AGAIN and (arming or self._refusals < MAX_REFUSALS):
            return
        self.refusal = outcome

    def funnel_closed_for_s(self, now_ns: int) -> float:
        """For how long `glide` has not been allowed to go down, seconds."""
        return 0.0 if self._glide is None else self._glide.closed_for_s(now_ns)

    def displace(self, jump_ned_m: Vector3) -> None:
        """The navigation solution has jumped by so much: what is flown to stays where it was and is called otherwise."""
        if self._glide is not None:
            self._glide.displace(jump_ned_m)
        if self._standing is not None:
            self._standing = (moved_by_ned(self._standing[0], jump_ned_m), self._standing[1])

    def climb_left_m(self, position: GlobalPosition) -> float | None:
        """How far a place is below the height of the takeoff, metres; None without one."""
        return None if self._climb_to_amsl_m is None else self._climb_to_amsl_m - position.altitude_amsl_m

    def leave_holding(self, s: Situation) -> None:
        """The last words of a process that ends in flight."""
        self._link.recall_flight_commands()
        self._hold(s.phase, s)

    # Takeoff and transit -------------------------------------------------------------------------------------------

    def _prepare_takeoff(self, s: Situation) -> None:
        assert s.state is not None
        self.climbing_asked = False
        takeoff_point = s.state.position
        self.start = None if self.start_ned_m is None else moved_by_ned(takeoff_point, self.start_ned_m)
        height_m = self._settings.takeoff_height_m if self.start_ned_m is None else -self.start_ned_m[2]
        self._climb_to_amsl_m = takeoff_point.altitude_amsl_m + height_m

    def _climb(self, s: Situation, _: bool) -> None:
        if s.deaf:
            return
        if s.status.armed:
            if (not self.climbing_asked or self._lost(commands.TAKEOFF, s)) and self._climb_to_amsl_m is not None:
                self.climbing_asked, self._asked_ns = True, s.now_ns
                self._ask(FlightMode.TAKEOFF, commands.takeoff(self._climb_to_amsl_m), s)
        elif s.now_ns - self._asked_ns >= ASK_AGAIN_NS and not s.was_armed:
            self._asked_ns = s.now_ns
            if s.status.mode is not FlightMode.HOLD:
                self._ask(FlightMode.HOLD, commands.set_mode(FlightMode.HOLD), s)
            elif s.status.ready_to_arm or s.phase_age_s > NOT_READY_PATIENCE_S:
                self._link.command(commands.arm(), s.now_ns)

    def _fly_on(self, s: Situation, _: bool) -> None:
        if self._lost(commands.REPOSITION, s):
            self._fly_to_start(s)

    def _lost(self, command_id: int, s: Situation) -> bool:
        """Whether the phase's command was not answered, or put off, a while ago, so that it has to be sent anew."""
        return (
            self._refusals > 0 and not self._link.is_waiting(command_id) and s.now_ns - self._asked_ns >= ASK_AGAIN_NS
        )

    def _fly_to_start(self, s: Situation) -> None:
        if self.start is not None:
            self._asked_ns = s.now_ns
            self._ask(FlightMode.HOLD, commands.reposition(self.start, _yaw_of(s)), s)

    # Holding -------------------------------------------------------------------------------------------------------

    def _hold(self, before: Phase, s: Situation) -> None:
        """Let the autopilot hold by its own HOLD mode: it goes on holding if this process or the link dies now."""
        if not s.airborne and not (s.status.armed and s.status.mode is FlightMode.OFFBOARD):
            if before is Phase.TAKEOFF and (s.status.armed or not s.was_armed):
                self._stay_down(s)
            return
        self._asked_ns = s.now_ns
        if s.status.mode is not FlightMode.HOLD:
            self._ask(FlightMode.HOLD, commands.set_mode(FlightMode.HOLD), s)
            return
        self._authority.adopt(FlightMode.HOLD)
        if before in (Phase.TRANSIT, Phase.DESCEND, Phase.TOUCHDOWN) and s.state is not None:
            # In HOLD already, but under way to the last place that it was sent to.
            self._link.command(commands.reposition(s.state.position, None), s.now_ns)

    def _stay_down(self, s: Situation) -> None:
        """Call back a takeoff before it lifts off: it spools up for seconds after its command, and is not to climb any more.

        In the very moment of the lift-off the autopilot refuses to disarm; then HOLD stops it.
        """
        late = (FlightMode.TAKEOFF,) if self.climbing_asked else ()
        self._ask(FlightMode.HOLD, commands.set_mode(FlightMode.HOLD), s, late)
        self._link.command(commands.disarm(), s.now_ns)

    def _end(self, s: Situation, fresh: bool) -> None:
        """See to it that the hold with which a mission ends is flown, unless somebody else has chosen a mode since."""
        if not self._ending:
            return
        if s.mode_taken or s.status.failsafe or s.phase_age_s > self._settings.mode_patience_s:
            self._ending = False
            self._link.recall_flight_commands()
            self._authority.release()
        else:
            self._keep_holding(s, fresh)

    def _keep_holding(self, s: Situation, _: bool) -> None:
        if s.mode_overdue_s is None:
            return
        if s.status.mode is FlightMode.OFFBOARD:
            self._stand(s)
        if s.now_ns - self._asked_ns >= ASK_AGAIN_NS and not s.deaf:
            self._asked_ns = s.now_ns
            if not self._link.is_waiting(commands.SET_MODE):
                self._link.command(commands.set_mode(FlightMode.HOLD), s.now_ns)

    def _stand(self, s: Situation) -> None:
        """Go on with setpoints until HOLD is flown: without them PX4 does after a second what it is set to, a return by default."""
        if self._standing is None and s.state is not None:
            self._standing = (s.state.position, _yaw_of(s))
        if self._standing is None or not self.stream.is_due(s.now_ns):
            return
        position, yaw_rad = self._standing
        self._link.send_setpoint(commands.position_target(position, _STILL, _STILL, yaw_rad))
        self.stream.sent(s.now_ns)

    # Descent -------------------------------------------------------------------------------------------------------

    def _begin_descent(self, s: Situation) -> None:
        assert s.state is not None
        self.stream.begin()
        self._landing_mode, self._ground_ns = False, None
        self._glide = self._reposition = self._standing = None
        if self._settings.guidance == "glide":
            self._glide = Glide(self._settings.glide, s.state.position, _yaw_of(s), s.now_ns)
            self._aim(s)
        else:
            self._reposition = Reposition(self._settings.reposition)

    def _descend(self, s: Situation, fresh: bool) -> Setpoint | None:
        if self._glide is None:
            return self._step_down(s, fresh)
        if s.status.mode is not FlightMode.OFFBOARD:
            self._enter_offboard(s)
        return self._send_glide(s, fresh)

    def _enter_offboard(self, s: Situation) -> None:
        waited = s.phase_age_s >= STREAM_BEFORE_OFFBOARD_S and s.now_ns - self._asked_ns >= ASK_AGAIN_NS // 2
        # Once it is accepted, another mode is somebody's choice.
        if waited and not (s.deaf or self._mode_accepted or self._link.is_waiting(commands.SET_MODE)):
            self._asked_ns = s.now_ns
            self._ask(FlightMode.OFFBOARD, commands.set_mode(FlightMode.OFFBOARD), s)

    def _send_glide(self, s: Situation, fresh: bool) -> Setpoint | None:
        assert self._glide is not None
        if s.state is None or s.estimate is None:
            self._stand(s)
            return None
        if not (fresh or self.stream.is_due(s.now_ns)):
            return None
        self._aim(s)
        freshness = 0.0 if s.deaf else freshness_of(s.estimate_age_s or 0.0, s.stale_after_s)
        flown = s.status.mode is FlightMode.OFFBOARD
        target = self._glide.advance(s.state, freshness, flown, s.now_ns)
        velocity, acceleration, yaw = target.velocity_ned_mps, target.acceleration_ned_mps2, target.yaw_ned_rad
        self._link.send_setpoint(commands.position_target(target.position, velocity, acceleration, yaw))
        self.stream.sent(s.now_ns)
        self._standing = (target.position, yaw)
        return _setpoint(SetpointKind.OFFBOARD, target.position, s, fresh, yaw=yaw, velocity=velocity)

    def _aim(self, s: Situation) -> None:
        assert self._glide is not None and s.pad is not None
        azimuth_rad = s.pad.azimuth_rad if self._settings.align_yaw else None
        self._glide.aim(Aim(s.pad.position, azimuth_rad, s.pad.sigma_m, s.pad.drift_ned_mps))

    def _step_down(self, s: Situation, fresh: bool) -> Setpoint | None:
        assert self._reposition is not None
        if s.deaf or not fresh or not self._reposition.is_due(s.now_ns) or self._link.is_waiting(commands.REPOSITION):
            return None
        if s.state is None or s.pad is None or s.height_above_pad_m is None:
            return None
        altitude_m = s.state.position.altitude_amsl_m
        target = self._reposition.target(s.pad.position, altitude_m, s.height_above_pad_m, s.now_ns)
        if target is None:
            return None
        yaw_rad = s.pad.azimuth_rad if self._settings.align_yaw else _yaw_of(s)
        self._ask(FlightMode.HOLD, commands.reposition(target, yaw_rad), s)
        return _setpoint(SetpointKind.REPOSITION, target, s, fresh, yaw=yaw_rad)

    # Touchdown -----------------------------------------------------------------------------------------------------

    def _touch_down(self, s: Situation, fresh: bool) -> Setpoint | None:
        if not s.deaf:
            self._disarm_on_ground(s)
            if self._must_land_by_mode(s):
                self._land_by_mode(s)
        # Also while the landing mode is awaited: see `_stand`.
        offboard = self._glide is not None and s.status.mode is FlightMode.OFFBOARD
        return self._send_glide(s, fresh) if offboard else None

    def _must_land_by_mode(self, s: Situation) -> bool:
        blind = s.state_age_s is None or abs(s.state_age_s) > self._settings.state_stale_after_s
        overdue = s.phase_age_s > self._settings.touchdown_patience_s
        return self._landing_mode or self._glide is None or self._settings.touchdown == "land" or blind or overdue

    def _land_by_mode(self, s: Situation) -> None:
        self._landing_mode = True
        on_ground = s.status.landed_state is LandedState.ON_GROUND
        if s.status.mode is FlightMode.LAND or on_ground or self._link.is_waiting(commands.LAND):
            return
        if s.now_ns - self._asked_ns >= ASK_AGAIN_NS:
            self._asked_ns = s.now_ns
            self._ask(FlightMode.LAND, commands.land_here(), s)

    def _disarm_on_ground(self, s: Situation) -> None:
        if s.status.landed_state is not LandedState.ON_GROUND:
            self._ground_ns = None
        elif self._ground_ns is None:
            self._ground_ns = s.now_ns
        elif s.now_ns - self._ground_ns > nanoseconds(DISARM_AFTER_S):
            self._ground_ns = s.now_ns
            self._link.command(commands.disarm(), s.now_ns)

    def _ask(self, mode: FlightMode, command: Command, s: Situation, late: tuple[FlightMode, ...] = ()) -> None:
        self._authority.ask(mode, s.status, s.now_ns, late)
        self._link.command(command, s.now_ns)


def _ends_in_hold(phase: Phase, before: Phase) -> bool:
    """Whether a phase begins with telling the vehicle to hold: only where the commander commands, or did until now."""
    return phase in (Phase.ACQUIRE, Phase.HOLD) or (phase in (Phase.ABORTED, Phase.FAILED) and before in ACTIVE)


def _yaw_of(s: Situation) -> float:
    return 0.0 if s.state is None else euler_from_quaternion(s.state.q_ned_body)[2]


def _setpoint(
    kind: SetpointKind,
    position: GlobalPosition,
    s: Situation,
    fresh: bool,
    *,
    yaw: float,
    velocity: Vector3 | None = None,
) -> Setpoint:
    assert s.estimate is not None
    return Setpoint(
        captured_at_ns=s.estimate.captured_at_ns,
        hops=s.estimate.hops,
        kind=kind,
        sent_at_ns=s.now_ns,
        fresh=fresh,
        position=position,
        yaw_ned_rad=yaw,
        velocity_ned_mps=velocity,
        reason=s.phase,
    )
