"""The flight metrics on landings whose numbers are known."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_flight import (
    CONTACT_S,
    DESCENT_S,
    LANDED_S,
    NAVIGATION_ERROR_NED_M,
    PAD,
    RAW_ERROR_PER_M,
    START_NS,
    TOUCHDOWN_S,
    Flight,
)  # fmt: skip

from alight.geometry.local import moved_by_ned
from alight.runtime.clock import nanoseconds
from schemas import topics
from schemas.health import Health, InputHealth
from schemas.message import Hop
from schemas.mission import MissionStatus, Phase
from schemas.truth import GroundTruth
from schemas.vehicle import VehicleState
from station.flight_record import FlightRecord, Logged
from station.metrics.incidents import IncidentKind, incidents
from station.metrics.latency import Stage, stage_times_ms
from station.metrics.paper import paper_metrics, path_length_m
from station.metrics.phases import LandingPart, landing_part, phase_spans
from station.metrics.summary import FlightSummary, summarise
from station.metrics.text import summary_line, summary_lines
from station.metrics.truth_track import TruthTrack
from station.metrics.verdict import Outcome

LEVEL = (1.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def good():
    return summarise(Flight().record())


def status(t_s: float, phase: Phase, since_s: float) -> MissionStatus:
    return MissionStatus(
        at_ns=nanoseconds(t_s), phase=phase, phase_since_ns=nanoseconds(since_s), reason="", code="c", guidance="glide"
    )


def state(t_s: float, ned_m: tuple[float, float, float], down_mps: float) -> VehicleState:
    return VehicleState(
        at_ns=nanoseconds(t_s), position=moved_by_ned(PAD, ned_m), velocity_ned_mps=(0.0, 0.0, down_mps),
        q_ned_body=LEVEL, angular_velocity_body_rps=(0.0, 0.0, 0.0),
    )  # fmt: skip


def test_phases_have_reasons_and_durations(good):
    named = [(span.phase, span.code, span.duration_s) for span in good.phases]
    assert named[:3] == [
        (Phase.ACQUIRE, "asked", DESCENT_S),
        (Phase.DESCEND, "estimate_good", TOUCHDOWN_S - DESCENT_S),
        (Phase.TOUCHDOWN, "below_switching_height", LANDED_S - TOUCHDOWN_S),
    ]
    assert good.phases[3].phase is Phase.LANDED


def test_the_same_phase_entered_again_is_another_span():
    spans = phase_spans([status(0, Phase.HOLD, 0), status(1, Phase.HOLD, 0), status(2, Phase.HOLD, 2)])
    assert [(span.began_at_ns, span.ended_at_ns) for span in spans] == [(0, 2 * 10**9), (2 * 10**9, 2 * 10**9)]


def test_the_landing_runs_from_the_first_descent_through_a_hold_to_landed():
    spans = phase_spans(
        [
            status(0, Phase.ACQUIRE, 0), status(2, Phase.DESCEND, 2), status(5, Phase.HOLD, 5),
            status(7, Phase.DESCEND, 7), status(9, Phase.LANDED, 9), status(20, Phase.LANDED, 9),
        ]
    )  # fmt: skip
    part = landing_part(spans)
    assert part == LandingPart(2 * 10**9, 9 * 10**9, looking_since_ns=0, landed=True)


def test_distance_is_the_sum_of_steps():
    assert path_length_m(np.array([[0, 0, 0], [3, 4, 0], [3, 4, -12.0]])) == pytest.approx(17.0)


def test_time_by_the_papers_rule_on_a_straight_descent():
    """From 10 m at 1 m/s after 3 s of hovering: it starts below 9.98 m and ends within 2 cm of the rest."""
    heights_m = [10.0] * 60 + [10.0 - 0.05 * step for step in range(1, 201)] + [0.0] * 40
    states = [
        state(0.05 * number, (0.02, 0.0, -height_m), 1.0 if 60 <= number < 260 else 0.0)
        for number, height_m in enumerate(heights_m)
    ]
    part = LandingPart(0, states[-1].at_ns, 0, landed=True)
    metrics = paper_metrics(states, PAD, part)
    assert metrics is not None
    assert metrics.started_at_ns == nanoseconds(60 * 0.05)
    assert metrics.time_s == pytest.approx(199 * 0.05)
    assert metrics.distance_m == pytest.approx(199 * 0.05, abs=1e-6)
    assert metrics.rmse_m == pytest.approx(0.02, abs=1e-6)
    assert metrics.rmse_1e7_deg == pytest.approx(0.02 / 0.0111, rel=0.01)


def test_no_descent_has_no_papers_metrics():
    states = [state(0.05 * number, (0.0, 0.0, -10.0), 0.0) for number in range(40)]
    assert paper_metrics(states, PAD, LandingPart(0, states[-1].at_ns, 0, landed=False)) is None


def test_a_good_landing_in_the_papers_terms(good):
    assert good.paper.time_s == pytest.approx(CONTACT_S - DESCENT_S, abs=1.0)
    assert good.paper.straight_line_m == pytest.approx(math.dist((10, 10, -20), -NAVIGATION_ERROR_NED_M), abs=0.3)
    assert good.paper.straight_line_m - 0.5 < good.paper.distance_m < good.paper.straight_line_m + 1.0
    assert good.paper.rmse_m == pytest.approx(math.hypot(0.43, 0.32), abs=0.01)


def test_true_touchdown(good):
    assert good.touchdown.at_ns == pytest.approx(START_NS + nanoseconds(CONTACT_S), abs=2e7)
    assert good.touchdown.error_m == pytest.approx(math.hypot(0.03, 0.02), abs=1e-6)
    assert good.touchdown.after_s == pytest.approx(CONTACT_S - DESCENT_S, abs=0.02)


def test_contact_before_the_descent_is_not_the_touchdown():
    """The vehicle stands on the ground before takeoff."""
    flight = Flight().record()
    truths = flight.messages(topics.GROUND_TRUTH)
    standing = truths[0].model_copy(update={"touching_ground": True})
    entries = [(topics.GROUND_TRUTH.name, one) for one in flight.logged(topics.GROUND_TRUTH)[1:]]
    first = type(entries[0][1])(standing, standing.at_ns)
    others = [(t.name, one) for t in topics.TOPICS if t is not topics.GROUND_TRUTH for one in flight.logged(t)]
    summary = summarise(FlightRecord([(topics.GROUND_TRUTH.name, first), *entries, *others]))
    assert summary.touchdown.at_ns >= START_NS + nanoseconds(CONTACT_S)


def test_detection_rate_counts_frames_between_search_and_contact(good):
    detection = good.detection
    assert detection.frames == detection.examined == pytest.approx(CONTACT_S * 30, abs=2)
    assert dict(detection.fixes)["accepted"] == detection.seen
    assert detection.rate == detection.seen / detection.examined


def test_latency_by_stage(good):
    budget = good.latency
    assert budget.total.p50_ms == pytest.approx(23.0)
    assert budget.overhead.p50_ms == pytest.approx(11.0)
    times = {(stage.service, stage.stage): stage.time.p50_ms for stage in budget.stages}
    assert times["camera", Stage.CAMERA] == pytest.approx(6.0)
    assert times["detector", Stage.TRANSPORT] == pytest.approx(0.5)
    assert times["detector", Stage.QUEUE] == pytest.approx(0.25)
    assert times["detector", Stage.HANDLING] == pytest.approx(12.0)
    assert sum(stage.time.mean_ms for stage in budget.stages) == pytest.approx(budget.total.mean_ms)


stamps = st.lists(st.integers(0, 10**9), min_size=9, max_size=9)


@given(steps_ns=stamps)
def test_stages_always_add_up_to_the_whole(steps_ns):
    times_ns = np.cumsum(steps_ns).tolist()
    hops = [
        Hop(service=name, received_at_ns=a, handled_at_ns=b, published_at_ns=c)
        for name, (a, b, c) in zip("abc", zip(*[iter(times_ns)] * 3, strict=True), strict=True)
    ]
    assert sum(stage_times_ms(0, hops).values()) == pytest.approx(times_ns[-1] / 1e6)


def test_fix_and_estimate_errors_against_the_truth_at_capture(good):
    raw = good.errors.raw
    high = next(error for error in raw if error.height_m > 19)
    assert high.ned_m[0] == pytest.approx(RAW_ERROR_PER_M * high.height_m, abs=0.2)
    assert high.ned_m[1] == pytest.approx(RAW_ERROR_PER_M / 2 * high.height_m, abs=0.2)
    assert max(error.horizontal_m for error in good.errors.estimate) < 0.2
    assert len(good.errors.raw) == len(good.errors.corrected) > 400


def test_truth_is_interpolated_but_not_across_gaps_or_beyond_its_ends():
    def truth(t_s: float, north_m: float) -> GroundTruth:
        return GroundTruth(
            at_ns=nanoseconds(t_s), vehicle_position=PAD, velocity_ned_mps=(0, 0, 0), q_ned_body=LEVEL,
            angular_velocity_body_rps=(0, 0, 0), pad_position=PAD, pad_azimuth_rad=0.0,
            vehicle_from_pad_ned_m=(north_m, 0.0, -1.0), touching_ground=False,
        )  # fmt: skip

    track = TruthTrack([truth(1.0, 0.0), truth(1.1, 1.0), truth(3.0, 2.0)])
    assert track.at(nanoseconds(1.025))[0] == pytest.approx(0.25)
    assert track.at(nanoseconds(1.0))[0] == 0.0
    assert track.at(nanoseconds(2.0)) is None
    assert track.at(nanoseconds(0.9)) is None
    assert track.at(nanoseconds(3.1)) is None


def test_restart_and_complaint_are_incidents():
    summary = summarise(Flight(commander_restarts_at_s=6.0).record())
    found = {(incident.service, incident.kind, incident.detail) for incident in summary.landing_incidents}
    assert ("commander", IncidentKind.RESTARTED, "began anew 0.0 s before this report") in found
    assert ("commander", IncidentKind.COMPLAINT, "filter/estimate silent for 1.2 s") in found


def report(t_s: float, *complaints: str) -> Health:
    return Health(
        at_ns=nanoseconds(t_s),
        service="filter",
        pid=1,
        uptime_s=t_s,
        inputs=(),
        outputs=(),
        counters={},
        complaints=complaints,
    )


def silent(t_s: float, *silent_topics: str) -> Health:
    """The commander's report, in which these inputs are silent."""
    inputs = tuple(
        InputHealth(topic=topic, received=9, rate_hz=0.0, dropped=0, refused={}, stale=True) for topic in silent_topics
    )
    return report(t_s).model_copy(update={"service": "commander", "inputs": inputs})


