"""A recorded flight through the nodes of today."""

import json
import math
from collections.abc import Iterable
from pathlib import Path

import pytest
from replay_stage import CHAIN, altered, fly_short, stand_short

from schemas import topics
from schemas.journal import Journal
from schemas.message import Message
from services.filter import averaging
from station.__main__ import main
from station.mcap_parts import StoredMessage
from station.replay import reference
from station.replay.error import ReplayError
from station.replay.explanation import explanation
from station.replay.recording import ReplayRecording
from station.replay.replay import replay
from station.replay.result import Origin
from station.replay.score import Scorer
from station.replay.text import result_lines
from station.replay.tolerance import EXACT


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly_short(tmp_path_factory.mktemp("flight"), "filter.method=median")


@pytest.fixture
def recording(flight: Path) -> ReplayRecording:
    return ReplayRecording(flight)


def as_it_is(stored: StoredMessage) -> Iterable[Message]:
    yield stored.message()


def test_every_message_of_the_chain_is_repeated_to_the_last_bit(recording: ReplayRecording) -> None:
    result = replay(recording, CHAIN)
    assert result.equal and result.tolerances == "exact"
    compared = {name: count.same for name, count in result.counts.items()}
    for topic in (topics.DETECTION, topics.PAD_FIX, topics.PAD_ESTIMATE, topics.VEHICLE_STATE, topics.SETPOINT):
        assert compared[topic.name] == len(recording.of(topic)) > 0
    assert compared[topics.REPLY.name] == 2
    assert not result.remarks and not result.absent


@pytest.mark.parametrize("service", CHAIN)
def test_each_node_can_be_replayed_alone(recording: ReplayRecording, service: str) -> None:
    assert replay(recording, (service,)).equal


