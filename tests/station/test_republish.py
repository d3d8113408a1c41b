"""A recorded flight once more on the bus: what is chosen, when it comes, and what its stamps say."""

from collections import defaultdict

import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_flight import Flight

from alight.runtime.admission import Admission
from alight.runtime.clock import NS_PER_S, VirtualClock, nanoseconds, seconds
from schemas import topics
from schemas.settings import Settings
from schemas.wire import decode
from station.flight_record import read_flight
from station.republish.choice import ChoiceError, choose, conflict
from station.republish.excerpt import Item, excerpt, recorded_topics
from station.republish.pace import steadily, stepwise
from station.republish.player import Player
from station.republish.presence import Presence
from station.republish.time_map import TimeMap, restamped
from station.republish.words import how_it_went, what_is_published

TODAY_NS = 1_900_000_000 * NS_PER_S
ALL = tuple(topic.name for topic in topics.TOPICS)
COMMANDING = {topics.REQUEST.name, topics.SETPOINT.name, topics.REPLY.name}


class PatientVirtualClock(VirtualClock):
    """Waiting moves it."""

    def wait_until(self, at_ns: int) -> None:
        self.advance_to(max(at_ns, self.now_ns()))


class Listener:
    """Stands for the bus: what came, when, on which topic; decoded as any reader would."""

    def __init__(self, clock: VirtualClock) -> None:
        self.clock = clock
        self.heard: list[tuple[int, topics.Topic, object]] = []
        self.pixels: dict[int, bytes] = {}

    def publish(self, topic, service, wire) -> None:
        message = decode(topic, wire.payload, wire.attachment, wire.encoding)
        assert service == (getattr(message, "service", "") if topic.per_service else "")
        if topic.has_pixels:
            self.pixels[message.stamp_ns] = wire.payload
        self.heard.append((self.clock.now_ns(), topic, message))


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    return read_flight(Flight(paint_every=3, abort_at_s=3.0).write(tmp_path_factory.mktemp("flight"), frames="png"))


def unopposed(topic):
    """Nobody else is on the bus."""


def replay(record, *, speed=1.0, from_s=0.0, to_s=None, original_time=False, names=ALL):
    clock = PatientVirtualClock(TODAY_NS)
    listener = Listener(clock)
    part = excerpt(record, names, from_s, to_s)
    player = Player(listener.publish, record.picture, clock, original_time=original_time)
    played = player.play(steadily(part, clock, speed), unopposed)
    return listener, part, played


def test_at_1x_every_message_comes_at_its_time_with_all_its_stamps_moved_by_one_offset(record):
    listener, part, played = replay(record)
    offset_ns = TODAY_NS - part.began_ns
    assert len(listener.heard) == len(part.items) == played.sent.total()
    for (heard_ns, topic, message), item in zip(listener.heard, part.items, strict=True):
        assert topic is item.topic
        assert heard_ns == item.at_ns + offset_ns
        assert message == restamped(item.message, TimeMap(0, offset_ns))
        assert message.stamp_ns == item.message.stamp_ns + offset_ns
    setpoint = next(message for _, topic, message in listener.heard if topic is topics.SETPOINT)
    was = next(item.message for item in part.items if item.topic is topics.SETPOINT)
    assert [hop.published_at_ns - offset_ns for hop in setpoint.hops] == [hop.published_at_ns for hop in was.hops]
    assert setpoint.captured_at_ns - was.captured_at_ns == setpoint.sent_at_ns - was.sent_at_ns == offset_ns


@pytest.mark.parametrize("speed", [1.0, 0.1, 4.0, 30.0])
def test_live_nodes_admit_everything_at_any_speed(record, speed):
    listener, part, played = replay(record, speed=speed)
    admission = Admission(Settings().bus.max_clock_skew_s)
    for heard_ns, topic, message in listener.heard:
        if topic is not topics.CALIBRATION:  # the synthetic flight stamps its only one once
            admission.admit(topic, message, heard_ns)
    took_s = seconds(listener.heard[-1][0] - listener.heard[0][0])
    assert took_s == pytest.approx(seconds(part.items[-1].at_ns - part.items[0].at_ns) / speed, rel=1e-6)
    assert played.latest_s == 0.0


def test_original_time_leaves_every_message_as_it_was(record):
    listener, part, _ = replay(record, original_time=True)
    assert [message for _, _, message in listener.heard] == [item.message for item in part.items]


