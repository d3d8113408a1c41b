"""The conditions of the transition table: each looks at a situation and returns why it holds, in words with numbers, or None."""

from collections.abc import Callable

from schemas.mission import Phase, Verb
from schemas.vehicle import FlightMode, LandedState
from services.commander.glide import funnel_radius_m
from services.commander.situation import Situation

Condition = Callable[[Situation], str | None]

AT_START_M = 0.5
AT_START_MPS = 0.3
ALTITUDE_REACHED_M = 1.5
"""PX4 ends its takeoff up to NAV_MC_ALT_RAD (0.8 m) below the height that was asked for, and its position is heard later than its mode."""
SETPOINT_GAP_S = 0.8
"""PX4 waits 1.0 s for a setpoint (COM_OF_LOSS_T); its samples and ours differ by a little."""
DEAF_TIMEOUTS = 2.0
"""So many times the link's timeout it may be unknown who flies, while something is heard now and then."""
FRESH_PART = 0.5
"""An estimate younger than this part of the staleness limit ends a hold."""


# The vehicle and the link ------------------------------------------------------------------------------------------


def link_lost(s: Situation) -> str | None:
    """Nothing comes from the autopilot any more."""
    if s.link_silence_s is None or not s.status.connected:
        return "no heartbeat of the autopilot"
    if s.link_silence_s > s.settings.link.timeout_s:
        return f"nothing from the autopilot for {s.link_silence_s:.1f} s"
    if s.deaf_for_s is not None and s.deaf_for_s > DEAF_TIMEOUTS * s.settings.link.timeout_s:
        return f"the autopilot has not been heard to name its mode for {s.deaf_for_s:.1f} s"
    return None


def autopilot_rebooted(s: Situation) -> str | None:
    """Its time since boot ran backwards."""
    return "the autopilot has booted anew" if s.rebooted else None


def own_setpoints_late(s: Situation) -> str | None:
    """The autopilot left OFFBOARD for want of setpoints: this process was held up, was restarted, or the link lost them."""
    left = s.mode_taken and s.status.intended_mode is FlightMode.OFFBOARD
    if not left or s.recovering:
        return None
    if s.phase in (Phase.ACQUIRE, Phase.HOLD):
        # The stream has been stopped for HOLD, which is not flown yet.
        return (
            None if s.mode_overdue_s is None else f"the autopilot flies {s.status.mode}: it was told to hold too late"
        )
    if s.setpoint_gap_s < SETPOINT_GAP_S:
        return None
    return f"no setpoint went out for {s.setpoint_gap_s:.2f} s, the autopilot flies {s.status.mode}"


def restarted_too_late(s: Situation) -> str | None:
    """The same, right after a start in flight."""
    return own_setpoints_late(s) if s.code == "restarted_in_flight" else None


def autopilot_failsafe(s: Situation) -> str | None:
    """The autopilot flies a failsafe of its own."""
    if s.recovering:
        return None
    if s.status.failsafe:
        return f"the autopilot reports a failsafe and flies {s.status.mode}: {s.status.last_text or 'no text'}"
    if s.mode_taken and s.status.intended_mode in s.expected_modes:
        return f"the autopilot flies {s.status.mode} instead of {s.status.intended_mode}, which it still intends"
    return None


def pilot_took_over(s: Situation) -> str | None:
    """A mode is flown that the commander did not ask for."""
    if not s.mode_taken or s.recovering:
        return None
    return f"mode is {s.status.mode}, expected {' or '.join(s.expected_modes) or 'none'}"


def mode_not_flown(s: Situation) -> str | None:
    """A mode was asked for and is still not flown."""
    if s.mode_overdue_s is None or s.mode_overdue_s <= s.settings.mode_patience_s:
        return None
    return f"mode {s.status.mode} is still flown {s.mode_overdue_s:.1f} s after another was asked for"