def test_one_ulp_in_a_constant_is_caught_and_explained(
    recording: ReplayRecording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(averaging, "MEDIAN_INEFFICIENCY", math.nextafter(averaging.MEDIAN_INEFFICIENCY, 2.0))
    result = replay(recording, ("geolocator", "filter", "commander"))
    assert not result.equal
    assert result.counts[topics.PAD_FIX.name].equal
    first = result.first_divergence
    assert first is not None and first.topic == topics.PAD_ESTIMATE.name
    assert first.message.stamp_ns == recording.of(topics.PAD_ESTIMATE)[0].stamp_ns
    assert {difference.path.split("[")[0] for difference in first.differences} <= {
        "covariance_ned_m2",
        "azimuth_variance_rad2",
    }
    assert min(difference.ulps or 0 for difference in first.differences) <= 2
    told = "\n".join(explanation(result))
    assert "first divergence: filter/estimate of" in told
    assert "geolocator/fix" in told and "replayed, the same as recorded" in told
    assert "so the filter itself has changed" in told


def test_another_filter_is_scored_beside_the_one_that_flew(recording: ReplayRecording) -> None:
    result = replay(recording, ("filter", "commander"), ["filter.method=mean", "filter.window_length=5"])
    scorer = Scorer(recording)
    recorded, replayed = scorer.recorded(), scorer.replayed(result)
    assert recorded.reference == "the ground truth"
    assert recorded.fixes == replayed.fixes and recorded.detection_rate == replayed.detection_rate == 1.0
    assert recorded.estimate_rmse_m is not None and 0.0 < recorded.estimate_rmse_m < 0.1
    assert replayed.estimate_rmse_m is not None and replayed.estimate_rmse_m != recorded.estimate_rmse_m
    assert replayed.estimates < recorded.estimates
    assert result.counts[topics.PAD_ESTIMATE.name].missing > 0


def test_a_message_that_there_was_not_in_flight_reaches_its_readers(recording: ReplayRecording) -> None:
    result = replay(recording, ("filter", "commander"), ["filter.window_length=2"])
    additional = [o for o in result.of(topics.PAD_ESTIMATE.name) if o.origin is Origin.ADDITIONAL]
    assert additional
    (life,) = result.given["commander"]
    given = {entry.stamp_ns: entry for entry in life.entries if entry.source == topics.PAD_ESTIMATE.name}
    heard = [output for output in additional if output.message.stamp_ns in given]
    assert heard
    # The virtual durations of lockstep: 0.2 ms in the filter, 0.5 ms on the way.
    delays_ns = {given[output.message.stamp_ns].now_ns - output.entry.now_ns for output in heard}
    assert delays_ns == {700_000}


def test_a_picture_that_was_not_kept_is_named_and_the_recorded_detection_stands_in(
    recording: ReplayRecording, tmp_path: Path
) -> None:
    # The last one: a detector that follows the pad begins from the frame before, so later ones would differ in their last digits.
    lost_ns = recording.of(topics.FRAME)[-1].stamp_ns
    gappy = altered(recording, tmp_path / "gappy.mcap", as_it_is, lambda captured_at_ns: captured_at_ns != lost_ns)
    result = replay(gappy, ("detector", "geolocator", "filter"))
    assert result.counts[topics.DETECTION.name].stand_in == 1
    assert result.counts[topics.PAD_FIX.name].equal and result.counts[topics.PAD_ESTIMATE.name].equal
    assert "1 messages of camera/frame/image that the nodes were given are not in the recording" in "\n".join(
        result_lines(result)
    )


def test_on_the_ground_the_detector_rests_as_it_did_though_only_every_other_picture_was_kept(tmp_path: Path) -> None:
    standing = ReplayRecording(stand_short(tmp_path))
    frames, detections = len(standing.of(topics.FRAME)), len(standing.of(topics.DETECTION))
    assert len(standing.pictures.times_ns) < detections < frames
    result = replay(standing, CHAIN)
    assert result.equal, list(explanation(result))
    count = result.counts[topics.DETECTION.name]
    assert count.stand_in > 0 and count.same + count.tolerated > 0


def test_where_pictures_are_left_out_on_purpose_what_follows_from_them_is_compared_with_tolerances(
    tmp_path: Path,
) -> None:
    thinned = ReplayRecording(fly_short(tmp_path, "recorder.frame_rate_hz=2"))
    result = replay(thinned, CHAIN)
    assert result.tolerances == "lossy pictures" and result.equal
    # A detector that follows the pad begins elsewhere than in flight: that is no change of the detector.
    exactly = replay(thinned, CHAIN, tolerances=EXACT)
    assert not exactly.equal
    assert "itself has changed" not in "\n".join(explanation(exactly))


def test_a_missing_journal_is_named_and_what_it_told_of_is_not_compared(
    recording: ReplayRecording, tmp_path: Path
) -> None:
    def without_the_second(stored: StoredMessage) -> Iterable[Message]:
        message = stored.message()
        if not (isinstance(message, Journal) and message.service == "geolocator" and message.number == 1):
            yield message

    result = replay(altered(recording, tmp_path / "gap.mcap", without_the_second), ("geolocator",))
    assert any("journal 1 of the geolocator missing" in remark for remark in result.remarks)
    assert result.counts[topics.PAD_FIX.name].uncovered >= 1
    assert result.counts[topics.PAD_FIX.name].missing == 0


def test_a_service_that_was_started_again_has_forgotten_everything(recording: ReplayRecording, tmp_path: Path) -> None:
    half = len(recording.journals("geolocator")) // 2

    def restarted(stored: StoredMessage) -> Iterable[Message]:
        message = stored.message()
        if isinstance(message, Journal) and message.service == "geolocator" and message.number >= half:
            begin_ns = recording.journals("geolocator")[half][0].entries[0].now_ns
            message = message.model_copy(update={"started_at_ns": begin_ns, "number": message.number - half})
        yield message

    result = replay(altered(recording, tmp_path / "restart.mcap", restarted), ("geolocator",))
    first = result.first_divergence
    assert first is not None
    # Until it hears the vehicle and the camera again it can say nothing.
    (verdict,) = (difference for difference in first.differences if difference.path == "verdict")
    assert verdict.recorded == "accepted" and verdict.replayed in ("no_calibration", "no_vehicle_state")
    assert list(result.of(topics.PAD_FIX.name))[-1].equal


def test_without_journals_the_order_of_logging_is_followed_and_said_to_be_inexact(
    recording: ReplayRecording, tmp_path: Path
) -> None:
    def no_journals(stored: StoredMessage) -> Iterable[Message]:
        if stored.topic is not topics.JOURNAL:
            yield stored.message()

    older = altered(recording, tmp_path / "older.mcap", no_journals)
    result = replay(older, ("detector", "geolocator", "filter"))
    assert result.equal
    assert any("no journal of the geolocator" in remark and "not exact" in remark for remark in result.remarks)
    with pytest.raises(ReplayError, match="no journal of the commander"):
        replay(older, ("commander",))


def test_a_recorded_setting_that_this_version_has_not_is_left_out_and_named(
    recording: ReplayRecording, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = json.loads(json.dumps(recording.settings))
    table["filter"]["gate"]["fringe"] = 3
    recording.settings = table
    result = replay(recording, ("filter",))
    assert result.equal
    assert any("filter.gate.fringe" in remark for remark in result.remarks)


def test_update_lets_a_recording_expect_what_the_nodes_say_today(
    flight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.mcap"
    mine.write_bytes(flight.read_bytes())
    assert main(["replay", str(mine), "--update", "--yes"]) == 0
    assert mine.read_bytes() == flight.read_bytes(), "nothing to write, nothing written"
    assert main(["replay", str(mine), "--update", "--yes", "--set", "filter.method=mean"]) == 0
    assert "filter/estimate" in capsys.readouterr().out
    assert main(["replay", str(mine), "--through", ",".join(CHAIN)]) == 0
    assert ReplayRecording(mine).settings["filter"]["method"] == "mean"


def test_update_asks_first_and_leaves_the_file_alone_where_nobody_answers(flight: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine.mcap"
    mine.write_bytes(flight.read_bytes())
    assert main(["replay", str(mine), "--update", "--set", "filter.method=mean"]) == 2
    assert mine.read_bytes() == flight.read_bytes()


def test_the_command_says_by_its_status_whether_the_flight_is_repeated(
    flight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["replay", str(flight), "--through", "geolocator,filter"]) == 0
    assert "equal to the last bit" in capsys.readouterr().out
    monkeypatch.setattr(averaging, "MEDIAN_INEFFICIENCY", 2.0)
    assert main(["replay", str(flight), "--through", "geolocator,filter", "--json", "--report", str(tmp_path)]) == 1
    outcome = json.loads(capsys.readouterr().out)
    assert outcome["first_divergence"]["topic"] == "filter/estimate"
    assert outcome["topics"]["geolocator/fix"]["different"] == 0
    page = (tmp_path / "replay.html").read_text()
    assert "<svg" in page and "data:image/jpeg;base64," in page and "covariance_ned_m2" in page
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_wrong_use_is_answered_in_a_line(flight: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(flight), "--through", "camera"]) == 2
    assert main(["replay", str(flight), "--through", "filter", "--set", "filter.metod=mean"]) == 2
    assert main(["replay", "nowhere.mcap", "--through", "filter"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert "name some of detector,geolocator,filter,commander" in lines[0]
    assert "did you mean filter.method?" in lines[1]
    assert "no such recording" in lines[2]


def test_of_an_older_recording_only_what_it_had_is_compared() -> None:
    older = ReplayRecording(Path(__file__).parent / "recordings" / "version_1.mcap")
    result = replay(older, ("geolocator", "filter"))
    assert older.older
    fixes = result.counts[topics.PAD_FIX.name]
    assert fixes.same + fixes.tolerated + fixes.different == len(older.of(topics.PAD_FIX)) > 0
    assert result.counts[topics.FUSION.name].additional == 0
    compared = [difference for output in result.of(topics.PAD_FIX.name) for difference in output.differences]
    assert all(difference.recorded is not None for difference in compared)


def test_a_part_of_a_recording_becomes_a_flight_of_its_own(
    flight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert reference.main([str(tmp_path), "--of", str(flight), "--from", "2", "--to", "4", "--name", "part"]) == 0
    assert "equal to the last bit" in capsys.readouterr().out
    part = ReplayRecording(tmp_path / "part.mcap")
    frames = part.of(topics.FRAME)
    assert 7 <= len(frames) <= 9 and len(part.pictures.times_ns) == len(frames)
    assert replay(part, CHAIN).equal


def test_lossy_pictures_are_compared_with_tolerances(tmp_path: Path) -> None:
    lossy = ReplayRecording(fly_short(tmp_path, "recorder.frames=jpeg", "recorder.jpeg_quality=80"))
    result = replay(lossy, ("detector", "geolocator", "filter"))
    assert result.tolerances == "lossy pictures"
    assert result.counts[topics.DETECTION.name].tolerated > 0
    assert result.equal
    assert not replay(lossy, ("detector",), tolerances=EXACT).equal
