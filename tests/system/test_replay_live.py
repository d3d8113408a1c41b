"""A recorded flight, republished, feeds live services; what they make of it agrees with what was recorded."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from flight_process import REPOSITORY, free_port

from alight.runtime.bus import Bus
from alight.runtime.settings_file import load_settings
from schemas import topics
from schemas.detection import Detection
from schemas.fix import FixVerdict, PadFix
from schemas.settings import Settings
from schemas.topics import Topic
from schemas.wire import decode
from station.director import FlightPlan
from station.flight_record import FlightRecord, read_flight
from station.lockstep_flight import fly_lockstep

pytestmark = pytest.mark.system

FED = ("detector", "geolocator", "filter")
FROM_S, TO_S = 2.0, 8.0


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lockstep landing of which every picture was kept without loss."""
    out = tmp_path_factory.mktemp("flight")
    airborne = "simulator.airborne={north_m=3.0, east_m=2.0, down_m=-8.0}"
    kept = ("recorder.frames=png", "lockstep.picture_rate_hz=0", f"recorder.directory={out}")
    outcome = fly_lockstep(load_settings(None, {}, [airborne, *kept]), FlightPlan(takeoff_to_ned_m=None))
    assert outcome.failure is None
    return out


@contextlib.contextmanager
def started(*words: str, log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A process of ours, ended in any case."""
    with log.open("wb") as sink:
        command = [sys.executable, "-u", "-m", *words]
        process = subprocess.Popen(command, cwd=REPOSITORY, stdout=sink, stderr=subprocess.STDOUT)
        try:
            yield process
        finally:
            if process.poll() is None:
                os.kill(process.pid, signal.SIGTERM)
                process.wait(20.0)


class Ear:
    """Keeps what is said on the bus, by topic."""

    def __init__(self, settings: Settings, *wanted: Topic) -> None:
        self.heard: dict[str, list] = {topic.name: [] for topic in wanted}
        self.refused: list[str] = []
        self._bus = Bus(settings.vehicle, settings.bus)
        self._lock = threading.Lock()
        for topic in wanted:
            self._bus.subscribe(topic, self._take)

    def _take(self, topic: Topic, payload: bytes, attachment: bytes | None, encoding: str) -> None:
        with self._lock:
            self.heard[topic.name].append(decode(topic, payload, attachment, encoding))

    def close(self) -> None:
        self._bus.close()


def accepted(record: FlightRecord) -> dict[int, PadFix]:
    """The recorded fixes by the number of their frame."""
    sequence = {detection.captured_at_ns: detection.frame_sequence for detection in record.messages(topics.DETECTION)}
    fixes = record.messages(topics.PAD_FIX)
    return {sequence[fix.captured_at_ns]: fix for fix in fixes if fix.verdict is FixVerdict.ACCEPTED}


def test_live_services_make_of_a_replayed_flight_what_they_made_of_it_in_flight(flown: Path, tmp_path: Path) -> None:
    endpoint = f'bus.connect=["tcp/127.0.0.1:{free_port()}"]'
    replay = ("station", "replay", str(flown), "--from", str(FROM_S), "--to", str(TO_S), "--wait-for", ",".join(FED))
    with contextlib.ExitStack() as stack:
        for service in FED:
            stack.enter_context(started(f"services.{service}", "--set", endpoint, log=tmp_path / f"{service}.log"))
        ear = Ear(load_settings(None, {}, [endpoint]), topics.DETECTION, topics.PAD_FIX, topics.PAD_ESTIMATE)
        stack.callback(ear.close)
        with started(*replay, "--set", endpoint, log=tmp_path / "replay.log") as replaying:
            status = replaying.wait(60.0)
    said = (tmp_path / "replay.log").read_text()
    assert status == 0, said
    assert "the geolocator on this bus publishes it" in said

    record = read_flight(flown)
    recorded = accepted(record)
    detections: list[Detection] = ear.heard[topics.DETECTION.name]
    sequence = {detection.captured_at_ns: detection.frame_sequence for detection in detections}
    fixes = [fix for fix in ear.heard[topics.PAD_FIX.name] if fix.verdict is FixVerdict.ACCEPTED]
    first_ns = min(log[0].logged_at_ns for topic in topics.TOPICS if (log := record.logged(topic)))
    expected = sum(FROM_S + 0.5 < (fix.captured_at_ns - first_ns) / 1e9 < TO_S - 0.1 for fix in recorded.values())
    assert len(detections) > 40
    assert len(fixes) >= expected
    errors_m = np.array(
        [
            np.subtract(fix.corrected.pad_ned_m, recorded[sequence[fix.captured_at_ns]].corrected.pad_ned_m)
            for fix in fixes
        ]
    )
    # The same pictures and the same poses; only when each pose came before its frame is not the same to the millisecond.
    assert np.abs(errors_m).max() < 0.05
    assert np.median(np.linalg.norm(errors_m, axis=1)) < 0.005
    assert len(ear.heard[topics.PAD_ESTIMATE.name]) > 0