def vehicle_state_stale(s: Situation) -> str | None:
    """Where the vehicle is, is not known well enough to steer."""
    if s.state_age_s is None:
        return "the vehicle's position is not known"
    if s.state_age_s < -s.settings.state_stale_after_s:
        return f"vehicle state is of {-s.state_age_s:.2f} s from now: a clock was set back"
    if s.state_age_s > s.settings.state_stale_after_s:
        return f"vehicle state is {s.state_age_s:.2f} s old, limit {s.settings.state_stale_after_s:g} s"
    return None


def landed(s: Situation) -> str | None:
    """On the ground and disarmed."""
    if s.status.armed or s.status.landed_state is not LandedState.ON_GROUND:
        return None
    where = "" if s.distance_to_pad_m is None else f", {s.distance_to_pad_m:.2f} m from the pad by own reckoning"
    return f"on the ground and disarmed{where}"


def disarmed_in_flight(s: Situation) -> str | None:
    """Disarmed, but not on the ground."""
    return None if s.status.armed else f"disarmed while landed state is {s.status.landed_state}"


def disarmed_before_takeoff(s: Situation) -> str | None:
    """It was armed, and is not any more, and never climbed."""
    return "disarmed before it climbed" if s.was_armed and not s.status.armed else None


def command_refused(s: Situation) -> str | None:
    """The autopilot will not do what the phase needs."""
    if s.refusal is None:
        return None
    return f"command {s.refusal.command.name}: {s.refusal.result}; autopilot says: {s.status.last_text or 'nothing'}"


# A new process, an old flight ---------------------------------------------------------------------------------------


def restarted_in_offboard(s: Situation) -> str | None:
    """This process has just started, and the vehicle flies in the mode that only a commander flies."""
    if not (s.first_look and s.airborne and s.status.mode is FlightMode.OFFBOARD and not s.status.failsafe):
        return None
    return "the commander started while the vehicle flew in offboard: told it to hold"


def restarted_airborne(s: Situation) -> str | None:
    """This process has just started, and the vehicle is in the air."""
    if not (s.first_look and s.airborne):
        return None
    return f"the commander started while the vehicle flew in {s.status.mode}: hands off until asked"


# Requests -------------------------------------------------------------------------------------------------------------


def takeoff_asked(s: Situation) -> str | None:
    """A person asked for a takeoff."""
    return "takeoff was asked for" if s.asked is Verb.TAKEOFF else None


def land_asked(s: Situation) -> str | None:
    """A person asked for the landing."""
    return "landing was asked for" if s.asked is Verb.LAND else None


def hold_asked(s: Situation) -> str | None:
    """A person asked to hold."""
    return "hold was asked for" if s.asked is Verb.HOLD else None


def abort_asked(s: Situation) -> str | None:
    """A person asked to end it."""
    return "abort was asked for" if s.asked is Verb.ABORT else None


# Takeoff and transit --------------------------------------------------------------------------------------------------


def climbed(s: Situation) -> str | None:
    """The takeoff is over: PX4 has gone from TAKEOFF to HOLD by itself."""
    return f"climbed in {s.phase_age_s:.1f} s" if _holds_after_climb(s) else None


def climb_broken_off(s: Situation) -> str | None:
    """It holds, but not where PX4 ends a takeoff by itself: somebody pressed hold."""
    if not _holds_after_climb(s) or s.climb_left_m is None or s.climb_left_m <= ALTITUDE_REACHED_M:
        return None
    return f"mode is {s.status.mode}, {s.climb_left_m:.1f} m below the height of the takeoff"


def _holds_after_climb(s: Situation) -> bool:
    return s.climbing_asked and s.airborne and s.status.mode is FlightMode.HOLD and s.mode_overdue_s is None


def takeoff_overdue(s: Situation) -> str | None:
    """Getting ready, arming and climbing took too long."""
    if s.phase_age_s <= s.settings.takeoff_patience_s:
        return None
    return f"not up after {s.phase_age_s:.0f} s; autopilot says: {s.status.last_text or 'nothing'}"


def at_start(s: Situation) -> str | None:
    """The start point is reached and the vehicle is still, or there is no start point."""
    if s.distance_to_start_m is None:
        return "no start point was named: holding where the climb ended"
    if s.distance_to_start_m > AT_START_M or s.speed_mps > AT_START_MPS:
        return None
    return f"{s.distance_to_start_m:.2f} m from the start point"