def flown(phases: list[tuple[float, Phase]], reports: list[Health]) -> FlightSummary:
    statuses = [status(t_s, phase, t_s) for t_s, phase in phases]
    said = [(topics.MISSION_STATUS.name, Logged(one, one.at_ns)) for one in statuses]
    return summarise(FlightRecord([*said, *((topics.HEALTH.name, Logged(one, one.at_ns)) for one in reports)]))


LANDED_IN_THE_END = [(1.0, Phase.ACQUIRE), (2.0, Phase.DESCEND), (10.0, Phase.TOUCHDOWN), (14.0, Phase.LANDED)]
ESTIMATE, FIX = topics.PAD_ESTIMATE.name, topics.PAD_FIX.name


def test_that_no_estimate_comes_near_the_ground_is_expected():
    summary = flown(LANDED_IN_THE_END, [silent(t_s, ESTIMATE) for t_s in (11.2, 12.2, 13.2, 14.2)])
    assert [summary.is_expected(incident) for incident in summary.incidents] == [True]
    assert summary.landing_incidents == ()
    assert "incidents" not in "\n".join(summary_lines(summary))


@pytest.mark.parametrize(
    ("phases", "reports"),
    [
        pytest.param(LANDED_IN_THE_END, [silent(9.2, ESTIMATE), silent(10.2, ESTIMATE)], id="from higher up on"),
        pytest.param(LANDED_IN_THE_END, [silent(11.2, FIX)], id="fixes come even if nothing is seen"),
        pytest.param(
            [*LANDED_IN_THE_END[:3], (12.0, Phase.HOLD), (15.0, Phase.DESCEND)],
            [silent(11.2, ESTIMATE), silent(12.2, ESTIMATE)],
            id="it went up again",
        ),
    ],
)
def test_any_other_silence_is_an_incident(phases, reports):
    assert [incident.kind for incident in flown(phases, reports).landing_incidents] == [IncidentKind.STALE]


