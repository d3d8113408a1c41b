"""The transition table: for every phase and every bad input, the reaction."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from schemas.estimate import PadEstimate
from schemas.message import GlobalPosition
from schemas.mission import MissionRequest, Phase, Verb
from schemas.settings.commander import CommanderSettings
from schemas.vehicle import FlightMode, LandedState, VehicleState, VehicleStatus
from services.commander import flight_commands as commands
from services.commander.carried_pad import CarriedPad
from services.commander.command_queue import Outcome, Result
from services.commander.requests import refusal
from services.commander.situation import Situation
from services.commander.transitions import ACTIVE, STEERING, TABLE, first_transition

NOW = 1_767_225_600_000_000_000
HERE = GlobalPosition(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=500.0, ellipsoidal_height_m=547.0)
STALE_S = CommanderSettings().stale_after_s
MODE_IN = {
    Phase.TAKEOFF: FlightMode.TAKEOFF,
    Phase.DESCEND: FlightMode.OFFBOARD,
    Phase.TOUCHDOWN: FlightMode.OFFBOARD,
}
STATE = VehicleState(
    at_ns=NOW,
    position=HERE,
    velocity_ned_mps=(0.0, 0.0, 0.0),
    q_ned_body=(1.0, 0.0, 0.0, 0.0),
    angular_velocity_body_rps=(0.0, 0.0, 0.0),
)
ESTIMATE = PadEstimate(
    captured_at_ns=NOW,
    position=HERE,
    pad_ned_m=(1.0, 0.0, 10.0),
    azimuth_rad=0.0,
    covariance_ned_m2=(0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01),
    azimuth_variance_rad2=0.01,
    method="known",
    fixes_used=1,
)


def situation(phase: Phase, *, status: dict[str, object] | None = None, **changes: object) -> Situation:
    """A flight in which all is well."""
    mode = MODE_IN.get(phase, FlightMode.HOLD)
    airborne: dict[str, object] = {
        "at_ns": NOW,
        "connected": True,
        "armed": True,
        "mode": mode,
        "intended_mode": mode,
        "landed_state": LandedState.IN_AIR,
        "home": HERE,
    }
    well: dict[str, object] = {
        "now_ns": NOW,
        "settings": CommanderSettings(),
        "phase": phase,
        "code": "land_asked",
        "phase_age_s": 0.5,
        "link_silence_s": 0.02,
        "status": VehicleStatus.model_validate({**airborne, **(status or {})}),
        "state": STATE,
        "state_age_s": 0.02,
        "estimate": ESTIMATE,
        "pad": CarriedPad(HERE, azimuth_rad=0.0, sigma_m=0.01),
        "estimate_age_s": 0.1,
        "estimates_good_for_s": 0.2,
        "height_above_pad_m": 10.0,
        "distance_to_pad_m": 1.0,
        "distance_to_start_m": 8.0,
        "expected_modes": (mode,),
        "was_armed": True,
    }
    return Situation(**{**well, **changes})  # type: ignore[arg-type]


def taken(s: Situation) -> tuple[Phase, str] | None:
    step = first_transition(s)
    return None if step is None else (step[0].next, step[0].code)


@pytest.mark.parametrize("phase", Phase)
def test_when_all_is_well_it_stays(phase: Phase) -> None:
    assert taken(situation(phase)) is None


BAD_INPUT: list[tuple[str, frozenset[Phase], dict[str, object], dict[Phase, tuple[Phase, str]]]] = [
    (
        "the link is silent",
        ACTIVE,
        {"link_silence_s": 2.1},
        dict.fromkeys(ACTIVE, (Phase.YIELDED, "link_lost")),
    ),
    ("the autopilot booted", ACTIVE, {"rebooted": True}, dict.fromkeys(ACTIVE, (Phase.FAILED, "autopilot_rebooted"))),
    (
        "a failsafe is reported",
        ACTIVE,
        {"status": {"failsafe": True}},
        dict.fromkeys(ACTIVE, (Phase.YIELDED, "autopilot_failsafe")),
    ),
    (
        "somebody else chose the mode",
        ACTIVE,
        {"mode_taken": True, "status": {"mode": FlightMode.POSITION, "intended_mode": FlightMode.POSITION}},
        dict.fromkeys(ACTIVE, (Phase.YIELDED, "pilot_took_over")),
    ),
    (
        "the autopilot chose the mode",
        ACTIVE,
        {"mode_taken": True, "status": {"mode": FlightMode.RETURN}},
        dict.fromkeys(ACTIVE, (Phase.YIELDED, "autopilot_failsafe")),
    ),
    (
        "the vehicle's state is old",
        STEERING,
        {"state_age_s": 0.6},
        dict.fromkeys(STEERING, (Phase.HOLD, "vehicle_state_stale")),
    ),
    (
        "the vehicle was disarmed in the air",
        ACTIVE,
        {"status": {"armed": False}},
        dict.fromkeys(ACTIVE, (Phase.FAILED, "disarmed_in_flight"))
        | {Phase.TAKEOFF: (Phase.FAILED, "disarmed_before_takeoff")},
    ),
    ("the estimate is old", frozenset({Phase.DESCEND}), {"estimate_age_s": STALE_S + 0.1}, {Phase.DESCEND: (Phase.HOLD, "estimate_stale")}),
    ("there is no estimate", frozenset({Phase.DESCEND}), {"estimate_age_s": None}, {Phase.DESCEND: (Phase.HOLD, "estimate_stale")}),
    (
        "the estimate was lost too often",
        frozenset({Phase.DESCEND}),
        {"estimate_age_s": STALE_S + 0.1, "holds": 10},
        {Phase.DESCEND: (Phase.ABORTED, "too_many_holds")},
    ),
    (
        "the funnel stays closed",
        frozenset({Phase.DESCEND}),
        {"funnel_closed_for_s": 31.0},
        {Phase.DESCEND: (Phase.ABORTED, "funnel_closed")},
    ),
    (
        "the mode that was asked for does not come",
        frozenset({Phase.ACQUIRE, Phase.DESCEND, Phase.HOLD}),
        {"mode_overdue_s": 3.1},
        {
            Phase.ACQUIRE: (Phase.FAILED, "mode_not_flown"),
            Phase.DESCEND: (Phase.HOLD, "mode_not_flown"),
            Phase.HOLD: (Phase.FAILED, "mode_not_flown"),
        },
    ),
    (
        "a command is refused",
        frozenset({Phase.TAKEOFF, Phase.TRANSIT, Phase.DESCEND}),
        {"refusal": Outcome(commands.arm(), Result.DENIED, NOW)},
        {
            Phase.TAKEOFF: (Phase.FAILED, "command_refused"),
            Phase.TRANSIT: (Phase.HOLD, "command_refused"),
            Phase.DESCEND: (Phase.HOLD, "command_refused"),
        },
    ),
    ("it takes too long", ACTIVE, {"phase_age_s": 1000.0, "landing": True, "estimate_age_s": 0.9 * STALE_S, "mode_overdue_s": None}, {
        Phase.TAKEOFF: (Phase.FAILED, "takeoff_overdue"),
        Phase.TRANSIT: (Phase.HOLD, "transit_overdue"),
        Phase.ACQUIRE: (Phase.ABORTED, "pad_not_found"),
        Phase.DESCEND: (Phase.ABORTED, "descent_overdue"),
        Phase.TOUCHDOWN: (Phase.FAILED, "touchdown_overdue"),
        Phase.HOLD: (Phase.ABORTED, "estimate_lost"),
    }),
]  # fmt: skip


@pytest.mark.parametrize(
    ("phases", "changes", "expected"), [row[1:] for row in BAD_INPUT], ids=[row[0] for row in BAD_INPUT]
)
@pytest.mark.parametrize("phase", Phase)
def test_bad_input(
    phase: Phase, phases: frozenset[Phase], changes: dict[str, object], expected: dict[Phase, tuple[Phase, str]]
) -> None:
    assert taken(situation(phase, **changes)) == (expected[phase] if phase in phases else None)


@pytest.mark.parametrize("changes", [row[2] for row in BAD_INPUT], ids=[row[0] for row in BAD_INPUT])
@pytest.mark.parametrize("phase", Phase)
def test_while_somebody_may_have_taken_over_unheard_no_mode_is_asked_for(
    phase: Phase, changes: dict[str, object]
) -> None:
    step = taken(situation(phase, **changes, deaf_for_s=0.1))
    harmless = step is None or step[0] in (Phase.YIELDED, Phase.LANDED)
    assert harmless or step[1] in ("autopilot_rebooted", "disarmed_in_flight")


@pytest.mark.parametrize("phase", sorted(ACTIVE))
def test_it_lets_go_when_nobody_has_named_the_mode_for_long(phase: Phase) -> None:
    assert taken(situation(phase, deaf_for_s=4.1)) == (Phase.YIELDED, "link_lost")
    assert taken(situation(phase, deaf_for_s=3.9)) is None


@pytest.mark.parametrize("verb", [Verb.ABORT, Verb.HOLD])
def test_a_person_is_heard_at_once_even_then(verb: Verb) -> None:
    step = taken(situation(Phase.DESCEND, asked=verb, deaf_for_s=0.1))
    assert step is not None and step[1] == f"{verb}_asked"


def test_in_touchdown_lost_vision_and_an_old_state_do_not_stop_it() -> None:
    assert taken(situation(Phase.TOUCHDOWN, estimate_age_s=9.0, state_age_s=0.9)) is None


def test_the_touchdown_waits_for_the_pads_centre_and_for_offboard() -> None:
    low = {"height_above_pad_m": 0.9}
    assert taken(situation(Phase.DESCEND, distance_to_pad_m=0.1, **low)) == (Phase.TOUCHDOWN, "low_over_pad")
    assert taken(situation(Phase.DESCEND, distance_to_pad_m=0.3, **low)) is None
    assert taken(situation(Phase.DESCEND, distance_to_pad_m=0.1, status={"mode": FlightMode.HOLD}, **low)) is None


def test_own_late_setpoints_are_told_from_another_failsafe() -> None:
    lost = {"mode_taken": True, "status": {"mode": FlightMode.RETURN, "intended_mode": FlightMode.OFFBOARD}}
    assert taken(situation(Phase.DESCEND, setpoint_gap_s=1.2, **lost)) == (Phase.YIELDED, "own_setpoints_late")
    assert taken(situation(Phase.DESCEND, setpoint_gap_s=0.06, **lost)) == (Phase.YIELDED, "autopilot_failsafe")


def test_a_hold_that_came_too_late_is_no_foreign_failsafe() -> None:
    late = {
        "mode_taken": True,
        "mode_overdue_s": 0.4,
        "status": {"mode": FlightMode.RETURN, "intended_mode": FlightMode.OFFBOARD, "failsafe": True},
    }
    assert taken(situation(Phase.HOLD, code="estimate_stale", **late)) == (Phase.YIELDED, "own_setpoints_late")
    assert taken(situation(Phase.HOLD, code="restarted_in_flight", **late)) == (Phase.YIELDED, "restarted_in_flight")
    assert taken(situation(Phase.ACQUIRE, recovering=True, **late)) is None


@pytest.mark.parametrize(
    ("mode", "failsafe", "expected"),
    [
        (FlightMode.OFFBOARD, False, Phase.HOLD),
        (FlightMode.RETURN, True, Phase.YIELDED),
        (FlightMode.POSITION, False, Phase.YIELDED),
    ],
)
def test_a_start_in_flight(mode: FlightMode, failsafe: bool, expected: Phase) -> None:
    s = situation(Phase.IDLE, first_look=True, status={"mode": mode, "failsafe": failsafe})
    assert taken(s) == (expected, "restarted_in_flight")
    on_ground = situation(Phase.IDLE, first_look=True, status={"armed": False, "landed_state": LandedState.ON_GROUND})
    assert taken(on_ground) is None


def test_what_protects_comes_before_what_is_asked() -> None:
    for verb in Verb:
        assert taken(situation(Phase.DESCEND, asked=verb, status={"failsafe": True})) == (
            Phase.YIELDED,
            "autopilot_failsafe",
        )


@pytest.mark.parametrize("phase", sorted(set(Phase) - ACTIVE - {Phase.IDLE}))
@given(data=st.data())
def test_a_phase_that_has_let_go_is_left_only_on_request(phase: Phase, data: st.DataObject) -> None:
    """Whatever the inputs are."""
    numbers = st.one_of(st.none(), st.floats(0.0, 1e4))
    s = situation(
        phase,
        phase_age_s=data.draw(st.floats(0.0, 1e5)),
        estimate_age_s=data.draw(numbers),
        state_age_s=data.draw(numbers),
        link_silence_s=data.draw(numbers),
        height_above_pad_m=data.draw(numbers),
        distance_to_pad_m=data.draw(numbers),
        landing=data.draw(st.booleans()),
        rebooted=data.draw(st.booleans()),
        mode_taken=data.draw(st.booleans()),
        mode_overdue_s=data.draw(numbers),
        status={
            "armed": data.draw(st.booleans()),
            "failsafe": data.draw(st.booleans()),
            "mode": data.draw(st.sampled_from(FlightMode)),
            "landed_state": data.draw(st.sampled_from(LandedState)),
        },
    )
    assert taken(s) is None


def test_every_row_has_a_code_and_a_phase_to_leave() -> None:
    assert all(row.code and row.phases for row in TABLE)
    reachable = {row.next for row in TABLE} | {Phase.IDLE}
    assert reachable == set(Phase)


def ask(verb: Verb, age_s: float = 0.0, **more: object) -> MissionRequest:
    return MissionRequest.model_validate({"at_ns": NOW - round(age_s * 1e9), "request_id": "r", "verb": verb, **more})


@pytest.mark.parametrize(
    ("request_", "changes", "reason"),
    [
        (ask(Verb.LAND), {}, None),
        (ask(Verb.LAND, age_s=5.1), {}, "the request is 5.1 s old"),
        (ask(Verb.LAND), {"link_silence_s": 3.0}, "nothing from the autopilot"),
        (ask(Verb.LAND), {"state_age_s": 1.0}, "vehicle state is 1.00 s old"),
        (ask(Verb.LAND), {"status": {"armed": False, "landed_state": LandedState.ON_GROUND}}, "not in the air"),
        (ask(Verb.LAND), {"status": {"home": None}}, "no home"),
        (ask(Verb.LAND), {"status": {"failsafe": True}}, "flies a failsafe"),
        (ask(Verb.HOLD), {"status": {"failsafe": True}}, "flies a failsafe"),
        (ask(Verb.TAKEOFF), {}, "armed already"),
        (ask(Verb.ABORT), {"link_silence_s": 9.0, "state_age_s": None}, None),
    ],
)
def test_requests_are_judged(request_: object, changes: dict[str, object], reason: str | None) -> None:
    verdict = refusal(request_, situation(Phase.YIELDED, **changes), {})  # type: ignore[arg-type]
    assert verdict is None if reason is None else reason in (verdict or "")


def test_only_a_failsafe_for_want_of_setpoints_may_be_left_by_a_landing() -> None:
    lost = {"mode": FlightMode.RETURN, "intended_mode": FlightMode.OFFBOARD, "failsafe": True}
    other = {"mode": FlightMode.RETURN, "intended_mode": FlightMode.HOLD, "failsafe": True}
    restarted = {"code": "restarted_in_flight"}
    assert refusal(ask(Verb.LAND), situation(Phase.YIELDED, status=lost, **restarted), {}) is None
    assert refusal(ask(Verb.LAND), situation(Phase.YIELDED, status=other, **restarted), {}) is not None
    came_while_streaming = {"code": "autopilot_failsafe"}
    assert refusal(ask(Verb.LAND), situation(Phase.YIELDED, status=lost, **came_while_streaming), {}) is not None
    empty = lost | {"battery_remaining": 0.1}
    assert "battery" in (refusal(ask(Verb.LAND), situation(Phase.YIELDED, status=empty, **restarted), {}) or "")


@pytest.mark.parametrize("action", [6.0, 7.0])
def test_glide_is_refused_where_lost_setpoints_would_stop_the_motors(action: float) -> None:
    assert "COM_OBL_RC_ACT" in (refusal(ask(Verb.LAND), situation(Phase.IDLE), {"COM_OBL_RC_ACT": action}) or "")
