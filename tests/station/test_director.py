"""The director: what it asks, when it asks again, and when it must not."""

from collections.abc import Callable

import pytest

from alight.runtime.clock import NS_PER_S, nanoseconds
from alight.runtime.node import Arrival, Publication
from schemas import topics
from schemas.health import Health, InputHealth
from schemas.message import Message
from schemas.mission import MissionReply, MissionRequest, MissionStatus, Phase, Verb
from schemas.settings import Settings
from schemas.topics import Topic
from schemas.vehicle import FlightMode, LandedState, VehicleStatus
from station.director import MAX_LANDING_REQUESTS, NO_DETECTIONS, FlightDirector, FlightPlan

START_NS = 1_000 * NS_PER_S
LATE_IN_THE_FLIGHT_S = 60.0
"""Longer than anything that is refused at the start is forgiven."""


class Stage:
    """A director, and what it says to what it hears."""

    def __init__(self, takeoff: bool = False) -> None:
        plan = FlightPlan(takeoff_to_ned_m=(1.0, 2.0, -5.0) if takeoff else None)
        self.director = FlightDirector(Settings(), plan)
        self.now_ns = START_NS
        self.asked: list[MissionRequest] = []
        self.tick(0.0)

    def tick(self, seconds: float) -> None:
        for _ in range(max(1, round(seconds / 0.1))):
            self.now_ns += nanoseconds(min(seconds, 0.1))
            self.note(self.director.on_tick(self.now_ns))

    def hear(self, topic: Topic, message: Message) -> None:
        self.note(self.director.on_message(Arrival(topic, message, self.now_ns, self.now_ns)))

    def note(self, outputs: object) -> None:
        for output in outputs:  # type: ignore[attr-defined]
            assert isinstance(output, Publication) and isinstance(output.message, MissionRequest)
            self.asked.append(output.message)

    def vehicle(self, landed: LandedState = LandedState.IN_AIR, **more: object) -> None:
        status = {"connected": True, "landed_state": landed, "ready_to_arm": True, **more}
        self.hear(topics.VEHICLE_STATUS, VehicleStatus.model_validate({"at_ns": self.now_ns, **status}))

    def mission(self, phase: Phase, code: str = "code", since_ns: int = 0) -> None:
        self.now_ns += 1
        status = MissionStatus(
            at_ns=self.now_ns, phase=phase, phase_since_ns=since_ns, reason="why", code=code, guidance="glide"
        )
        self.hear(topics.MISSION_STATUS, status)

    def detections(self, seen: int = 30, without_pad: int = 0) -> None:
        arrived = InputHealth(topic="detector/detection", received=seen, rate_hz=30, dropped=0, refused={}, stale=False)
        health = Health(
            at_ns=self.now_ns,
            service="geolocator",
            pid=1,
            uptime_s=1.0,
            inputs=(arrived,),
            outputs=(),
            counters={"fix_no_marker": without_pad},
            complaints=(),
        )
        self.hear(topics.HEALTH, health)

    def reply(self, accepted: bool = True) -> None:
        request_id = self.asked[-1].request_id
        self.hear(topics.REPLY, MissionReply(at_ns=self.now_ns, request_id=request_id, accepted=accepted, reason="why"))

    def all_there(self, landed: LandedState = LandedState.IN_AIR) -> None:
        self.vehicle(landed)
        self.mission(Phase.IDLE)
        self.detections()
        self.tick(0.1)

    @property
    def verbs(self) -> list[Verb]:
        return [request.verb for request in self.asked]


def test_what_is_in_the_air_is_landed_without_more_ado() -> None:
    stage = Stage()
    stage.all_there()
    assert stage.verbs == [Verb.LAND]
    stage.reply()
    stage.mission(Phase.ACQUIRE)
    stage.mission(Phase.LANDED)
    assert stage.director.over and stage.director.failure is None


def test_nothing_is_asked_before_detections_reach_the_geolocator() -> None:
    stage = Stage()
    stage.vehicle()
    stage.mission(Phase.IDLE)
    stage.detections(seen=0)
    stage.tick(1.0)
    assert stage.verbs == []
    stage.detections(seen=1, without_pad=1)
    stage.tick(0.1)
    assert stage.verbs == [Verb.LAND]


def test_it_knows_how_many_frames_showed_the_pad() -> None:
    stage = Stage()
    stage.detections(seen=40, without_pad=10)
    assert (stage.director.view.frames_seen, stage.director.view.frames_with_pad) == (40, 30)