def test_a_service_that_began_after_all_had_to_be_there_was_restarted():
    late = report(9).model_copy(update={"uptime_s": 2.0})
    assert [i.kind for i in incidents([late], all_there_ns=5 * 10**9)] == [IncidentKind.RESTARTED]
    assert incidents([late], all_there_ns=8 * 10**9) == ()


def test_an_incident_lasts_while_it_is_repeated_and_comes_back_as_another():
    reports = [report(1, "fix 0.5 s old"), report(2, "fix 1.5 s old"), report(3), report(4, "fix 0.7 s old")]
    spans = [(i.detail, i.first_at_ns, i.last_at_ns, i.reports) for i in incidents(reports)]
    assert spans == [("fix 0.5 s old", 10**9, 2 * 10**9, 2), ("fix 0.7 s old", 4 * 10**9, 4 * 10**9, 1)]


@pytest.mark.parametrize(
    ("flight", "outcome", "line"),
    [
        (Flight(), Outcome.LANDED_ON_PAD, "landed 3.6 cm from the pad's centre after 15.0 s"),
        (
            Flight(with_truth=False),
            Outcome.LANDED_ON_PAD,
            "landed 3.7 cm from the pad's centre (by its own estimate) after 14.4 s",
        ),
        (
            Flight(rest_ned_m=(0.0, 0.7, -0.15)),
            Outcome.LANDED_BESIDE_PAD,
            "landed 0.70 m from the pad's centre, more than 0.5 m",
        ),
        (
            Flight(abort_at_s=8.0),
            Outcome.NOT_LANDED,
            "the landing did not end on the ground: ended in aborted, asked: abort asked for by a person",
        ),
        (
            Flight(abort_at_s=1.0),
            Outcome.NO_DESCENT,
            "the descent never began: ended in aborted, asked: abort asked for by a person",
        ),
    ],
)
def test_verdict_names_what_happened(flight, outcome, line):
    summary = summarise(flight.record())
    assert summary.verdict.outcome is outcome
    assert summary.verdict.ok == (outcome is Outcome.LANDED_ON_PAD)
    assert summary_line(summary) == line