def test_frames_come_with_their_pixels_and_those_without_a_picture_not_at_all(record):
    listener, part, played = replay(record, names=(topics.FRAME.name,))
    frames = record.messages(topics.FRAME)
    assert played.sent == {topics.FRAME.name: len(frames[::3])}
    assert part.without_picture == len(frames) - len(frames[::3])
    offset_ns = TODAY_NS - part.began_ns
    for captured_at_ns, pixels in listener.pixels.items():
        assert record.picture(captured_at_ns - offset_ns).tobytes() == pixels


def test_a_part_begins_with_the_newest_state_of_before(record):
    listener, part, _ = replay(record, from_s=1.0, to_s=1.5)
    assert seconds(part.ended_ns - part.began_ns) == pytest.approx(0.5)
    at_once = {topic.name for heard_ns, topic, _ in listener.heard if heard_ns == TODAY_NS}
    assert {topics.CALIBRATION.name, topics.VEHICLE_STATE.name, topics.MISSION_STATUS.name} <= at_once
    assert not {topics.FRAME.name, topics.REQUEST.name} & at_once
    stamps = defaultdict(list)
    for _, topic, message in listener.heard:
        stamps[topic.name, getattr(message, "service", "")].append(message.stamp_ns)
    assert all(found == sorted(set(found)) for found in stamps.values())


def test_nothing_left_is_said_with_the_length_of_the_recording(record):
    with pytest.raises(ValueError, match=r"between 100 s and .*; the recording is \d+\.\d s long"):
        excerpt(record, ALL, from_s=100.0)


def test_a_step_goes_on_to_the_next_frame_and_speaks_of_no_future(record):
    clock = PatientVirtualClock(TODAY_NS)
    listener = Listener(clock)
    pauses_s = [3.0, 0.0, 0.0, 2.0, 60.0]

    def enter(last: Item) -> bool:
        assert last.topic is topics.FRAME
        clock.advance_to(clock.now_ns() + nanoseconds(pauses_s.pop(0)) if pauses_s else clock.now_ns())
        return bool(pauses_s)

    part = excerpt(record, ALL)
    Player(listener.publish, record.picture, clock, original_time=False).play(stepwise(part, clock, enter), unopposed)
    frames = [(heard_ns, message) for heard_ns, topic, message in listener.heard if topic is topics.FRAME]
    recorded = record.messages(topics.FRAME)[::3]
    assert [frame.sequence for _, frame in frames] == [frame.sequence for frame in recorded[:4]]
    assert listener.heard[-1][1] is topics.FRAME
    newest = {}
    for heard_ns, topic, message in listener.heard:
        assert message.stamp_ns <= heard_ns
        lane = topic.name, getattr(message, "service", "")
        assert message.stamp_ns > newest.get(lane, 0)
        newest[lane] = message.stamp_ns
    # As old on arrival as in flight, after a pause of a minute, too.
    was_late_ns = next(log.logged_at_ns - log.message.stamp_ns for log in record.logged(topics.FRAME))
    assert {heard_ns - frame.stamp_ns for heard_ns, frame in frames} == {was_late_ns}


def test_what_commands_is_published_only_if_it_is_named():
    choice = choose(ALL, frozenset(), None, ())
    assert not COMMANDING & set(choice.published)
    assert "it commands" in choice.left_out[topics.SETPOINT.name]
    asked = choose(ALL, frozenset(), (topics.SETPOINT.name,), ())
    assert asked.published == (topics.SETPOINT.name,)


def test_topics_of_living_services_are_left_out_so_that_they_are_fed():
    choice = choose(ALL, {"detector", "geolocator", "filter"}, None, ())
    assert {topics.FRAME.name, topics.CALIBRATION.name, topics.VEHICLE_STATE.name} <= set(choice.published)
    for topic in (topics.DETECTION, topics.PAD_FIX, topics.PAD_ESTIMATE):
        assert topic.name not in choice.published
    assert choice.left_out[topics.PAD_FIX.name] == "the geolocator on this bus publishes it"


@given(
    st.sets(st.sampled_from(sorted(topics.SERVICES))), st.none() | st.lists(st.sampled_from(ALL), min_size=1), st.data()
)
def test_nothing_is_ever_published_beside_a_living_publisher(alive, only, data):
    without = data.draw(st.lists(st.sampled_from(ALL), max_size=3))
    try:
        choice = choose(ALL, alive, only, without)
    except ChoiceError as refused:
        assert only is not None or "nothing is left to publish" in str(refused)
        return
    assert choice.published
    for name in choice.published:
        assert not topics.BY_NAME[name].publishers & alive
        assert name not in without
        assert only is not None or name not in COMMANDING
    assert set(choice.published) | set(choice.left_out) == set(ALL)