def test_it_takes_off_only_if_the_plan_says_so() -> None:
    grounded = Stage(takeoff=False)
    grounded.all_there(LandedState.ON_GROUND)
    assert grounded.verbs == [] and "--takeoff" in str(grounded.director.failure)

    stage = Stage(takeoff=True)
    stage.all_there(LandedState.ON_GROUND)
    stage.reply()
    stage.mission(Phase.TAKEOFF)
    stage.mission(Phase.TRANSIT)
    assert stage.verbs == [Verb.TAKEOFF]
    stage.mission(Phase.HOLD, "at_start")
    assert stage.verbs == [Verb.TAKEOFF, Verb.LAND]


def test_an_unanswered_request_is_repeated_under_the_same_id() -> None:
    stage = Stage()
    stage.all_there()
    stage.tick(2.5)
    assert len(stage.asked) >= 3
    assert len({request.request_id for request in stage.asked}) == 1


@pytest.mark.parametrize(
    ("missing", "complaint"),
    [("mission", "no commander"), ("vehicle", "no vehicle"), ("detections", "no detections")],
)
def test_what_does_not_come_is_named(missing: str, complaint: str) -> None:
    stage = Stage()
    present: dict[str, Callable[[], None]] = {
        "mission": lambda: stage.mission(Phase.IDLE),
        "vehicle": stage.vehicle,
        "detections": stage.detections,
    }
    for name, hear in present.items():
        if name != missing:
            hear()
    stage.tick(31.0)
    assert stage.asked == []
    assert complaint in str(stage.director.failure)


def health_of(service: str, *complaints: str) -> Health:
    return Health(
        at_ns=START_NS, service=service, pid=1, uptime_s=1.0, inputs=(), outputs=(), counters={}, complaints=complaints
    )


def test_why_no_detections_come_is_said_in_the_words_of_camera_and_detector() -> None:
    stage = Stage()
    stage.vehicle()
    stage.mission(Phase.IDLE)
    stage.hear(topics.HEALTH, health_of("camera", "no calibration"))
    stage.hear(topics.HEALTH, health_of("camera", "/dev/video7 cannot be opened"))
    stage.hear(
        topics.HEALTH, health_of("detector", "camera/frame silent since start", "filter/estimate silent for 9 s")
    )
    stage.hear(topics.HEALTH, health_of("filter", "geolocator/fix silent since start"))
    stage.tick(31.0)
    said = "(camera: /dev/video7 cannot be opened; detector: camera/frame silent since start)"
    assert str(stage.director.failure) == f"{NO_DETECTIONS} after 30 s {said}"


def test_a_camera_that_is_not_there_is_named() -> None:
    stage = Stage()
    stage.vehicle()
    stage.mission(Phase.IDLE)
    stage.hear(topics.HEALTH, health_of("detector"))
    stage.tick(31.0)
    assert str(stage.director.failure).endswith("after 30 s (camera: nothing is heard of it)")


def test_what_the_camera_complains_of_is_not_said_of_a_vehicle_that_does_not_answer() -> None:
    stage = Stage()
    stage.mission(Phase.IDLE)
    stage.hear(topics.HEALTH, health_of("camera", "/dev/video7 cannot be opened"))
    stage.tick(31.0)
    assert "no vehicle" in str(stage.director.failure) and "video7" not in str(stage.director.failure)


def test_a_refusal_too_early_is_asked_again_and_a_lasting_one_ends_the_flight() -> None:
    stage = Stage()
    stage.all_there()
    stage.reply(accepted=False)
    assert not stage.director.over
    stage.tick(1.5)
    assert stage.verbs == [Verb.LAND, Verb.LAND]
    stage.tick(30.0)
    stage.reply(accepted=False)
    assert "refused" in str(stage.director.failure)


@pytest.mark.parametrize("status_first", [True, False])
def test_a_pilot_who_takes_over_in_the_moment_of_asking_is_not_asked_against(status_first: bool) -> None:
    """The commander refuses then. Status and reply come on two topics: either may be the first."""
    stage = Stage()
    stage.all_there()
    if status_first:
        stage.mission(Phase.YIELDED, "pilot_took_over", since_ns=stage.now_ns)
    stage.reply(accepted=False)
    if not status_first:
        stage.mission(Phase.YIELDED, "pilot_took_over", since_ns=stage.now_ns)
    stage.tick(5.0)
    assert stage.verbs == [Verb.LAND]
    assert str(stage.director.failure) == "yielded: why"


