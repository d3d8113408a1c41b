"""Drives the state machine: looks around, takes at most one transition, then lets the phase act."""

import math
from collections import OrderedDict

from alight.geometry.local_frame import LocalFrame
from alight.geometry.solution_jump import solution_jump_ned_m
from alight.runtime.clock import seconds
from schemas.estimate import PadEstimate
from schemas.message import Vector3
from schemas.mission import GIVEN_UP, MissionReply, MissionRequest, MissionStatus, Phase, Verb
from schemas.setpoint import Setpoint
from schemas.settings.commander import CommanderSettings
from schemas.vehicle import FlightMode, LandedState, VehicleState, VehicleStatus
from services.commander.carried_pad import CarriedPad, believed_drift_sigma_mps, carried
from services.commander.dialect import mavlink
from services.commander.estimate_gate import EstimateGate, Verdict
from services.commander.execution import Execution
from services.commander.link import AutopilotLink
from services.commander.mode_authority import ModeAuthority
from services.commander.requests import may_recover, refusal
from services.commander.situation import Situation
from services.commander.transitions import ACTIVE, RESUMED, STREAMING, Transition, asked_code, first_transition

REMEMBERED_REPLIES = 256


class Mission:
    """The commander's mind. It commands only what its phase allows, and its phase follows from the table alone."""

    def __init__(self, settings: CommanderSettings, link: AutopilotLink) -> None:
        self._settings = settings
        self._link = link
        self._authority = ModeAuthority()
        self._hands = Execution(settings, link, self._authority)
        self.gate = EstimateGate(settings.gate)
        self.phase = Phase.IDLE
        self.code = "started"
        self.reason = "the commander has started"
        self.since_ns: int | None = None
        self._state: VehicleState | None = None
        self._frame: LocalFrame | None = None
        self._replies: OrderedDict[str, MissionReply] = OrderedDict()
        self._request: MissionRequest | None = None
        self._asked: Verb | None = None
        self._landing = False
        self.has_looked = False
        """Whether the vehicle was known well enough, once, to tell a start in flight."""
        self._reboots = 0
        self._stood_still_ns = 0
        self._clock_restarts = 0
        self._was_armed = False
        self._recovering = False
        self._holds = 0

    def take_state(self, state: VehicleState) -> None:
        """Take a vehicle state; where the navigation solution has jumped to it, the pad and the setpoint go along."""
        jump_ned_m = self._jump_to(state)
        if jump_ned_m is not None:
            assert self._state is not None, "what jumps was somewhere before"
            self.gate.displace(jump_ned_m, self._state.at_ns, state.at_ns)
            self._hands.displace(jump_ned_m)
        self._state, self._frame = state, None

    def _jump_to(self, state: VehicleState) -> Vector3 | None:
        before, here = self._state, self._here()
        clock_restarts, self._clock_restarts = self._clock_restarts, self._link.clock.restarts
        if before is None or here is None or clock_restarts != self._link.clock.restarts:
            return None  # where a clock was set between two states, nobody knows how long the vehicle flew
        jump_ned_m = solution_jump_ned_m(
            before, state, here.ned_of(state.position), self._settings.gate.solution_jump_m
        )
        # One that would lead out of the pad's reach is no reset of an estimator, and nothing that is near the pad is left then.
        return (
            None if jump_ned_m is None or math.hypot(*jump_ned_m) > self._settings.gate.max_distance_m else jump_ned_m
        )

    def take_estimate(self, estimate: PadEstimate, now_ns: int) -> Setpoint | None:
        """Take an estimate; a setpoint that follows from it goes out at once."""
        accepted = self.gate.offer(estimate, self._here()) is Verdict.ACCEPTED
        if estimate.velocity_ned_mps is not None and believed_drift_sigma_mps(estimate, self._settings.carry) is None:
            self.gate.counts["drifts_not_believed"] += 1
        return self.step(now_ns, fresh=accepted)

    def take_request(self, request: MissionRequest, now_ns: int) -> None:
        """Judge a request, for the next step to carry out. One that was answered before is not judged again."""
        if request.request_id in self._replies:
            return
        situation = self.look(now_ns)
        why_not = refusal(request, situation, self._link.parameters)
        reply = MissionReply(
            at_ns=now_ns,
            request_id=request.request_id,
            accepted=why_not is None,
            reason=why_not or self._accept(request, situation),
        )
        self._replies[request.request_id] = reply
        while len(self._replies) > REMEMBERED_REPLIES:
            self._replies.popitem(last=False)

    def reply_to(self, request: MissionRequest, now_ns: int) -> MissionReply:
        """What became of a request that was taken, after the step that followed; the same for as long as it is remembered."""
        return self._replies[request.request_id].model_copy(update={"at_ns": now_ns})

    def step(self, now_ns: int, fresh: bool = False) -> Setpoint | None:
        """Look, decide, act.

        Args:
            now_ns: The time, UTC ns.
            fresh: Whether a new estimate has just been accepted.

        Returns:
            The setpoint that was sent, if any.
        """
        if self.since_ns is None:
            self.since_ns = now_ns
        # A phase loses no patience by the time that went by without this process, or by a clock that is set.
        self.since_ns += self._link.stood_still_ns - self._stood_still_ns
        self._stood_still_ns = self._link.stood_still_ns
        self._forget_the_future(now_ns)
        status = self._link.status(now_ns)
        self._authority.look(status)
        self._was_armed = self._was_armed or status.armed
        for outcome in self._link.take_outcomes():
            self._hands.take_outcome(outcome)
        situation = self._look(now_ns, status)
        self.has_looked = self.has_looked or situation.first_look
        if self.phase is Phase.ACQUIRE and status.mode is FlightMode.HOLD and not situation.failsafe_active:
            self._recovering = False
        step = first_transition(situation)
        asked, self._asked = self._asked, None
        if step is not None:
            self._change(*step, situation)
            if asked is not None and step[0].code != asked_code(asked):
                self._withdraw(situation.now_ns)
            situation = self.look(now_ns)
        return self._hands.act(situation, fresh)

    def _forget_the_future(self, now_ns: int) -> None:
        """After a clock was set back, the last estimate would seem fresh for long. The touchdown goes where it was aimed, whatever comes."""
        newest = self.gate.newest
        if newest is None or self.phase is Phase.TOUCHDOWN:
            return
        if seconds(newest.captured_at_ns - now_ns) > self._settings.state_stale_after_s:
            self.gate.forget()

    def look(self, now_ns: int) -> Situation:
        """The situation as of now."""
        return self._look(now_ns, self._link.status(now_ns))

    def _look(self, now_ns: int, status: VehicleStatus) -> Situation:
        state, estimate, pad = self._state, self.gate.newest, self._pad(now_ns)
        height_m, distance_m = _above_and_beside(self._here(), pad)
        deaf_for_s = self._link.deaf_for_s(now_ns)
        known = deaf_for_s is None and state is not None and status.landed_state is not LandedState.UNDEFINED
        on_ground = status.landed_state is LandedState.ON_GROUND
        phase_age_s = seconds(now_ns - (self.since_ns or now_ns))
        situation = Situation(
            now_ns=now_ns,
            settings=self._settings,
            phase=self.phase,
            code=self.code,
            phase_age_s=phase_age_s,
            link_silence_s=self._link.silence_s(now_ns),
            deaf_for_s=deaf_for_s,
            status=status,
            state=state,
            state_age_s=None if state is None else seconds(now_ns - state.at_ns),
            estimate=estimate,
            pad=pad,
            estimate_age_s=None if estimate is None else seconds(now_ns - estimate.captured_at_ns),
            estimates_good_for_s=seconds(self.gate.good_for_ns()),
            height_above_pad_m=height_m,
            distance_to_pad_m=distance_m,
            distance_to_start_m=self._distance_to_start_m(),
            asked=self._asked,
            landing=self._landing,
            first_look=not self.has_looked and status.connected and known and status.mode is not FlightMode.UNKNOWN,
            rebooted=self._link.reboots > self._reboots,
            was_armed=self._was_armed,
            climbing_asked=self._hands.climbing_asked,
            climb_left_m=None if state is None else self._hands.climb_left_m(state.position),
            # PX4 leaves LAND by itself when it disarms, up to a second before it says that it is disarmed.
            mode_taken=self._authority.taken(status) and not (self.phase is Phase.TOUCHDOWN and on_ground),
            expected_modes=self._authority.expected,
            mode_overdue_s=self._authority.overdue_s(now_ns),
            refusal=self._hands.refusal,
            setpoint_gap_s=self._hands.stream.longest_pause_s(now_ns) if self.phase in STREAMING else 0.0,
            funnel_closed_for_s=self._hands.funnel_closed_for_s(now_ns),
            holds=self._holds,
        )
        patient = phase_age_s <= self._settings.mode_patience_s
        if self._recovering and self.phase is Phase.ACQUIRE and situation.failsafe_active and patient:
            return situation._replace(recovering=True)
        return situation

    def status(self, at_ns: int) -> MissionStatus:
        """What is being done and why."""
        height_m, distance_m = _above_and_beside(self._here(), self._pad(at_ns))
        newest = self.gate.newest
        return MissionStatus(
            at_ns=at_ns,
            phase=self.phase,
            phase_since_ns=self.since_ns or at_ns,
            reason=self.reason,
            code=self.code,
            guidance=self._settings.guidance,
            height_above_pad_m=height_m,
            distance_to_pad_m=distance_m,
            estimate_age_s=None if newest is None else seconds(at_ns - newest.captured_at_ns),
            request_id="" if self._request is None else self._request.request_id,
        )

    def last_words(self, now_ns: int) -> None:
        """The process ends: in a phase that commands, leave the vehicle holding."""
        situation = self.look(now_ns)
        overridden = situation.mode_taken or situation.failsafe_active or situation.deaf
        if self.phase in ACTIVE and not overridden:
            self._hands.leave_holding(situation)

    def _accept(self, request: MissionRequest, situation: Situation) -> str:
        if request.verb is Verb.LAND and self._landing and self.phase in ACTIVE:
            return f"already landing ({self.phase})"
        if request.verb is Verb.ABORT and self.phase not in ACTIVE:
            return f"nothing to abort ({self.phase})"
        self._asked, self._request = request.verb, request
        self._landing = request.verb is Verb.LAND
        if request.verb is Verb.TAKEOFF:
            self._hands.start_ned_m = request.start_ned_m
        if request.verb is Verb.LAND:
            self.gate.forget()
            self._holds = 0
            self._recovering = may_recover(situation)
        return f"{request.verb}: {request.reason}" if request.reason else str(request.verb)

    def _withdraw(self, now_ns: int) -> None:
        """What was accepted a moment ago does not happen: something that comes before requests came in the same moment."""
        assert self._request is not None, "a request waited"
        request_id, self._request = self._request.request_id, None
        self._replies[request_id] = MissionReply(
            at_ns=now_ns, request_id=request_id, accepted=False, reason=f"{self.phase}: {self.reason}"[:500]
        )

    def _change(self, row: Transition, reason: str, situation: Situation) -> None:
        before, self.phase = self.phase, row.next
        self.code, self.reason, self.since_ns = row.code, reason[:500], situation.now_ns
        self._reboots = self._link.reboots
        self._was_armed = situation.status.armed
        if row.next is Phase.HOLD and row.code in RESUMED and self._landing:
            self._holds += 1
        elif row.next not in ACTIVE or row.next is Phase.HOLD:
            self._landing = False
        self._hands.begin(row.next, before, row.code, situation)
        severity = mavlink.MAV_SEVERITY_WARNING if row.next in GIVEN_UP else mavlink.MAV_SEVERITY_INFO
        self._link.say(f"{row.next}: {row.code}", severity)

    def _pad(self, now_ns: int) -> CarriedPad | None:
        newest = self.gate.newest
        return None if newest is None else carried(newest, self._settings.carry, now_ns)

    def _distance_to_start_m(self) -> float | None:
        start, here = self._hands.start, self._here()
        if start is None or here is None:
            return None
        n, e, d = here.ned_of(start)
        return float((n * n + e * e + d * d) ** 0.5)

    def _here(self) -> LocalFrame | None:
        """The frame where the vehicle is, made when it is first asked for: most states come between two estimates."""
        if self._frame is None and self._state is not None:
            self._frame = LocalFrame(self._state.position)
        return self._frame


def _above_and_beside(here: LocalFrame | None, pad: CarriedPad | None) -> tuple[float | None, float | None]:
    """Height above the estimated pad and horizontal distance to it, metres."""
    if here is None or pad is None:
        return None, None
    north, east, down = here.ned_of(pad.position)
    return down, float((north * north + east * east) ** 0.5)
