"""What may be asked when: judged before it reaches the state machine, refused with a reason."""

from collections.abc import Mapping

from alight.runtime.clock import seconds
from schemas.mission import MissionRequest, Phase, Verb
from schemas.vehicle import FlightMode
from services.commander.conditions import link_lost, vehicle_state_stale
from services.commander.parameters import forbids_offboard
from services.commander.situation import Situation
from services.commander.transitions import ACTIVE

MAX_START_DISTANCE_M = 500.0
MIN_START_HEIGHT_M = 1.5


def refusal(request: MissionRequest, s: Situation, parameters: Mapping[str, float]) -> str | None:
    """Why a request is not carried out; None if it is."""
    age_s = seconds(s.now_ns - request.at_ns)
    if age_s > s.settings.request_max_age_s:
        return f"the request is {age_s:.1f} s old, limit {s.settings.request_max_age_s:g} s"
    if request.verb is Verb.ABORT:
        return None
    blind = link_lost(s) or vehicle_state_stale(s)
    if blind is not None:
        return blind
    if request.verb is Verb.TAKEOFF:
        return _refuse_takeoff(request, s)
    return _refuse_in_flight(request.verb, s, parameters)


def _refuse_in_flight(verb: Verb, s: Situation, parameters: Mapping[str, float]) -> str | None:
    if not s.airborne:
        return f"the vehicle is not in the air (armed: {s.status.armed}, landed state {s.status.landed_state})"
    if verb is Verb.LAND:
        return _refuse_landing(s, parameters)
    return f"the autopilot flies a failsafe ({s.status.mode})" if s.failsafe_active else None


def _refuse_takeoff(request: MissionRequest, s: Situation) -> str | None:
    if s.status.armed:
        return "the vehicle is armed already"
    if s.phase in ACTIVE:
        return f"the commander is busy ({s.phase})"
    if s.status.home is None:
        return "the autopilot has no home position yet"
    if request.start_ned_m is not None:
        north, east, down = request.start_ned_m
        if max(abs(north), abs(east), abs(down)) > MAX_START_DISTANCE_M or down > -MIN_START_HEIGHT_M:
            return (
                f"the start point ({north:g}, {east:g}, {down:g}) m is too far away (over {MAX_START_DISTANCE_M:g} m) "
                f"or too low (under {MIN_START_HEIGHT_M:g} m)"
            )
    return _low_battery(s)


def _refuse_landing(s: Situation, parameters: Mapping[str, float]) -> str | None:
    if s.status.home is None:
        return "the autopilot has no home position"
    if s.phase in (Phase.TAKEOFF, Phase.TRANSIT):
        return f"the commander is busy ({s.phase})"
    if s.failsafe_active and not may_recover(s):
        return f"the autopilot flies a failsafe ({s.status.mode}, intended {s.status.intended_mode})"
    if s.settings.guidance == "glide" and (forbidden := forbids_offboard(parameters)) is not None:
        return forbidden
    return _low_battery(s) if s.failsafe_active else None


def may_recover(s: Situation) -> bool:
    """Whether a failsafe is the one for want of setpoints, which whoever asks for a landing may end.

    PX4 then still intends OFFBOARD. So it does in any other failsafe that interrupts our setpoints; that one is told apart by having
    come while they were being sent, which ends in the phase YIELDED for `autopilot_failsafe`.
    """
    return s.status.intended_mode is FlightMode.OFFBOARD and not (
        s.phase is Phase.YIELDED and s.code == "autopilot_failsafe"
    )


def _low_battery(s: Situation) -> str | None:
    battery = s.status.battery_remaining
    if battery is None or battery >= s.settings.min_battery:
        return None
    return f"battery at {100 * battery:.0f} %, limit {100 * s.settings.min_battery:.0f} %"
