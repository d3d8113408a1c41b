"""The commander's state machine, on one page.

The rows are tried from the top; the first whose phase fits and whose condition holds is taken. So what protects people stands first.
Requests are judged before they come here (`requests.py`).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from schemas.mission import Phase, Verb
from services.commander import conditions as when
from services.commander.conditions import Condition
from services.commander.situation import Situation

IDLE, TAKEOFF, TRANSIT, ACQUIRE = Phase.IDLE, Phase.TAKEOFF, Phase.TRANSIT, Phase.ACQUIRE
DESCEND, TOUCHDOWN, HOLD = Phase.DESCEND, Phase.TOUCHDOWN, Phase.HOLD
LANDED, ABORTED, YIELDED, FAILED = Phase.LANDED, Phase.ABORTED, Phase.YIELDED, Phase.FAILED

ACTIVE = frozenset({TAKEOFF, TRANSIT, ACQUIRE, DESCEND, TOUCHDOWN, HOLD})
"""The phases in which the commander commands. In all others it sends nothing that moves the vehicle."""
STEERING = frozenset({TRANSIT, ACQUIRE, DESCEND})
STREAMING = frozenset({DESCEND, TOUCHDOWN})
LANDING = frozenset({ACQUIRE, DESCEND, TOUCHDOWN, HOLD})
ANY = frozenset(Phase)


@dataclass(frozen=True)
class Transition:
    """One row."""

    phases: frozenset[Phase]
    condition: Condition
    next: Phase
    code: str
    """Stable name of the reason, published with the phase."""


def _row(phases: Phase | frozenset[Phase], condition: Condition, following: Phase, code: str = "") -> Transition:
    phases = frozenset({phases}) if isinstance(phases, Phase) else phases
    return Transition(phases, condition, following, code or condition.__name__)


# fmt: off
#         in phase            when                          then       code (the condition's name, if not given)
TABLE: tuple[Transition, ...] = (
    _row(IDLE,                when.restarted_in_offboard,   HOLD,      "restarted_in_flight"),
    _row(IDLE,                when.restarted_airborne,      YIELDED,   "restarted_in_flight"),
    _row(ACTIVE,              when.autopilot_rebooted,      FAILED),
    _row(ACTIVE,              when.link_lost,               YIELDED),
    _row(LANDING,             when.landed,                  LANDED),
    _row(ACTIVE - {TAKEOFF},  when.disarmed_in_flight,      FAILED),
    _row(HOLD,                when.restarted_too_late,      YIELDED,   "restarted_in_flight"),
    _row(ACTIVE - {TAKEOFF},  when.own_setpoints_late,      YIELDED),
    _row(ACTIVE,              when.autopilot_failsafe,      YIELDED),
    _row(ACTIVE,              when.pilot_took_over,         YIELDED),
    _row(ANY,                 when.abort_asked,             ABORTED),
    _row(ANY,                 when.hold_asked,              HOLD),
    _row(ANY,                 when.land_asked,              ACQUIRE),
    _row(ANY,                 when.takeoff_asked,           TAKEOFF),
    _row(STEERING,            when.vehicle_state_stale,     HOLD),
    _row(TAKEOFF,             when.disarmed_before_takeoff, FAILED),
    _row(TAKEOFF,             when.command_refused,         FAILED),
    _row(TAKEOFF,             when.takeoff_overdue,         FAILED),
    _row(TAKEOFF,             when.climb_broken_off,        YIELDED,   "pilot_took_over"),
    _row(TAKEOFF,             when.climbed,                 TRANSIT),
    _row(TRANSIT,             when.command_refused,         HOLD),
    _row(TRANSIT,             when.at_start,                HOLD),
    _row(TRANSIT,             when.transit_overdue,         HOLD),
    _row(ACQUIRE,             when.mode_not_flown,          FAILED),
    _row(ACQUIRE,             when.acquired,                DESCEND),
    _row(ACQUIRE,             when.pad_not_found,           ABORTED),
    _row(DESCEND,             when.command_refused,         HOLD),
    _row(DESCEND,             when.mode_not_flown,          HOLD),
    _row(DESCEND,             when.low_over_pad,            TOUCHDOWN),
    _row(DESCEND,             when.too_many_holds,          ABORTED),
    _row(DESCEND,             when.estimate_stale,          HOLD),
    _row(DESCEND,             when.funnel_closed,           ABORTED),
    _row(DESCEND,             when.descent_overdue,         ABORTED),
    _row(TOUCHDOWN,           when.touchdown_overdue,       FAILED),
    _row(HOLD,                when.mode_not_flown,          FAILED),
    _row(HOLD,                when.estimate_back,           ACQUIRE),
    _row(HOLD,                when.estimate_lost,           ABORTED),
)
# fmt: on

_ROWS: Mapping[Phase, tuple[Transition, ...]] = {
    phase: tuple(row for row in TABLE if phase in row.phases) for phase in Phase
}

RESUMED = frozenset({"estimate_stale", "vehicle_state_stale"})
"""A HOLD with one of these codes goes on with the landing by itself; any other waits to be asked."""


def asked_code(verb: Verb) -> str:
    """The code of the row that carries a request out."""
    return f"{verb}_asked"


_BEGIN_WITH_A_MODE = frozenset({ACQUIRE, HOLD, ABORTED, FAILED})
_ANYWAY = frozenset(
    {when.abort_asked, when.hold_asked, when.land_asked, when.autopilot_rebooted, when.disarmed_in_flight}
)
"""What a person asks for is asked for now, whoever flies; and to a vehicle that is out of power no mode is sent."""


def waits_for_a_word(row: Transition) -> bool:
    """Whether a row asks for a mode, so that it is not taken while somebody may have changed it unheard."""
    return row.next in _BEGIN_WITH_A_MODE and row.condition not in _ANYWAY


def first_transition(situation: Situation) -> tuple[Transition, str] | None:
    """The row to take now and why, in words; None to stay."""
    for row in _ROWS[situation.phase]:
        if situation.deaf and waits_for_a_word(row):
            continue
        reason = row.condition(situation)
        if reason is not None:
            return row, reason
    return None
