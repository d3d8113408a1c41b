"""A live flight, every service a process of its own, replayed to the last bit."""

import math
from pathlib import Path

import pytest
from flight_process import flight

from schemas import topics
from services.detector.aided import alignment
from station.__main__ import main
from station.replay.recording import ReplayRecording
from station.replay.replay import replay
from station.replay.result import Origin

pytestmark = pytest.mark.system

LOW = ("--set", "simulator.airborne={north_m=1.5, east_m=1.0, down_m=-5.0}")
LOSSLESS = ("--set", "recorder.frames=raw", "--set", "camera.rate_hz=15")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("flight") / "flight"
    with flight(out, [*LOW, *LOSSLESS]) as running:
        assert running.wait() == 0, running.output
    return out


def test_a_live_flight_is_repeated_to_the_last_bit(recorded: Path) -> None:
    recording = ReplayRecording(recorded)
    result = replay(recording, ("detector", "geolocator", "filter", "commander"))
    assert result.equal, result.first_divergence
    assert result.tolerances == "exact"
    for topic in (topics.DETECTION, topics.PAD_FIX, topics.PAD_ESTIMATE, topics.SETPOINT, topics.VEHICLE_STATE):
        count = result.counts[topic.name]
        unheard = sum(output.origin is Origin.UNHEARD for output in result.of(topic.name))
        # A frame that the detector had and the recorder had not is rare, and said.
        assert count.same + count.stand_in + count.uncovered - unheard == len(recording.of(topic))
        assert count.same >= 0.95 * len(recording.of(topic)) > 0


def test_the_comparison_finds_one_ulp_in_a_constant_of_the_detector(
    recorded: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    changed = math.nextafter(alignment._HANG_TOGETHER, 1.0)
    monkeypatch.setattr(alignment, "_HANG_TOGETHER", changed)
    assert main(["replay", str(recorded), "--through", "detector,geolocator,filter"]) == 1
    told = capsys.readouterr().out
    assert "first divergence: detector/detection of" in told
    # Not `corner_sigma_px`: a root halves what its square differs by, and may be rounded to the same number.
    assert "pad.poses[0].covariance[" in told and " ulp" in told
    assert "it was given camera/frame of" in told
    assert "so the detector itself has changed" in told
