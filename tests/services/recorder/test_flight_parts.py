"""A recording in several files: rotation, a quota for the old ones, and the seconds before a landing was asked for."""

import fcntl
import json
import os
from pathlib import Path

import pytest
from mcap.reader import make_reader

from alight.runtime.clock import LOCKSTEP_EPOCH_NS, NS_PER_S
from alight.runtime.node import Arrival
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.message import GlobalPosition
from schemas.mission import MissionRequest, Verb
from schemas.settings import Settings
from schemas.truth import GroundTruth
from services.recorder.host import Host
from services.recorder.node import Recorder
from services.recorder.quota import Quota
from services.recorder.service import build, build_live

HOME = GlobalPosition(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=500.0, ellipsoidal_height_m=547.0)


def settings(directory: Path, **recorder: object) -> Settings:
    return Settings.model_validate({"recorder": {"directory": directory, **recorder}})


def truth(at_ns: int) -> GroundTruth:
    return GroundTruth(
        at_ns=at_ns, vehicle_position=HOME, velocity_ned_mps=(0.0, 0.0, 0.0), q_ned_body=(1.0, 0.0, 0.0, 0.0),
        angular_velocity_body_rps=(0.0, 0.0, 0.0), pad_position=HOME, pad_azimuth_rad=0.0,
        vehicle_from_pad_ned_m=(1.0, 2.0, -3.0), touching_ground=False,
    )  # fmt: skip


def give(node, topic, message, at_ns: int) -> None:
    node.on_message(Arrival(topic, message, at_ns, at_ns))


def fly(node, seconds: float, begin_s: float = 0.0) -> None:
    """Ten truths a second, two ticks."""
    for number in range(int(seconds * 10)):
        at_ns = LOCKSTEP_EPOCH_NS + round((begin_s + number / 10) * NS_PER_S)
        give(node, topics.GROUND_TRUTH, truth(at_ns), at_ns)
        if number % 5 == 4:
            node.on_tick(at_ns)


def times_s(path: Path) -> list[float]:
    with path.open("rb") as file:
        return [(message.log_time - LOCKSTEP_EPOCH_NS) / NS_PER_S for *_, message in make_reader(file).iter_messages()]


def metadata(path: Path, name: str) -> dict[str, str]:
    with path.open("rb") as file:
        return next(entry.metadata for entry in make_reader(file).iter_metadata() if entry.name == name)


def attachments(path: Path) -> dict[str, bytes]:
    with path.open("rb") as file:
        return {entry.name: entry.data for entry in make_reader(file).iter_attachments()}


def test_a_recording_goes_on_in_the_next_file_after_a_time(tmp_path):
    node = build(settings(tmp_path, rotate_s=2.0))
    fly(node, 5.0)
    node.close()
    parts = [times_s(tmp_path / name) for name in ("flight.mcap", "flight_2.mcap", "flight_3.mcap")]
    assert [part[0] for part in parts] == [0.0, 2.0, 4.0]
    assert [at_s for part in parts for at_s in part] == [number / 10 for number in range(50)]
    assert metadata(tmp_path / "flight_2.mcap", "beginning") == {"reason": "rotated", "part": "2", "lost_before": "0"}
    assert metadata(tmp_path / "flight.mcap", "ending")["messages"] == "20"


def test_a_recording_goes_on_in_the_next_file_after_a_size(tmp_path):
    node = build(settings(tmp_path, rotate_mb=0.05, compression="none", chunk_bytes=4096))
    fly(node, 5.0)
    node.close()
    assert [len(times_s(path)) for path in sorted(tmp_path.glob("*.mcap"))] == [10] * 5  # no shorter than a second


def test_each_part_carries_what_explains_it(tmp_path):
    layout = tmp_path / "pad.toml"
    layout.write_text("# a pad of my own")
    wanted = {"recorder": {"directory": tmp_path, "rotate_s": 1.0}, "pad": {"layout": str(layout)}}
    node = build(Settings.model_validate(wanted))
    camera = {"width_px": 640, "height_px": 480, "fx_px": 300.0, "fy_px": 300.0, "cx_px": 320.0, "cy_px": 240.0}
    for second in range(3):  # the same calibration again and again is one document
        at_ns = LOCKSTEP_EPOCH_NS + second * NS_PER_S // 2
        give(node, topics.CALIBRATION, CameraCalibration(at_ns=at_ns, **camera), at_ns)
    fly(node, 2.0, begin_s=2.0)
    node.close()
    for name in ("flight.mcap", "flight_2.mcap"):
        found = attachments(tmp_path / name)
        assert set(found) == {"settings.json", "pad.json", "correction.json", "calibration.json", "pad.toml"}
        assert json.loads(found["calibration.json"])["fx_px"] == 300.0
        assert json.loads(found["correction.json"])["method"] == "none"
        assert found["pad.toml"] == b"# a pad of my own"


