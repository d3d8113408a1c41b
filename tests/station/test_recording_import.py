"""Flights of other programs: PX4's logs and MAVLink telemetry logs with videos become recordings like our own."""

import os
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ulog_file import UlogFile

from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.rotation import quaternion_from_euler
from alight.runtime.clock import NS_PER_S, nanoseconds, seconds
from schemas import topics
from schemas.message import GlobalPosition
from schemas.settings import Settings
from schemas.vehicle import FlightMode, LandedState, VehicleState
from station.__main__ import main
from station.flight_record import read_flight
from station.recording_import.euler_attitude import with_quaternions
from station.recording_import.mavlink_vehicle import mavlink_vehicle
from station.recording_import.source_error import SourceError
from station.recording_import.stamps import moment_ns, stamps_at_rate, stamps_from_table
from station.recording_import.tlog import read_tlog
from station.recording_import.ulog_vehicle import ulog_vehicle

SHARED = Path(__file__).resolve().parents[3] / "shared"
PX4_LOGS = sorted(Path(os.environ.get("ALIGHT_PX4_LOGS", SHARED / "px4" / "logs")).glob("0[17][_a]*.tlog"))
REAL = SHARED / "real"
needs_px4_logs = pytest.mark.skipif(not PX4_LOGS, reason="no recorded PX4 flights (set ALIGHT_PX4_LOGS)")
needs_real = pytest.mark.skipif(not REAL.is_dir(), reason="no real material beside the repository")

GPS_UTC_US = 1_790_000_000_000_000
BOOT_US = 20_000_000
HOME = GlobalPosition(
    latitude_deg=47.397742, longitude_deg=8.545594, altitude_amsl_m=488.0, ellipsoidal_height_m=535.25
)


def run_import(*words: object) -> int:
    return main(["recording", "import", *map(str, words)])


# A flight that PX4 logged: a circle, sinking ---------------------------------------------------------------------------


