"""Looking and asking from another terminal while a flight goes on."""

import subprocess
import sys
from pathlib import Path

import pytest
from flight_process import IN_THE_AIR, REPOSITORY, FlightProcess, flight, free_port

pytestmark = pytest.mark.system


def alight(running: FlightProcess | int, *words: str) -> subprocess.CompletedProcess[str]:
    port = running if isinstance(running, int) else running.bus_port
    command = [sys.executable, "-m", "station", *words, "--set", f'bus.connect=["tcp/127.0.0.1:{port}"]']
    return subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, timeout=60.0, check=False)


def test_status_shows_the_flight_and_abort_ends_it_in_hold(tmp_path: Path) -> None:
    with flight(tmp_path / "flight", IN_THE_AIR) as running:
        running.wait_for_line(lambda line: "-> descend" in line)
        status = alight(running, "status")
        assert status.returncode == 0, status.stderr
        assert "mission  descend" in status.stdout
        assert "connected, armed, offboard" in status.stdout
        for service in ("camera", "detector", "geolocator", "filter", "commander"):
            assert service in status.stdout

        aborted = alight(running, "abort", "--reason", "a child on the pad")
        assert aborted.returncode == 0, aborted.stderr
        assert "accepted" in aborted.stdout
        assert running.wait() == 1
    assert "aborted" in running.output


def test_nobody_there_is_said_in_one_line() -> None:
    looked = alight(free_port(), "status")
    assert looked.returncode == 1
    assert len(looked.stderr.strip().splitlines()) == 1
    asked = alight(free_port(), "land")
    assert asked.returncode == 1
    assert "no commander answered" in asked.stderr