def test_parts_repeat_to_the_byte(tmp_path):
    for folder in ("one", "two"):
        fly(node := build(settings(tmp_path / folder, rotate_s=1.0)), 2.0)
        node.close()
    for name in ("flight.mcap", "flight_2.mcap"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def ask(node, verb: Verb, at_s: float) -> None:
    at_ns = LOCKSTEP_EPOCH_NS + int(at_s * NS_PER_S)
    give(node, topics.REQUEST, MissionRequest(at_ns=at_ns, request_id="1", verb=verb), at_ns)


def test_only_the_seconds_before_a_landing_was_asked_for_are_kept(tmp_path):
    node = build(settings(tmp_path, pre_trigger_s=2.0))
    fly(node, 10.0)
    ask(node, Verb.HOLD, 10.0)
    assert not list(tmp_path.glob("*.mcap"))
    ask(node, Verb.LAND, 10.1)
    fly(node, 1.0, begin_s=10.2)
    node.close()
    kept = times_s(tmp_path / "flight.mcap")
    assert kept[0] == pytest.approx(8.1) and kept[-1] == pytest.approx(11.1)
    assert len(kept) == 19 + 2 + 10
    assert node.counters()["not_wanted"] == 81


def test_the_seconds_before_a_landing_take_no_more_memory_than_allowed(tmp_path):
    node = build(settings(tmp_path, pre_trigger_s=600.0, pre_trigger_mb=1.0))
    fly(node, 400.0)
    ask(node, Verb.LAND, 400.0)
    node.close()
    kept = times_s(tmp_path / "flight.mcap")
    assert len(kept) < 4000 and kept[-1] == 400.0


def test_a_flight_without_a_landing_leaves_no_file(tmp_path):
    fly(node := build(settings(tmp_path, pre_trigger_s=1.0)), 3.0)
    node.close()
    assert not list(tmp_path.iterdir())


def recorded(folder: Path, age: int) -> Path:
    """An old recording of a second; the higher its age, the older."""
    fly(node := build(settings(folder)), 1.0)
    node.close()
    at_ns = 1_700_000_000 * NS_PER_S - age * NS_PER_S
    os.utime(folder / "flight.mcap", ns=(at_ns, at_ns))
    return folder / "flight.mcap"


def test_the_oldest_recordings_go_first_and_nothing_that_is_not_ours(tmp_path):
    old = [recorded(tmp_path / name, age) for name, age in (("c", 1), ("a", 3), ("b", 2))]
    foreign = tmp_path / "a" / "other.mcap"
    foreign.write_bytes(b"\x89MCAP0\r\n" + bytes(10**6))
    (tmp_path / "b" / "report.html").write_text("mine")
    size = old[0].stat().st_size
    node = build(settings(tmp_path / "now", quota_mb=2.4 * size / 1e6))
    fly(node, 1.0)
    node.close()
    assert old[0].exists() and not old[1].exists() and not old[2].exists()
    assert foreign.exists() and (tmp_path / "b" / "report.html").exists() and (tmp_path / "now/flight.mcap").exists()


def test_what_another_recorder_writes_now_stays(tmp_path):
    one, other = recorded(tmp_path / "one", 2), recorded(tmp_path / "other", 1)
    with one.open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        Quota(tmp_path / "now", 1).look(0)
    assert one.exists() and not other.exists() and not other.parent.exists()


def test_a_recording_longer_than_the_quota_goes_on_and_says_so(tmp_path):
    node = build(settings(tmp_path / "now", quota_mb=0.005))
    fly(node, 3.0)
    assert node.complaints(LOCKSTEP_EPOCH_NS) == ("this recording alone is longer than recorder.quota_mb",)
    node.close()
    assert len(times_s(tmp_path / "now/flight.mcap")) == 30


def test_live_the_hosts_name_and_clocks_stand_in_the_file(tmp_path):
    node = build_live(settings(tmp_path))
    assert isinstance(node, Recorder)
    at_ns = Host().now_ns()
    give(node, topics.GROUND_TRUTH, truth(at_ns), at_ns)
    node.on_tick(at_ns)
    node.close()
    with (tmp_path / "flight.mcap").open("rb") as file:
        begun, ended = (entry.metadata for entry in make_reader(file).iter_metadata() if entry.name == "host")
    assert begun["hostname"] == os.uname().nodename
    assert int(ended["wall_ns"]) > int(begun["wall_ns"]) and int(ended["monotonic_ns"]) > int(begun["monotonic_ns"])
    assert node.counters()["recorded"] == 1 and node.counters()["lag_max_us"] > 0


def test_in_lockstep_no_clock_of_the_host_is_in_the_file(tmp_path):
    build(settings(tmp_path)).close()
    with (tmp_path / "flight.mcap").open("rb") as file:
        assert {entry.name for entry in make_reader(file).iter_metadata()} == {"alight", "beginning", "ending"}