def where(t_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Position from home and velocity, NED."""
    angle, rate = 0.8 * t_s, 0.8
    position = np.array([5 * np.cos(angle), 5 * np.sin(angle), -20 + 0.5 * t_s])
    return position, np.array([-5 * rate * np.sin(angle), 5 * rate * np.cos(angle), 0.5])


def attitude(t_s: float) -> tuple[float, float, float, float]:
    return quaternion_from_euler(0.1 * np.sin(t_s), 0.05, 0.3 * t_s)


def px4_log(path: Path, seconds_long: float = 10.0, *, gps: bool = True, gimbal: bool = False) -> Path:
    """At the rates of PX4's default logging profile: positions at 5 Hz, attitudes at 50 Hz."""
    log = UlogFile(BOOT_US)
    for number in range(round(seconds_long * 50)):
        t_s = number / 50
        boot_us = BOOT_US + round(t_s * 1e6)
        log.add("vehicle_attitude", boot_us, *attitude(t_s))
        if number % 5 == 0:
            log.add("vehicle_local_position", boot_us, *where(t_s)[1])
            log.add("vehicle_angular_velocity", boot_us, 0.1 * np.cos(t_s), 0.0, 0.3)
            if gimbal:
                log.add("gimbal_device_attitude_status", boot_us, *quaternion_from_euler(0.0, -np.pi / 2, 0.0), 0)
        if number % 10 == 0:
            place = moved_by_ned(HOME, where(t_s)[0])
            log.add(
                "vehicle_global_position", boot_us, place.latitude_deg, place.longitude_deg, place.altitude_amsl_m,
                place.ellipsoidal_height_m,
            )  # fmt: skip
        if number % 25 == 0:
            log.add("vehicle_status", boot_us, 2, 14 if t_s < 8 else 18, False)
            log.add("vehicle_land_detected", boot_us, t_s > 9)
            log.add("battery_status", boot_us, 0.75)
            log.add("home_position", boot_us, HOME.latitude_deg, HOME.longitude_deg, HOME.altitude_amsl_m)
            if gps:
                delay_us = 90_000 + 1000 * (number % 7)
                log.add("vehicle_gps_position", boot_us + delay_us, GPS_UTC_US + round(t_s * 1e6), 3)
    return log.write(path)


def test_poses_of_a_px4_log_are_where_the_vehicle_was_between_its_samples(tmp_path):
    heard = list(ulog_vehicle(px4_log(tmp_path / "log.ulg"), Settings()).heard)
    states = [one.message for one in heard if one.topic is topics.VEHICLE_STATE]
    assert len(states) > 450, "one for each attitude"
    for state in states:
        # The GPS's word came 90 ms late at least, and nothing in the log tells by how much.
        t_s = seconds(state.at_ns - GPS_UTC_US * 1000) + 0.09
        ned_m, velocity_mps = where(t_s)
        assert ned_between(HOME, state.position) == pytest.approx(ned_m, abs=0.02)
        assert state.velocity_ned_mps == pytest.approx(velocity_mps, abs=0.1)
        assert abs(np.dot(state.q_ned_body, attitude(t_s))) == pytest.approx(1.0, abs=1e-5)
        assert state.angular_velocity_body_rps == pytest.approx((0.1 * np.cos(t_s), 0.0, 0.3), abs=0.01)
        assert state.position.ellipsoidal_height_m - state.position.altitude_amsl_m == pytest.approx(47.25, abs=1e-3)
    arrivals_ns = [one.at_ns for one in heard]
    assert arrivals_ns == sorted(arrivals_ns)
    assert all(one.at_ns > one.message.stamp_ns for one in heard)


def test_status_of_a_px4_log_follows_its_modes(tmp_path):
    heard = ulog_vehicle(px4_log(tmp_path / "log.ulg"), Settings()).heard
    told = [one.message for one in heard if one.topic is topics.VEHICLE_STATUS]
    assert [told[i].mode for i in (5, -1)] == [FlightMode.OFFBOARD, FlightMode.LAND]
    assert [told[i].landed_state for i in (5, -1)] == [LandedState.IN_AIR, LandedState.ON_GROUND]
    assert told[5].armed and told[5].battery_remaining == pytest.approx(0.75)
    assert told[5].home is not None and told[5].home.ellipsoidal_height_m == pytest.approx(535.25, abs=1e-3)


def test_a_gimbal_in_a_px4_log_is_taken_and_its_absence_is_the_fixed_mount(tmp_path):
    with_gimbal = ulog_vehicle(px4_log(tmp_path / "with.ulg", gimbal=True), Settings()).heard
    without = ulog_vehicle(px4_log(tmp_path / "without.ulg"), Settings()).heard
    measured = [one.message for one in with_gimbal if one.topic is topics.GIMBAL_STATE]
    fixed = [one.message for one in without if one.topic is topics.GIMBAL_STATE]
    assert len(measured) == 100 and all(state.measured for state in measured)
    assert len(fixed) > 90 and not any(state.measured for state in fixed)


def test_a_px4_log_without_gps_time_counts_from_boot(tmp_path, capsys):
    log = px4_log(tmp_path / "log.ulg", gps=False)
    vehicle = ulog_vehicle(log, Settings())
    assert not vehicle.dated
    assert next(one.message.at_ns for one in vehicle.heard if one.topic is topics.VEHICLE_STATE) == BOOT_US * 1000
    assert run_import(log, "--out", tmp_path / "out.mcap") == 0
    assert "count from the autopilot's boot" in capsys.readouterr().out


def test_rows_of_a_px4_log_without_numbers_are_left_out(tmp_path):
    nan = float("nan")
    log = UlogFile(BOOT_US)
    for number in range(100):
        boot_us = BOOT_US + 20_000 * number
        log.add("vehicle_attitude", boot_us, *([nan] * 4 if number % 7 == 0 else attitude(0.0)))
        log.add("vehicle_angular_velocity", boot_us, nan if number % 5 == 0 else 0.1, 0.0, 0.0)
        known = number % 20 != 0
        log.add("vehicle_global_position", boot_us, 47.0 if known else nan, 8.0, 500.0, nan)
        log.add("vehicle_local_position", boot_us, 0.0, nan if number % 3 else 0.0, 0.0)
    states = [one.message for one in ulog_vehicle(log.write(tmp_path / "log.ulg"), Settings()).heard]
    states = [state for state in states if isinstance(state, VehicleState)]
    assert 80 <= len(states) < 100
    assert all(state.position.latitude_deg == pytest.approx(47.0, abs=1e-9) for state in states)


@needs_real
def test_a_real_px4_log_that_never_had_a_position_is_refused_in_one_line(tmp_path, capsys):
    assert run_import(REAL / "logs" / "sample_log_small.ulg", "--out", tmp_path / "out.mcap") == 2
    said = capsys.readouterr().err.strip()
    assert "has no vehicle_global_position" in said and "\n" not in said
    assert not (tmp_path / "out.mcap").exists()


# MAVLink telemetry logs ------------------------------------------------------------------------------------------------


@needs_px4_logs
@pytest.mark.parametrize("log", PX4_LOGS, ids=lambda log: log.stem)
def test_a_real_mavlink_log_becomes_a_recording_of_the_vehicle(log, tmp_path, capsys):
    out = tmp_path / "flight.mcap"
    assert run_import(log, "--out", out) == 0
    record = read_flight(out)
    assert record.provenance.defects == ()
    states = record.logged(topics.VEHICLE_STATE)
    positions = sum(packet.data[7:10] == (33).to_bytes(3, "little") for packet in read_tlog(log))
    assert len(states) > 0.95 * positions
    assert [one.logged_at_ns for one in states] == sorted(one.logged_at_ns for one in states)
    modes = {status.mode for status in record.messages(topics.VEHICLE_STATUS)}
    assert {FlightMode.TAKEOFF, FlightMode.HOLD} <= modes
    assert any(status.home for status in record.messages(topics.VEHICLE_STATUS))
    assert f"{len(states)} poses" in capsys.readouterr().out


@needs_px4_logs
def test_a_log_with_angles_only_gives_the_attitudes_of_one_with_quaternions():
    packets = list(read_tlog(PX4_LOGS[-1]))[:3000]
    angles_only = [packet for packet in packets if packet.message_id != 31]
    assert len(angles_only) < len(packets)
    whole, from_angles = (
        [one.message for one in mavlink_vehicle(source, Settings()) if one.topic is topics.VEHICLE_STATE]
        for source in (packets, with_quaternions(angles_only))
    )
    assert len(from_angles) > 0.95 * len(whole)
    # The stamps lean on other arrivals, so the same pose is found by what its packet said.
    attitudes = {(state.position, state.velocity_ned_mps): state.q_ned_body for state in whole}
    same = [(state.q_ned_body, attitudes.get((state.position, state.velocity_ned_mps))) for state in from_angles]
    assert sum(then is not None for _, then in same) > 0.95 * len(whole)
    assert all(abs(np.dot(now, then)) == pytest.approx(1.0, abs=1e-5) for now, then in same if then is not None)
    assert list(with_quaternions(packets)) == packets


def test_a_log_cut_off_in_a_packet_yields_what_is_whole(tmp_path):
    packet = bytes([0xFD, 1, 0, 0, 0, 1, 1, 0, 0, 0, 7, 0, 0])
    entry = (1_700_000_000_000_000).to_bytes(8, "big") + packet
    path = tmp_path / "log.tlog"
    path.write_bytes(entry + entry + entry[:-2])
    assert [found.data for found in read_tlog(path)] == [packet, packet]
    path.write_bytes(entry + bytes(20))
    with pytest.raises(SourceError, match="no MAVLink packet at byte 29"):
        list(read_tlog(path))


@settings(max_examples=30)
@given(st.lists(st.tuples(st.integers(0, 10**9), st.binary(max_size=40)), max_size=6))
def test_no_packet_content_stops_an_import(packets):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.tlog"
        path.write_bytes(
            b"".join(
                time_us.to_bytes(8, "big") + bytes([0xFD, len(body), 0, 0, 0, 1, 1, 30, 0, 0]) + body + b"\0\0"
                for time_us, body in packets
            )
        )
        assert len(list(read_tlog(path))) == len(packets)
        arrivals_ns = [found.received_at_ns for found in read_tlog(path)]
        assert arrivals_ns == sorted(arrivals_ns)
        assert list(mavlink_vehicle(with_quaternions(list(read_tlog(path))), Settings())) is not None


# Videos and their stamps -----------------------------------------------------------------------------------------------


@pytest.fixture
def log(tmp_path) -> Path:
    return px4_log(tmp_path / "log.ulg")


@pytest.fixture
def video(tmp_path) -> Path:
    """Twenty frames, 64x48, each of another grey."""
    path = tmp_path / "video.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 48))
    assert writer.isOpened()
    for number in range(20):
        writer.write(np.full((48, 64, 3), 10 * number, np.uint8))
    writer.release()
    return path


@pytest.fixture
def lens(tmp_path) -> Path:
    path = tmp_path / "lens.toml"
    path.write_text("width_px = 64\nheight_px = 48\nfx_px = 60.0\nfy_px = 60.0\ncx_px = 31.5\ncy_px = 23.5\n")
    return path


def test_a_video_is_stamped_by_its_start_rate_and_offset(log, video, lens, tmp_path):
    out = tmp_path / "flight.mcap"
    words = ("--video", video, "--calibration", lens, "--fps", 20, "--video-start", "+2", "--offset", -0.25)
    assert run_import(log, *words, "--out", out) == 0
    record = read_flight(out)
    first_ns = record.messages(topics.VEHICLE_STATE)[0].at_ns
    frames = record.logged(topics.FRAME)
    assert [frame.message.captured_at_ns for frame in frames] == [
        first_ns + nanoseconds(1.75) + nanoseconds(number / 20) for number in range(20)
    ]
    assert {one.logged_at_ns - one.message.captured_at_ns for one in frames} == {nanoseconds(0.0205)}
    assert [frame.message.hops[0].service for frame in frames] == ["camera"] * 20
    for number in (0, 7, 19):
        picture = record.picture(frames[number].message.captured_at_ns)
        assert picture.shape == (48, 64, 3) and abs(float(picture.mean()) - 10 * number) < 3
    assert record.messages(topics.CALIBRATION)[0].fx_px == 60.0
    assert record.setting("camera", "calibration", {})["fx_px"] == 60.0


@pytest.mark.parametrize(
    ("column", "text"),
    [("captured_at_ns", str), ("captured_at_s", lambda ns: f"{ns // NS_PER_S}.{ns % NS_PER_S:09d}")],
)
def test_a_video_is_stamped_by_a_table(log, video, lens, tmp_path, column, text):
    start_ns = GPS_UTC_US * 1000 + NS_PER_S
    stamps_ns = [start_ns + nanoseconds(0.1 * number + 0.02 * (number % 3)) for number in range(20)]
    table = tmp_path / "frames.csv"
    table.write_text(f"frame,{column}\n" + "".join(f"{i},{text(ns)}\n" for i, ns in enumerate(stamps_ns)))
    out = tmp_path / "flight.mcap"
    assert run_import(log, "--video", video, "--calibration", lens, "--stamps", table, "--out", out) == 0
    found_ns = [frame.captured_at_ns for frame in read_flight(out).messages(topics.FRAME)]
    assert found_ns == pytest.approx(stamps_ns, abs=300)  # a double holds UTC in seconds to 0.2 microseconds


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("a,b\n1,2\n", "has no stamps: the first line must name captured_at_ns, captured_at_s or t_s"),
        ("", "has no stamps"),
        ("t_s\n1.0\nsoon\n", "line 3: t_s 'soon' is no number"),
        ("t_s\n1.0\nnan\n", "line 3: t_s 'nan' is no number"),
        ("t_s\n1.0\n0.9\n", "line 3: t_s 0.9 is not after the frame before it"),
    ],
)
def test_stamps_that_cannot_be_meant_are_refused_with_their_line(tmp_path, content, words):
    table = tmp_path / "frames.csv"
    table.write_text(content)
    with pytest.raises(SourceError, match=words):
        stamps_from_table(table, 0)


