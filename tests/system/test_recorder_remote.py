"""The recorder on the ground, the vehicle on a host of its own, a Zenoh router between them."""

import contextlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from recorder_process import recorder, traffic, wait_for_size
from test_two_hosts import DRONE, GROUND, GROUND_ADDRESS, pytestmark, two_hosts

from schemas import topics
from station.flight_record import read_flight

__all__ = ["pytestmark", "two_hosts"]

ROUTER_ENDPOINT = f"tcp/{GROUND_ADDRESS}:7447"
ROUTER = """
import sys, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"router"')
config.insert_json5("listen/endpoints", f'["{sys.argv[1]}"]')
config.insert_json5("scouting/multicast/enabled", "false")
with zenoh.open(config):
    print("ready", flush=True)
    sys.stdin.read()
"""


@contextlib.contextmanager
def router() -> Iterator[None]:
    """A Zenoh router on the ground."""
    command = ["ip", "netns", "exec", GROUND, sys.executable, "-c", ROUTER, ROUTER_ENDPOINT]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "ready\n"
            yield
        finally:
            process.kill()


@pytest.mark.usefixtures("two_hosts")
def test_what_the_vehicle_publishes_is_recorded_on_the_ground(tmp_path: Path) -> None:
    on_ground, on_drone = (("ip", "netns", "exec", name) for name in (GROUND, DRONE))
    as_client = ("bus.mode=client", "bus.listen=[]", "recorder.frames=none")
    with (
        router(),
        recorder(tmp_path / "ground", ROUTER_ENDPOINT, as_client, prefix=on_ground) as recording,
        traffic(60.0, ["--client", "--connect", ROUTER_ENDPOINT], prefix=on_drone) as published,
    ):
        wait_for_size(tmp_path / "ground" / "flight.mcap", 20_000)
        sent = published.end()["published"]
        recording.terminate()
        assert recording.wait(20.0) == 0
    record = read_flight(tmp_path / "ground")
    numbers = [round(truth.vehicle_from_pad_ned_m[0]) for truth in record.messages(topics.GROUND_TRUTH)]
    assert numbers == list(range(numbers[0], numbers[-1] + 1)) and sent - numbers[-1] <= 60
    assert record.messages(topics.FRAME) and not record.provenance.defects
