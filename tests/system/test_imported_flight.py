"""A flight of which only the MAVLink link and the pictures are left: imported, and replayed through the nodes, it finds the pad."""

import base64
from pathlib import Path

import cv2
import numpy as np
import pytest

from alight.runtime.settings_file import load_settings
from schemas import topics
from schemas.journal import EntryKind
from station.__main__ import main
from station.director import FlightPlan
from station.flight_record import FlightRecord, read_flight
from station.lockstep_flight import fly_lockstep
from station.replay.recording import ReplayRecording
from station.replay.replay import replay

pytestmark = pytest.mark.system

BESIDE_PAYLOAD = {0xFE: 8, 0xFD: 12}


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> FlightRecord:
    out = tmp_path_factory.mktemp("flown")
    airborne = "simulator.airborne={north_m=3.0, east_m=2.0, down_m=-8.0}"
    kept = ("recorder.jpeg_quality=95", "lockstep.picture_rate_hz=0", f"recorder.directory={out}")
    outcome = fly_lockstep(load_settings(None, {}, [airborne, *kept]), FlightPlan(takeoff_to_ned_m=None))
    assert outcome.failure is None
    return read_flight(out)


def telemetry_log(record: FlightRecord, path: Path) -> Path:
    """What a logger on the companion's link would have written: every packet of the autopilot with the time of its arrival."""
    log = bytearray()
    for journal in record.messages(topics.JOURNAL):
        for entry in journal.entries if journal.service == "commander" else ():
            data = base64.b64decode(entry.data) if entry.kind is EntryKind.BYTES else b""
            while data:
                end = data[1] + BESIDE_PAYLOAD[data[0]]
                log += (entry.now_ns // 1000).to_bytes(8, "big") + data[:end]
                data = data[end:]
    path.write_bytes(log)
    return path


def film(record: FlightRecord, video: Path, stamps: Path) -> None:
    """The recorded pictures as a video, and a table of when each was taken."""
    writer = cv2.VideoWriter(str(video), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (640, 480))
    writer.set(cv2.VIDEOWRITER_PROP_QUALITY, 95.0)
    for captured_at_ns in record.picture_times_ns:
        writer.write(cv2.cvtColor(record.picture(captured_at_ns), cv2.COLOR_GRAY2BGR))
    writer.release()
    stamps.write_text("captured_at_ns\n" + "".join(f"{at_ns}\n" for at_ns in record.picture_times_ns))


def test_log_and_video_alone_say_what_the_flights_own_recording_says(flown: FlightRecord, tmp_path: Path) -> None:
    log = telemetry_log(flown, tmp_path / "link.tlog")
    video, stamps = tmp_path / "video.avi", tmp_path / "frames.csv"
    film(flown, video, stamps)
    imported = tmp_path / "imported.mcap"
    words = ("--video", video, "--stamps", stamps, "--out", imported)
    assert main(["recording", "import", str(log), *map(str, words)]) == 0

    # The log's times are whole microseconds; everything else of the poses came over the same link.
    states = read_flight(imported).messages(topics.VEHICLE_STATE)
    was = {state.at_ns // 1_000_000: state for state in flown.messages(topics.VEHICLE_STATE)}
    same = [(state, was[at_ms]) for state in states if (at_ms := (state.at_ns + 2000) // 1_000_000) in was]
    assert len(same) > 0.97 * len(was)
    for state, recorded in same:
        assert state.position == recorded.position
        assert state.velocity_ned_mps == recorded.velocity_ned_mps

    result = replay(ReplayRecording(imported), ("detector", "geolocator", "filter"))
    recorded_fixes = {fix.captured_at_ns: fix for fix in flown.messages(topics.PAD_FIX)}
    errors_m = []
    for output in result.of(topics.PAD_FIX.name):
        fix, recorded_fix = output.message, recorded_fixes.get(output.message.captured_at_ns)
        if recorded_fix is None:
            continue  # the flight was over before the last frame was located
        assert (fix.corrected is None) == (recorded_fix.corrected is None)
        if fix.corrected is not None:
            errors_m.append(np.subtract(fix.corrected.pad_ned_m, recorded_fix.corrected.pad_ned_m))
    assert len(errors_m) == sum(fix.corrected is not None for fix in recorded_fixes.values()) > 100
    # The pictures were compressed twice.
    assert np.abs(errors_m).max() < 0.03
    assert np.median(np.abs(errors_m), axis=0).max() < 0.003
    assert sum(1 for _ in result.of(topics.PAD_ESTIMATE.name)) > 20
