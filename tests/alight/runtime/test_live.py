"""Nodes live, on a bus of their own on the loopback: delivery classes, late joiners, bad input, health."""

import socket
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
import zenoh

from alight.runtime.bus import Bus, BusError, configuration
from alight.runtime.clock_questions import clock_key
from alight.runtime.live import LiveRunner
from alight.runtime.node import Arrival, Node, Output, Publication
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.frame import FrameHeader
from schemas.health import Health
from schemas.journal import Journal
from schemas.message import SCHEMA_VERSION
from schemas.settings import Settings
from schemas.settings.bus import BusSettings


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
    """Keeps the journals of all services."""

    service = "recorder"

    def __init__(self) -> None:
        super().__init__()
        self.journals: list[Journal] = []
        self.subscribe(topics.JOURNAL, self.on_journal)

    def on_journal(self, arrival: Arrival[Journal]) -> tuple[()]:
        self.journals.append(arrival.message)
        return ()


class Ticker(Node):
    """Does nothing but look at the time."""

    service = "filter"
    tick_period_ns = 20_000_000


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


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


def test_the_journal_waits_for_a_recorder_that_comes_late(start: Callable[[Node], LiveRunner]) -> None:
    start(Ticker())
    time.sleep(0.6)  # two journals are due and nobody listens
    clerk = Clerk()
    start(clerk)
    wait_for(lambda: len(clerk.journals) >= 2)
    assert [journal.number for journal in clerk.journals[:2]] == [0, 1]
    first = clerk.journals[0]
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
    with pytest.raises(BusError, match=rf"127\.0\.0\.1:{port}.*free one"):
        Bus("test", settings)
    first.close()


def frame_health(onlooker: Onlooker):
    return next(entry for entry in onlooker.health["detector"].inputs if entry.topic == topics.FRAME.name)