def transit_overdue(s: Situation) -> str | None:
    """The flight to the start point took too long."""
    if s.phase_age_s <= s.settings.transit_patience_s:
        return None
    return f"still {s.distance_to_start_m or 0.0:.1f} m from the start point after {s.phase_age_s:.0f} s"


# Landing --------------------------------------------------------------------------------------------------------------


def acquired(s: Situation) -> str | None:
    """Good estimates have come for long enough, and the vehicle holds."""
    if s.status.mode is not FlightMode.HOLD or s.mode_overdue_s is not None or s.failsafe_active:
        return None
    if s.estimates_good_for_s < s.settings.acquire_for_s or s.estimate_age_s is None or s.height_above_pad_m is None:
        return None
    if s.estimate_age_s > s.stale_after_s:
        return None
    return f"pad {s.height_above_pad_m:.1f} m below and {s.distance_to_pad_m:.1f} m away"


def pad_not_found(s: Situation) -> str | None:
    """No estimate to go down on."""
    if s.phase_age_s <= s.settings.acquire_patience_s:
        return None
    return f"no good estimate of the pad within {s.phase_age_s:.0f} s"


def estimate_stale(s: Situation) -> str | None:
    """The newest good estimate is too old to steer on."""
    if s.estimate_age_s is None:
        return "there is no estimate of the pad"
    if s.estimate_age_s <= s.stale_after_s:
        return None
    return f"estimate is {s.estimate_age_s:.2f} s old, limit {s.stale_after_s:g} s"


def too_many_holds(s: Situation) -> str | None:
    """The estimate was lost too often."""
    if estimate_stale(s) is None or s.holds < s.settings.max_holds:
        return None
    return f"the estimate was lost for the {s.holds + 1}th time"


def estimate_back(s: Situation) -> str | None:
    """During a landing that waits for estimates: there is a fresh one."""
    if not s.landing or s.estimate_age_s is None or vehicle_state_stale(s):
        return None
    fresh = s.estimate_age_s <= FRESH_PART * s.stale_after_s
    return f"estimate is {s.estimate_age_s:.2f} s old after {s.phase_age_s:.1f} s" if fresh else None


def estimate_lost(s: Situation) -> str | None:
    """During a landing that waits for estimates: none came for too long."""
    if not s.landing or s.phase_age_s <= s.settings.hold_patience_s:
        return None
    return f"no estimate of the pad for {s.phase_age_s:.0f} s"


def low_over_pad(s: Situation) -> str | None:
    """The switching height is reached; with `glide` by its own setpoints, surely inside the funnel: from here on it goes down blind."""
    height_m, distance_m = s.height_above_pad_m, s.distance_to_pad_m
    if height_m is None or distance_m is None or s.pad is None or height_m > s.switching_height_m:
        return None
    if s.settings.guidance == "glide":
        outside = distance_m + 2.0 * s.pad.sigma_m > funnel_radius_m(s.settings.glide, height_m)
        if outside or s.status.mode is not FlightMode.OFFBOARD:
            return None
    return f"{height_m:.2f} m above the pad, {distance_m:.2f} m beside its centre"


def funnel_closed(s: Situation) -> str | None:
    """Too far beside the line, or too uncertain, for too long."""
    if s.funnel_closed_for_s <= s.settings.glide.funnel_patience_s:
        return None
    return f"too far beside the line or too uncertain to descend for {s.funnel_closed_for_s:.0f} s"


def descent_overdue(s: Situation) -> str | None:
    """The descent does not end."""
    if s.phase_age_s <= s.settings.descent_patience_s:
        return None
    return f"still {s.height_above_pad_m or 0.0:.1f} m above the pad after {s.phase_age_s:.0f} s"


def touchdown_overdue(s: Situation) -> str | None:
    """The ground does not come, not even in the autopilot's landing mode."""
    if s.phase_age_s <= 3.0 * s.settings.touchdown_patience_s:
        return None
    return f"not on the ground {s.phase_age_s:.0f} s after the switching height"