def test_a_living_commander_is_not_steered_by_old_estimates_unasked():
    assert topics.PAD_ESTIMATE.name in choose(ALL, frozenset(), None, ()).published
    choice = choose(ALL, {"commander"}, None, ())
    assert "would steer by it" in choice.left_out[topics.PAD_ESTIMATE.name]
    assert choose(ALL, {"commander"}, (topics.PAD_ESTIMATE.name,), ()).published == (topics.PAD_ESTIMATE.name,)


@pytest.mark.parametrize(
    ("alive", "only", "words"),
    [
        ({"commander"}, ["vehicle/state"], "vehicle/state is published by the commander on this bus: stop it first"),
        ((), ["vehicle/sate"], "vehicle/sate is no topic; there are camera/calibration"),
        ({"replay-12"}, None, "another replay publishes on this bus already"),
    ],
)
def test_a_wrong_choice_is_refused_in_one_line(alive, only, words):
    with pytest.raises(ChoiceError, match=words) as refused:
        choose(ALL, alive, only, ())
    assert "\n" not in str(refused.value)


def test_nothing_left_to_publish_is_said_with_the_reasons():
    with pytest.raises(
        ChoiceError, match=r"nothing is left to publish .*truth: the simulator on this bus publishes it"
    ):
        choose(ALL, topics.SERVICES, None, ())


def test_a_topic_that_the_recording_has_not_is_refused():
    with pytest.raises(ChoiceError, match="truth is not in the recording; there are camera/frame"):
        choose((topics.FRAME.name,), (), ("truth",), ())


def test_a_service_that_appears_takes_its_topics_over(record):
    presence = Presence()
    clock = PatientVirtualClock(TODAY_NS)
    listener = Listener(clock)

    def rival(topic):
        if seconds(clock.now_ns() - TODAY_NS) > 1.0:
            presence.note("geolocator", True)
            presence.note("commander", True)
        return conflict(topic, presence.services, named=False)

    part = excerpt(record, (topics.DETECTION.name, topics.PAD_FIX.name, topics.PAD_ESTIMATE.name))
    player = Player(listener.publish, record.picture, clock, original_time=False)
    played = player.play(steadily(part, clock, 1.0), rival)
    last_s = {topic.name: seconds(heard_ns - TODAY_NS) for heard_ns, topic, _ in listener.heard}
    assert last_s[topics.PAD_FIX.name] <= 1.05
    assert last_s[topics.PAD_ESTIMATE.name] <= 1.1, "a commander that appears is not steered either"
    assert last_s[topics.DETECTION.name] > 3.5
    assert played.given_up[topics.PAD_FIX.name] == "the geolocator on this bus publishes it"
    presence.note("geolocator", False)
    assert presence.services == {"commander"}


def test_it_says_what_it_publishes_and_what_became_of_it(record):
    recorded = recorded_topics(record)
    choice = choose(recorded, {"geolocator"}, None, ())
    part = excerpt(record, choice.published, to_s=2.0)
    said = "\n".join(what_is_published(choice, part, pace="at 1x", now_ns=TODAY_NS))
    assert f"camera/frame ({sum(item.topic is topics.FRAME for item in part.items)})" in said
    assert "geolocator/fix: the geolocator on this bus publishes it" in said
    assert "commander/request, commander/setpoint: it commands" in said
    assert f"{part.without_picture} frames: the recording kept no picture of them" in said
    _, _, played = replay(record, to_s=2.0, names=choice.published)
    assert f"vehicle/state ({played.sent[topics.VEHICLE_STATE.name]})" in "\n".join(how_it_went(played))


def test_a_machine_that_does_not_keep_up_is_told(record):
    clock = PatientVirtualClock(TODAY_NS)

    def publish(topic, service, wire):
        clock.advance_to(clock.now_ns() + nanoseconds(0.05))

    part = excerpt(record, (topics.VEHICLE_STATE.name,), to_s=2.0)
    played = Player(publish, record.picture, clock, original_time=False).play(steadily(part, clock, 1.0), unopposed)
    assert played.latest_s == pytest.approx(3.0, abs=0.2)
    assert any("does not keep up" in line for line in how_it_went(played))