def test_a_flight_that_somebody_else_ended_before_does_not_keep_from_asking_again() -> None:
    stage = Stage()
    stage.vehicle()
    stage.mission(Phase.YIELDED, "pilot_took_over", since_ns=START_NS)
    stage.detections()
    stage.tick(0.1)
    stage.reply(accepted=False)
    stage.tick(1.5)
    assert stage.verbs == [Verb.LAND, Verb.LAND] and not stage.director.over


@pytest.mark.parametrize("phase", [Phase.YIELDED, Phase.ABORTED, Phase.FAILED])
def test_what_ends_a_landing_ends_the_flight_and_nothing_more_is_asked(phase: Phase) -> None:
    stage = Stage()
    stage.all_there()
    stage.reply()
    stage.mission(Phase.DESCEND)
    stage.mission(phase, "pilot_took_over")
    stage.tick(5.0)
    assert stage.verbs == [Verb.LAND]
    assert stage.director.failure is not None


def test_a_restarted_commander_is_asked_again_while_nobody_else_flies() -> None:
    stage = Stage()
    stage.all_there()
    stage.reply()
    stage.mission(Phase.DESCEND)
    stage.vehicle(mode=FlightMode.RETURN, intended_mode=FlightMode.OFFBOARD)
    stage.mission(Phase.YIELDED, "restarted_in_flight")
    assert stage.verbs == [Verb.LAND, Verb.LAND]


def test_a_restarted_commander_is_not_sent_against_a_pilot() -> None:
    stage = Stage()
    stage.all_there()
    stage.reply()
    stage.mission(Phase.DESCEND)
    stage.vehicle(mode=FlightMode.POSITION, intended_mode=FlightMode.POSITION)
    stage.mission(Phase.YIELDED, "restarted_in_flight")
    assert stage.verbs == [Verb.LAND]
    assert stage.director.over


@pytest.mark.parametrize(("mode_after", "asks_again"), [(FlightMode.HOLD, True), (FlightMode.POSITION, False)])
def test_a_commander_that_died_before_its_setpoints_were_flown(mode_after: FlightMode, asks_again: bool) -> None:
    stage = Stage()
    stage.all_there()
    stage.reply()
    stage.vehicle(mode=FlightMode.HOLD, intended_mode=FlightMode.HOLD)
    stage.mission(Phase.DESCEND)
    stage.tick(1.2)
    stage.vehicle(mode=mode_after, intended_mode=mode_after)
    stage.mission(Phase.YIELDED, "restarted_in_flight")
    assert stage.verbs == ([Verb.LAND, Verb.LAND] if asks_again else [Verb.LAND])


@pytest.mark.parametrize(("mode_before", "asks_again"), [(FlightMode.HOLD, True), (FlightMode.OFFBOARD, False)])
@pytest.mark.parametrize("deaf_for_s", [0.2, 0.7])
def test_a_commander_that_is_back_before_it_is_missed_is_known_by_its_first_word(
    mode_before: FlightMode, asks_again: bool, deaf_for_s: float
) -> None:
    stage = Stage()
    stage.all_there()
    stage.reply()
    stage.mission(Phase.DESCEND)
    stage.vehicle(mode=mode_before, intended_mode=mode_before)
    stage.tick(0.4)
    stage.vehicle(LandedState.UNDEFINED, connected=False)
    stage.tick(deaf_for_s)
    stage.vehicle(mode=FlightMode.HOLD, intended_mode=FlightMode.HOLD)
    stage.mission(Phase.YIELDED, "restarted_in_flight")
    assert stage.verbs == ([Verb.LAND, Verb.LAND] if asks_again else [Verb.LAND])


def test_a_pilot_who_flew_a_mode_without_a_name_when_the_commander_died_keeps_the_vehicle() -> None:
    stage = Stage()
    stage.all_there()
    stage.reply()
    stage.mission(Phase.DESCEND)
    stage.vehicle(mode=FlightMode.HOLD, intended_mode=FlightMode.HOLD)
    stage.tick(0.2)
    stage.vehicle(mode=FlightMode.UNKNOWN, intended_mode=FlightMode.UNKNOWN)
    stage.tick(0.4)
    stage.vehicle(LandedState.UNDEFINED, connected=False)
    stage.tick(0.2)
    stage.vehicle(mode=FlightMode.HOLD, intended_mode=FlightMode.HOLD)
    stage.mission(Phase.YIELDED, "restarted_in_flight")
    assert stage.verbs == [Verb.LAND]


