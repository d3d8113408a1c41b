"""Camera and detector on one host, the rest on another: two network namespaces with addresses of their own."""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from schemas import topics
from station.flight_record import read_flight
from station.metrics.summary import summarise

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(os.geteuid() != 0 or shutil.which("ip") is None, reason="needs root and iproute2"),
]

REPOSITORY = Path(__file__).parents[2]
GROUND, DRONE = f"alight-ground-{os.getpid()}", f"alight-drone-{os.getpid()}"
GROUND_ADDRESS, DRONE_ADDRESS = "10.77.0.1", "10.77.0.2"


def ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)


@pytest.fixture
def two_hosts() -> Iterator[None]:
    """Two namespaces joined by a virtual cable."""
    made = []
    try:
        for name in (GROUND, DRONE):
            ip("netns", "add", name)
            made.append(name)
            ip("-n", name, "link", "set", "lo", "up")
        ip("link", "add", "veth-g", "netns", GROUND, "type", "veth", "peer", "name", "veth-d", "netns", DRONE)
        for name, device, address in ((GROUND, "veth-g", GROUND_ADDRESS), (DRONE, "veth-d", DRONE_ADDRESS)):
            ip("-n", name, "addr", "add", f"{address}/24", "dev", device)
            ip("-n", name, "link", "set", device, "up")
        yield
    except subprocess.CalledProcessError as error:
        pytest.skip(f"no network namespaces here: {error.stderr.decode().strip()}")
    finally:
        for name in made:
            subprocess.run(["ip", "netns", "delete", name], check=False)


@contextlib.contextmanager
def on(host: str, address: str, log: Path, *words: str, port: int = 0) -> Iterator[subprocess.Popen[bytes]]:
    """A process on one of the hosts; all look for each other at the ground's address."""
    bus = [
        "--set", f'bus.connect=["tcp/{GROUND_ADDRESS}:7447"]',
        "--set", f'bus.listen=["tcp/{address}:{port}"]',
    ]  # fmt: skip
    with log.open("wb") as sink:
        command = ["ip", "netns", "exec", host, sys.executable, "-u", "-m", *words, *bus]
        process = subprocess.Popen(command, cwd=REPOSITORY, stdout=sink, stderr=subprocess.STDOUT)
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
                process.wait(20.0)


def test_a_host_with_a_wrong_clock_is_named(two_hosts: None, tmp_path: Path) -> None:
    """The camera's host is 0.35 s ahead: its frames are refused by the others, and their health says why."""
    with (
        on(GROUND, GROUND_ADDRESS, tmp_path / "geolocator.log", "services.geolocator", port=7447),
        on(DRONE, DRONE_ADDRESS, tmp_path / "camera.log", "tests.system.wrong_clock", "camera", "0.35"),
    ):
        deadline_s, said = time.monotonic() + 60.0, ""
        while "ahead of ours" not in said and time.monotonic() < deadline_s:
            with on(GROUND, GROUND_ADDRESS, tmp_path / "status.log", "station", "status") as looking:
                looking.wait(30.0)
            said = (tmp_path / "status.log").read_text()
    complaint = re.search(r"\(camera\) is (\S+) s ahead of ours, bus.max_clock_skew_s is 0.2", said)
    assert complaint, said + (tmp_path / "camera.log").read_text()
    assert float(complaint[1]) == pytest.approx(0.35, abs=0.02)
    assert re.search(r"clock +host \S+ \(camera\): \+3[3-7]\d", said), said


def test_camera_and_detector_on_a_host_of_their_own(two_hosts: None, tmp_path: Path) -> None:
    out = tmp_path / "flight"
    fly = ("station", "fly", "--without", "camera,detector", "--out", str(out))
    with (
        on(DRONE, DRONE_ADDRESS, tmp_path / "camera.log", "services.camera"),
        on(DRONE, DRONE_ADDRESS, tmp_path / "detector.log", "services.detector"),
        on(GROUND, GROUND_ADDRESS, tmp_path / "fly.log", *fly) as flying,
    ):
        status = flying.wait(240.0)
    said = (tmp_path / "fly.log").read_text()
    assert status == 0, said + (tmp_path / "camera.log").read_text() + (tmp_path / "detector.log").read_text()
    record = read_flight(out / "flight.mcap")
    assert summarise(record).verdict.ok
    services = {health.service for health in record.messages(topics.HEALTH)}
    assert {"camera", "detector", "geolocator", "filter", "commander"} <= services
