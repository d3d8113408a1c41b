"""What a person sees who got something wrong: one clear line, and an exit status that is not zero."""

import socket
import subprocess
import sys
from pathlib import Path

import pytest
from flight_process import REPOSITORY, free_port

pytestmark = pytest.mark.system


def alight(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "station", *words]
    return subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, timeout=90.0, check=False)


def assert_one_clear_line(finished: subprocess.CompletedProcess[str], *expected: str) -> None:
    assert finished.returncode != 0
    assert "Traceback" not in finished.stdout + finished.stderr
    complaint = finished.stderr.strip().splitlines()
    assert len(complaint) == 1, finished.stderr
    for part in expected:
        assert part in complaint[0]


def test_a_setting_that_is_none(tmp_path: Path) -> None:
    finished = alight("fly", "--set", "camera.rate=20", "--out", str(tmp_path))
    assert_one_clear_line(finished, "--set camera.rate=20", "camera.rate", "did you mean camera.rate_hz?")


def test_a_camera_file_that_is_missing(tmp_path: Path) -> None:
    missing = tmp_path / "lens.toml"
    port = free_port()
    bus = f'bus.connect=["tcp/127.0.0.1:{port}"]'
    out = str(tmp_path / "flight")
    finished = alight("fly", "--set", f"camera.calibration_file={missing}", "--set", bus, "--out", out)
    assert_one_clear_line(finished, str(missing), "camera.calibration_file")


def test_a_busy_port_of_the_bus(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as holder:
        port = holder.getsockname()[1]
        finished = alight("fly", "--set", f'bus.connect=["tcp/127.0.0.1:{port}"]', "--out", str(tmp_path))
    assert_one_clear_line(finished, str(port))


def test_a_busy_port_of_the_vehicle(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as holder:
        holder.bind(("127.0.0.1", 0))
        port = holder.getsockname()[1]
        bus = f'bus.connect=["tcp/127.0.0.1:{free_port()}"]'
        vehicle = f"commander.vehicle_url=udpin://127.0.0.1:{port}"
        simulator = f"simulator.url=udp://127.0.0.1:{free_port(socket.SOCK_DGRAM)}?to=127.0.0.1:{port}"
        finished = alight("fly", "--set", vehicle, "--set", simulator, "--set", bus, "--out", str(tmp_path))
    assert_one_clear_line(finished, str(port), "another port")


def test_a_vehicle_that_only_the_settings_name(tmp_path: Path) -> None:
    url = f"udpin://127.0.0.1:{free_port(socket.SOCK_DGRAM)}"
    drone = tmp_path / "drone.toml"
    drone.write_text(f'[commander]\nvehicle_url = "{url}"\n')
    finished = alight("fly", "--settings", str(drone), "--out", str(tmp_path / "flight"))
    assert_one_clear_line(finished, url, "simulator.url", f"--vehicle {url}")
    assert not (tmp_path / "flight").exists()


def test_no_vehicle_answering(tmp_path: Path) -> None:
    port = free_port(socket.SOCK_DGRAM)
    bus = f'bus.connect=["tcp/127.0.0.1:{free_port()}"]'
    url = f"udpin://127.0.0.1:{port}"
    words = ("--vehicle", url, "--truth", f"udpin://127.0.0.1:{free_port(socket.SOCK_DGRAM)}", "--set", bus)
    finished = alight("fly", *words, "--connect-timeout", "5", "--out", str(tmp_path))
    assert_one_clear_line(finished, "no vehicle is answering", url)


def test_a_picture_that_is_none(tmp_path: Path) -> None:
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"not a picture")
    finished = alight("detect", str(broken), "--family", "5x5_1000", "--size-m", "1.0")
    assert_one_clear_line(finished, "broken.png")


@pytest.mark.parametrize(
    "words", [[], ["fly"], ["run"], ["detect"], ["report"], ["schema", "export"], ["land"], ["status"]]
)
def test_help_says_what_a_command_does(words: list[str]) -> None:
    finished = alight(*words, "--help")
    assert finished.returncode == 0
    assert "usage: alight" in finished.stdout and len(finished.stdout) > 200