@pytest.mark.parametrize(("holds_after_s", "asks_again"), [(0.1, True), (1.2, False)])
def test_a_restarted_commander_that_told_the_vehicle_to_hold_amid_a_failsafe_is_asked_again(
    holds_after_s: float, asks_again: bool
) -> None:
    stage = Stage()
    stage.all_there()
    stage.reply()
    stage.mission(Phase.DESCEND)
    stage.vehicle(mode=FlightMode.OFFBOARD, intended_mode=FlightMode.OFFBOARD)
    stage.tick(LATE_IN_THE_FLIGHT_S)
    stage.vehicle(mode=FlightMode.OFFBOARD, intended_mode=FlightMode.OFFBOARD)
    stage.mission(Phase.HOLD, "restarted_in_flight", since_ns=stage.now_ns)
    stage.reply(accepted=False)
    stage.vehicle(mode=FlightMode.RETURN, intended_mode=FlightMode.OFFBOARD)
    stage.mission(Phase.YIELDED, "restarted_in_flight", since_ns=stage.now_ns)
    stage.tick(holds_after_s)
    stage.vehicle(mode=FlightMode.HOLD, intended_mode=FlightMode.HOLD)
    stage.tick(1.0)
    asked_before = len(stage.verbs)
    stage.mission(Phase.YIELDED, "restarted_in_flight", since_ns=0)
    assert stage.verbs[asked_before:] == ([Verb.LAND] if asks_again else [])
    assert stage.director.over is not asks_again


def test_a_hold_that_the_pilot_chose_while_the_commander_lived_is_left_alone() -> None:
    stage = Stage()
    stage.all_there()
    stage.reply()
    stage.mission(Phase.DESCEND)
    stage.vehicle(mode=FlightMode.OFFBOARD, intended_mode=FlightMode.OFFBOARD)
    stage.tick(1.2)
    stage.vehicle(mode=FlightMode.HOLD, intended_mode=FlightMode.HOLD)
    stage.mission(Phase.YIELDED, "restarted_in_flight")
    assert stage.verbs == [Verb.LAND]


def test_a_commander_that_restarts_late_in_the_flight_is_asked_once_it_knows_the_vehicle() -> None:
    stage = Stage()
    stage.all_there()
    stage.reply()
    stage.vehicle(mode=FlightMode.OFFBOARD, intended_mode=FlightMode.OFFBOARD)
    stage.mission(Phase.DESCEND)
    stage.tick(LATE_IN_THE_FLIGHT_S)
    stage.mission(Phase.IDLE, "started", since_ns=stage.now_ns)
    stage.vehicle(LandedState.UNDEFINED, connected=False)
    stage.mission(Phase.IDLE, "started", since_ns=stage.now_ns - 1000)
    assert stage.verbs == [Verb.LAND]
    stage.vehicle(mode=FlightMode.RETURN, intended_mode=FlightMode.OFFBOARD)
    stage.mission(Phase.YIELDED, "restarted_in_flight", since_ns=stage.now_ns)
    assert stage.verbs == [Verb.LAND, Verb.LAND]
    assert not stage.director.over


@pytest.mark.parametrize(("mode_then", "asks_again"), [(FlightMode.RETURN, True), (FlightMode.POSITION, False)])
def test_a_restarted_commander_that_refuses_is_asked_again_unless_a_pilot_flies_by_then(
    mode_then: FlightMode, asks_again: bool
) -> None:
    stage = Stage()
    stage.all_there()
    stage.reply()
    stage.mission(Phase.DESCEND)
    stage.tick(LATE_IN_THE_FLIGHT_S)
    stage.vehicle(mode=FlightMode.RETURN, intended_mode=FlightMode.OFFBOARD)
    stage.mission(Phase.YIELDED, "restarted_in_flight")
    stage.reply(accepted=False)
    stage.tick(1.2)
    intended = FlightMode.OFFBOARD if mode_then is FlightMode.RETURN else mode_then
    stage.vehicle(mode=mode_then, intended_mode=intended)
    stage.mission(Phase.YIELDED, "restarted_in_flight")
    assert stage.verbs[1:] == ([Verb.LAND, Verb.LAND] if asks_again else [Verb.LAND])
    assert stage.director.over is not asks_again


def test_a_commander_that_keeps_restarting_is_given_up() -> None:
    stage = Stage()
    stage.all_there()
    stage.reply()
    for _ in range(MAX_LANDING_REQUESTS):
        stage.mission(Phase.HOLD, "restarted_in_flight")
        if not stage.director.over:
            stage.reply()
    assert len(stage.asked) == MAX_LANDING_REQUESTS
    assert "restarted" in str(stage.director.failure)