def test_an_empty_recording_has_a_verdict_too():
    summary = summarise(FlightRecord([]))
    assert summary.verdict.outcome is Outcome.NO_MISSION
    assert summary_lines(summary) == ["the commander's mission status is not in the recording"]


def test_landed_without_contact_is_not_believed():
    flight = Flight().record()
    afloat = [
        (topic.name, one if topic is not topics.GROUND_TRUTH else type(one)(_afloat(one.message), one.logged_at_ns))
        for topic in topics.TOPICS
        for one in flight.logged(topic)
    ]
    assert summarise(FlightRecord(afloat)).verdict.outcome is Outcome.NO_TOUCHDOWN


def _afloat(truth: GroundTruth) -> GroundTruth:
    return truth.model_copy(update={"touching_ground": False})


def test_the_headline_counts_to_the_true_contact_and_the_papers_time_is_called_so(good):
    assert good.paper.time_s < good.touchdown.after_s - 0.5
    headline, *rows = summary_lines(good)
    assert headline.endswith(f"after {good.touchdown.after_s:.1f} s")
    (papers,) = (row for row in rows if "time to land" in row)
    assert f"{good.paper.time_s:.1f} s (paper, Eq. 30" in papers
    (true,) = (row for row in rows if "true touchdown" in row)
    assert true.endswith(f"{good.touchdown.after_s:.1f} s after the descent began")


def test_the_text_names_every_measure(good):
    text = "\n".join(summary_lines(good))
    for word in ("distance flown", "time to land", "last ten positions", "true touchdown", "pad seen", "fixes",
                 "horizontal RMS error", "capture to setpoint", "median by stage", "phases"):  # fmt: skip
        assert word in text