def test_a_moment_is_utc_or_counted_from_the_log():
    log_ns = 1_790_000_000 * NS_PER_S
    assert moment_ns("+1.5", log_ns) == log_ns + nanoseconds(1.5)
    assert moment_ns("-2", log_ns) == log_ns - nanoseconds(2.0)
    assert moment_ns("1970-01-02T00:00:00.25Z", log_ns) == 86_400 * NS_PER_S + NS_PER_S // 4
    assert moment_ns("1970-01-01T02:00:00+02:00", log_ns) == 0
    assert moment_ns("1790000000.5", log_ns) == log_ns + NS_PER_S // 2
    with pytest.raises(SourceError, match="--video-start yesterday: write"):
        moment_ns("yesterday", log_ns)


def test_a_steady_rate_does_not_drift():
    stamps = stamps_at_rate(5, 30.0)
    assert [next(stamps) for _ in range(31)][30] == 5 + NS_PER_S


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--video-start", "+60"), "have no time in common: correct --video-start, --stamps or --offset"),
        (("--video-start", "soon"), "--video-start soon: write"),
        (("--stamps", "missing.csv"), "missing.csv: cannot be read"),
        (("--calibration", "missing.toml"), "correct --calibration"),
        (("--set", "camera.rate=3"), "camera.rate is no setting"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(log, video, tmp_path, capsys, words, said):
    out = tmp_path / "flight.mcap"
    assert run_import(log, "--video", video, *words, "--out", out) == 2
    error = capsys.readouterr().err.strip()
    assert said in error and "\n" not in error
    assert not out.exists()


def test_a_calibration_for_another_size_is_refused_and_leaves_no_half_recording(log, video, tmp_path, capsys):
    out = tmp_path / "flight.mcap"
    assert run_import(log, "--video", video, "--out", out) == 2
    assert "is 64x48 pixels, the calibration is for 640x480" in capsys.readouterr().err
    assert not out.exists()


def test_nothing_is_overwritten(log, tmp_path, capsys):
    out = tmp_path / "flight.mcap"
    out.write_text("precious")
    assert run_import(log, "--out", out) == 2
    assert "none is overwritten" in capsys.readouterr().err
    assert out.read_text() == "precious"


def test_other_stamps_than_pictures_are_told(log, video, lens, tmp_path, capsys):
    table = tmp_path / "frames.csv"
    table.write_text("t_s\n" + "".join(f"{0.1 * number}\n" for number in range(25)))
    words = ("--video", video, "--calibration", lens, "--stamps", table)
    assert run_import(log, *words, "--out", tmp_path / "flight.mcap") == 0
    assert "25 stamps, but 20 pictures" in capsys.readouterr().out


def test_a_log_of_another_kind_is_refused(tmp_path, capsys):
    (tmp_path / "log.bin").write_bytes(b"\xa3\x95")
    assert run_import(tmp_path / "log.bin", "--out", tmp_path / "flight.mcap") == 2
    assert "is neither .ulg (PX4) nor .tlog" in capsys.readouterr().err


def test_without_the_reader_of_px4_logs_its_extra_is_named(log, monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(sys.modules, "pyulog", None)
    assert run_import(log, "--out", tmp_path / "flight.mcap") == 2
    assert "pip install 'alight[import]'" in capsys.readouterr().err


@pytest.mark.parametrize("content", [b"", b"ULog", b"not a log at all" * 20])
def test_damaged_px4_logs_are_refused(tmp_path, capsys, content):
    (tmp_path / "log.ulg").write_bytes(content)
    assert run_import(tmp_path / "log.ulg", "--out", tmp_path / "flight.mcap") == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


@needs_real
@needs_px4_logs
def test_a_real_video_with_a_real_log_makes_a_recording(tmp_path):
    video = REAL / "tello_mirror_flight_day" / "video_2023-07-31_10-14-37.mp4"
    lens = tmp_path / "lens.toml"
    lens.write_text("width_px = 640\nheight_px = 480\nfx_px = 617.0\nfy_px = 617.0\ncx_px = 320.0\ncy_px = 240.0\n")
    out = tmp_path / "flight.mcap"
    words = ("--video", video, "--calibration", lens, "--mirrored", "--video-start", "+20")
    assert run_import(PX4_LOGS[0], *words, "--out", out) == 0
    record = read_flight(out)
    assert len(record.messages(topics.FRAME)) == len(record.picture_times_ns) == 168
