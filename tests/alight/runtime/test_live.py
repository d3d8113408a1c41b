"""Nodes live, on a bus of their own on the loopback: delivery classes, late joiners, bad input, health."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest
import zenoh

from alight.runtime.bus import Bus, BusError, configuration
from alight.runtime.clock import Clock, VirtualClock, WallClock
from alight.runtime.clock_questions import clock_key
from alight.runtime.live import LiveRunner
from alight.runtime.node import Arrival, Node, Output, Publication
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.estimate import PadEstimate
from schemas.fix import FixVerdict, PadFix
from schemas.frame import FrameHeader
from schemas.health import Health
from schemas.message import SCHEMA_VERSION, GlobalPosition
from schemas.settings import Settings
from schemas.settings.bus import BusSettings
from schemas.topics import Topic
from schemas.wire import encode


class Camera(Node):
    """Publishes one calibration at the start, and a frame every 20 ms."""

    service = "camera"
    tick_period_ns = 20_000_000

    def __init__(self) -> None:
        super().__init__()
        self.sequence = 0

    def on_tick(self, now_ns: int) -> Iterator[Output]:
        if self.sequence == 0:
            yield Publication(
                topics.CALIBRATION,
                CameraCalibration(at_ns=now_ns, width_px=8, height_px=4, fx_px=5, fy_px=5, cx_px=4, cy_px=2),
            )
        header = FrameHeader(captured_at_ns=now_ns, sequence=self.sequence, width_px=8, height_px=4, source="test")
        yield Publication(topics.FRAME, header, np.full((4, 8), self.sequence % 256, np.uint8))
        self.sequence += 1


class Eye(Node):
    """Keeps what it gets; may be slow."""

    service = "detector"

    def __init__(self, slowness_s: float = 0.0) -> None:
        super().__init__()
        self.frames: list[tuple[int, int]] = []
        self.calibrations: list[CameraCalibration] = []
        self.slowness_s = slowness_s
        self.subscribe(topics.FRAME, self.on_frame)
        self.subscribe(topics.CALIBRATION, self.on_calibration)

    def on_frame(self, arrival: Arrival[FrameHeader]) -> tuple[()]:
        time.sleep(self.slowness_s)
        assert arrival.pixels is not None
        self.frames.append((arrival.message.sequence, int(arrival.pixels[0, 0])))
        return ()

    def on_calibration(self, arrival: Arrival[CameraCalibration]) -> tuple[()]:
        self.calibrations.append(arrival.message)
        return ()


class Onlooker(Node):
    """Keeps the health of all services."""

    service = "station"

    def __init__(self) -> None:
        super().__init__()
        self.health: dict[str, Health] = {}
        self.subscribe(topics.HEALTH, self.on_health)

    def on_health(self, arrival: Arrival[Health]) -> tuple[()]:
        self.health[arrival.message.service] = arrival.message
        return ()


class Clerk(Node):
    """Keeps all that is said on a topic."""

    service = "recorder"

    def __init__(self, topic: Topic[Any]) -> None:
        super().__init__()
        self.kept: list[Any] = []
        self.subscribe(topic, self.keep)

    def keep(self, arrival: Arrival[Any]) -> tuple[()]:
        self.kept.append(arrival.message)
        return ()


class Ticker(Node):
    """Does nothing but look at the time."""

    service = "filter"
    tick_period_ns = 20_000_000


class Surveyor(Node):
    """Publishes a fix every 2 ms."""

    service = "geolocator"
    tick_period_ns = 2_000_000

    def on_tick(self, now_ns: int) -> Iterator[Output]:
        yield Publication(topics.PAD_FIX, PadFix(captured_at_ns=now_ns, verdict=FixVerdict.NO_MARKER))


class Planner(Node):
    """Knows every fix 10 ms before its time, and makes them in the wrong order."""

    service = "geolocator"
    tick_period_ns = 20_000_000

    def __init__(self) -> None:
        super().__init__()
        self.made_ns: list[int] = []

    def on_tick(self, now_ns: int) -> Iterator[Output]:
        for release_at_ns in (now_ns + 10_000_000, now_ns + 5_000_000):
            self.made_ns.append(release_at_ns - 1_000_000)
            fix = PadFix(captured_at_ns=release_at_ns - 1_000_000, verdict=FixVerdict.NO_MARKER)
            yield Publication(topics.PAD_FIX, fix, release_at_ns=release_at_ns)


class Weigher(Node):
    """Answers each fix at once, and ticks besides; notes who runs it, and whether two ever did."""

    service = "filter"
    answers_at_once = True
    tick_period_ns = 1_000_000

    def __init__(self) -> None:
        super().__init__()
        self.taken_ns: list[int] = []
        self.ticks = 0
        self.threads: set[int] = set()
        self.together = 0
        self._inside = False
        self.subscribe(topics.PAD_FIX, self.on_fix)

    def on_fix(self, arrival: Arrival[PadFix]) -> Iterator[Output]:
        self.work()
        self.taken_ns.append(arrival.message.captured_at_ns)
        position = GlobalPosition(
            latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=500.0, ellipsoidal_height_m=547.0
        )
        yield Publication(
            topics.PAD_ESTIMATE,
            PadEstimate(
                captured_at_ns=arrival.message.captured_at_ns,
                position=position,
                pad_ned_m=(0.0, 0.0, 1.0),
                azimuth_rad=0.0,
                azimuth_variance_rad2=1.0,
                covariance_ned_m2=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
                method="none",
                fixes_used=1,
            ),
        )

    def on_tick(self, now_ns: int) -> tuple[()]:
        self.work()
        self.ticks += 1
        return ()

    def work(self) -> None:
        self.together += self._inside
        self._inside = True
        self.threads.add(threading.get_ident())
        time.sleep(0.0002)
        self._inside = False


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Watcher(Node):
    """Looks at each picture at once, and notes which thread ran it."""

    service = "detector"
    answers_at_once = True

    def __init__(self) -> None:
        super().__init__()
        self.looked: dict[int, int] = {}
        self.subscribe(topics.FRAME, self.on_frame)

    def on_frame(self, arrival: Arrival[FrameHeader]) -> tuple[()]:
        self.looked[arrival.message.sequence] = threading.get_ident()
        return ()


@pytest.fixture
def far_end() -> Iterator[Callable[[Node, Clock], tuple[LiveRunner, Bus]]]:
    """A node's runner, and a bus that speaks to it and is nobody's."""
    with ExitStack() as held:

        def join(node: Node, clock: Clock) -> tuple[LiveRunner, Bus]:
            endpoint = f"tcp/127.0.0.1:{free_port()}"
            settings = Settings.model_validate({"vehicle": "test", "bus": {"connect": [], "listen": [endpoint]}})
            runner = LiveRunner(node, settings, ports={}, clock=clock)
            held.callback(runner.bus.close)
            bus = Bus("test", BusSettings(connect=(endpoint,)))
            held.callback(bus.close)
            held.callback(runner.stop)
            return runner, bus

        yield join


@pytest.fixture
def start() -> Iterator[Callable[[Node], LiveRunner]]:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    base = {"vehicle": "test", "bus": {"connect": [], "listen": [endpoint], "health_period_s": 0.2}}
    running: list[tuple[LiveRunner, threading.Thread]] = []

    def run(node: Node) -> LiveRunner:
        bus = dict(base["bus"])  # type: ignore[call-overload]
        if running:
            bus |= {"connect": [endpoint], "listen": ["tcp/127.0.0.1:0"]}
        runner = LiveRunner(node, Settings.model_validate(base | {"bus": bus}), ports={})
        thread = threading.Thread(target=runner.run, daemon=True)
        thread.start()
        runner.endpoint = endpoint  # type: ignore[attr-defined]
        running.append((runner, thread))
        return runner

    yield run
    for runner, _ in running:
        runner.stop()
    for _, thread in running:
        thread.join(5.0)


def wait_for(condition: Callable[[], bool], timeout_s: float = 20.0) -> None:
    deadline_s = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline_s, "it never came about"
        time.sleep(0.01)


def test_frames_and_states_arrive(start: Callable[[Node], LiveRunner]) -> None:
    eye = Eye()
    start(eye)
    start(Camera())
    wait_for(lambda: len(eye.frames) >= 5 and len(eye.calibrations) == 1)
    assert all(value == sequence % 256 for sequence, value in eye.frames)


def test_who_joins_late_gets_the_newest_state(start: Callable[[Node], LiveRunner]) -> None:
    camera = Camera()
    start(camera)
    wait_for(lambda: camera.sequence > 3)
    eye = Eye()
    start(eye)
    wait_for(lambda: len(eye.calibrations) == 1)


def test_what_is_kept_back_leaves_in_the_order_of_its_times_and_says_so(start: Callable[[Node], LiveRunner]) -> None:
    clerk, planner = Clerk(topics.PAD_FIX), Planner()
    start(clerk)
    start(planner)
    wait_for(lambda: len(clerk.kept) >= 25)
    kept = clerk.kept[5:25]
    # One that comes behind a newer one is refused, so it would be missing.
    made_ns = sorted(planner.made_ns)
    first = made_ns.index(kept[0].captured_at_ns)
    assert [fix.captured_at_ns for fix in kept] == made_ns[first : first + 20]
    # A busy machine may make one after its time: then it left when it was made.
    lateness_ns = [fix.hops[-1].published_at_ns - fix.captured_at_ns - 1_000_000 for fix in kept]
    assert min(lateness_ns) == 0
    assert all(fix.hops[-1].received_at_ns <= fix.hops[-1].published_at_ns for fix in kept)


def test_what_is_kept_back_does_not_come_before_its_time(start: Callable[[Node], LiveRunner]) -> None:
    class Punctual(Clerk):
        def keep(self, arrival: Arrival[Any]) -> tuple[()]:
            self.kept.append(arrival.received_at_ns - arrival.message.hops[-1].published_at_ns)
            return ()

    clerk = Punctual(topics.PAD_FIX)
    start(clerk)
    start(Planner())
    wait_for(lambda: len(clerk.kept) >= 20)
    assert min(clerk.kept) > 0


def test_the_journal_waits_for_a_recorder_that_comes_late(start: Callable[[Node], LiveRunner]) -> None:
    start(Ticker())
    time.sleep(0.6)  # two journals are due and nobody listens
    clerk = Clerk(topics.JOURNAL)
    start(clerk)
    wait_for(lambda: len(clerk.kept) >= 2)
    assert [journal.number for journal in clerk.kept[:2]] == [0, 1]
    first = clerk.kept[0]
    assert len(first.entries) >= 10


def test_a_slow_reader_gets_the_newest_frames_and_counts_the_rest(start: Callable[[Node], LiveRunner]) -> None:
    eye, onlooker = Eye(slowness_s=0.1), Onlooker()
    start(onlooker)
    start(eye)
    start(Camera())
    wait_for(lambda: len(eye.frames) >= 8)
    sequences = [sequence for sequence, _ in eye.frames]
    assert sequences == sorted(set(sequences))
    assert sequences[-1] - sequences[0] > len(sequences), "frames in between gave way to newer ones"
    wait_for(lambda: "detector" in onlooker.health and frame_health(onlooker).dropped > 0)


def test_a_picture_is_looked_at_by_whoever_receives_it_unless_it_has_waited(
    far_end: Callable[[Node, Clock], tuple[LiveRunner, Bus]],
) -> None:
    """What has waited goes where a newer one may take its place."""
    clock, watcher = VirtualClock(time.time_ns()), Watcher()
    runner, camera = far_end(watcher, clock)
    thread = threading.Thread(target=runner.run, daemon=True)
    thread.start()

    def thread_that_looks_at(sequence: int) -> int:
        header = FrameHeader(
            captured_at_ns=clock.now_ns() + sequence, sequence=sequence, width_px=8, height_px=4, source="test"
        )
        camera.publish(topics.FRAME, "camera", encode(topics.FRAME, header, bytes(32)))
        wait_for(lambda: sequence in watcher.looked)
        return watcher.looked[sequence]

    wait_for(lambda: camera.is_heard(topics.FRAME, "camera"))
    for sequence in range(50):
        clock.advance_to(clock.now_ns() + 50_000_000)
        if thread_that_looks_at(sequence) != thread.ident:  # unless the runner happened to look around just then
            break
    assert watcher.looked[sequence] != thread.ident
    assert {thread_that_looks_at(sequence) for sequence in range(100, 105)} == {thread.ident}, "no time has passed"
    runner.stop()
    thread.join(5.0)


def test_bad_input_ends_in_the_health_counters_and_nowhere_else(start: Callable[[Node], LiveRunner]) -> None:
    eye, onlooker = Eye(), Onlooker()
    runner = start(onlooker)
    start(eye)
    start(Camera())
    octets = "application/octet-stream;alight.FrameHeader"
    bad = [
        (b"not json", f"{octets}.v{SCHEMA_VERSION}"),
        (None, f"{octets}.v{SCHEMA_VERSION}"),
        (b"{}", f"{octets}.v999"),
        (b"{}", "text/plain"),
    ]
    intruder = zenoh.open(configuration(BusSettings(connect=(runner.endpoint,))))  # type: ignore[attr-defined]

    def complained() -> bool:
        for attachment, encoding in bad:
            intruder.put(topics.FRAME.key("test"), bytes(32), encoding=zenoh.Encoding(encoding), attachment=attachment)
        refused = frame_health(onlooker).refused if "detector" in onlooker.health else {}
        return {"malformed", "wrong_version", "wrong_type"} <= set(refused)

    wait_for(complained)
    before = len(eye.frames)
    wait_for(lambda: len(eye.frames) > before)
    intruder.close()


def test_whoever_receives_may_run_a_quick_node_but_never_two_at_a_time(start: Callable[[Node], LiveRunner]) -> None:
    weigher, clerk, onlooker = Weigher(), Clerk(topics.PAD_ESTIMATE), Onlooker()
    start(onlooker)
    start(clerk)
    start(weigher)
    start(Surveyor())
    wait_for(lambda: len(weigher.taken_ns) >= 300 and weigher.ticks >= 100 and len(weigher.threads) >= 2)
    assert weigher.together == 0
    assert weigher.taken_ns == sorted(set(weigher.taken_ns))
    wait_for(lambda: "filter" in onlooker.health and onlooker.health["filter"].inputs[0].received >= 300)
    assert onlooker.health["filter"].inputs[0].refused == {}, "out of order"
    wait_for(lambda: len(clerk.kept) >= 300)
    assert len(clerk.kept[0].hops) == 1


def test_what_the_bus_raises_ends_the_process_whoever_has_the_turn(
    far_end: Callable[[Node, Clock], tuple[LiveRunner, Bus]], monkeypatch: pytest.MonkeyPatch
) -> None:
    runner, surveyor = far_end(Weigher(), WallClock())
    publish, raised = runner.bus.publish, []

    def fails(topic: Topic[Any], *rest: Any) -> None:
        if topic is topics.PAD_ESTIMATE:
            raise BusError("the line is cut")
        publish(topic, *rest)

    def run() -> None:
        try:
            runner.run()
        except BusError as error:
            raised.append(str(error))

    monkeypatch.setattr(runner.bus, "publish", fails)
    threading.Thread(target=run, daemon=True).start()

    def over() -> bool:
        fix = PadFix(captured_at_ns=time.time_ns(), verdict=FixVerdict.NO_MARKER)
        surveyor.publish(topics.PAD_FIX, "geolocator", encode(topics.PAD_FIX, fix))
        return raised == ["the line is cut"]

    wait_for(over)


def test_silence_is_complained_of(start: Callable[[Node], LiveRunner]) -> None:
    onlooker = Onlooker()
    start(onlooker)
    start(Eye())
    wait_for(
        lambda: any("camera/frame silent" in text for health in onlooker.health.values() for text in health.complaints)
    )


def test_liveliness_shows_who_is_there(start: Callable[[Node], LiveRunner]) -> None:
    seen: dict[str, bool] = {}
    watcher = start(Onlooker())
    watcher.bus.watch_alive(lambda service, alive: seen.update({service: alive}))
    camera = start(Camera())
    wait_for(lambda: seen.get("camera") is True)
    camera.stop()
    wait_for(lambda: seen.get("camera") is False)


def test_each_host_says_how_far_its_peers_clocks_are_off(start: Callable[[Node], LiveRunner]) -> None:
    onlooker = Onlooker()
    start(onlooker)
    start(Eye())
    start(Camera())

    def measured() -> bool:
        clocks = onlooker.health["detector"].clocks if "detector" in onlooker.health else ()
        return any(clock.of == "camera" and clock.offset_s is not None for clock in clocks)

    wait_for(measured)
    (clock,) = (clock for clock in onlooker.health["detector"].clocks if clock.of == "camera")
    assert clock.round_trip_s is not None and clock.offset_s is not None and clock.host
    assert abs(clock.offset_s) <= clock.round_trip_s / 2, "both read the same clock"
    silent = {clock.of for clock in onlooker.health["detector"].clocks if clock.offset_s is None}
    assert "camera" not in silent and not any("clock" in text for text in onlooker.health["detector"].complaints)


def test_an_answer_that_is_none_is_left_out(start: Callable[[Node], LiveRunner]) -> None:
    onlooker = Onlooker()
    runner = start(onlooker)
    start(Eye())
    intruder = zenoh.open(configuration(BusSettings(connect=(runner.endpoint,))))  # type: ignore[attr-defined]
    asked = threading.Event()

    def lie(query: zenoh.Query) -> None:
        query.reply(str(query.key_expr), b"half past four")
        asked.set()

    answering = intruder.declare_queryable(clock_key("test", "camera"), lie)
    assert asked.wait(20.0)
    seen = onlooker.health["detector"].at_ns if "detector" in onlooker.health else 0
    wait_for(lambda: "detector" in onlooker.health and onlooker.health["detector"].at_ns > seen)
    (clock,) = (clock for clock in onlooker.health["detector"].clocks if clock.of == "camera")
    assert clock.offset_s is None and clock.answers == 0
    answering.undeclare()
    intruder.close()


def test_a_busy_port_is_one_clear_line() -> None:
    port = free_port()
    settings = BusSettings(connect=(), listen=(f"tcp/127.0.0.1:{port}",))
    first = Bus("test", settings)
    with pytest.raises(BusError, match=rf"127\.0\.0\.1:{port}.*free one") as error:
        Bus("test", settings)
    assert ".rs:" not in str(error.value)
    first.close()


def test_only_a_port_that_is_taken_is_said_to_be() -> None:
    nobodys = BusSettings(connect=(), listen=("tcp/192.0.2.1:7447",))  # an address for documents
    with pytest.raises(BusError, match=r"; check bus\.listen and bus\.connect") as error:
        Bus("test", nobodys)
    assert ".rs:" not in str(error.value) and "taken" not in str(error.value)


def frame_health(onlooker: Onlooker):
    return next(entry for entry in onlooker.health["detector"].inputs if entry.topic == topics.FRAME.name)
