"""The ground truth of a real PX4 (SIH), heard by the simulator service's other kind."""

import os
import queue
import time

import pytest
from px4_stage import Px4

from alight.runtime.endpoint import open_endpoint
from alight.runtime.node import Publication, Transmission
from schemas.settings import Settings
from schemas.truth import GroundTruth
from services.simulator.truth_node import TruthNode

pytestmark = [
    pytest.mark.px4,
    pytest.mark.skipif("ALIGHT_PX4_RUN" not in os.environ, reason="ALIGHT_PX4_RUN names no PX4 to start"),
]

INSTANCE = 6
SECONDS = 12.0


def listen(settings: Settings, seconds: float) -> list[tuple[int, GroundTruth]]:
    """Run the node on the wall clock; what it published and when."""
    node, received = TruthNode(settings), queue.SimpleQueue()
    port = open_endpoint(settings.simulator.truth_url)
    port.open(received.put)
    published: list[tuple[int, GroundTruth]] = []
    end_s, tick_ns = time.monotonic() + seconds, 0
    while time.monotonic() < end_s:
        now_ns = time.time_ns()
        if now_ns >= tick_ns:
            tick_ns = now_ns + (node.tick_period_ns or 0)
            for output in node.on_tick(now_ns):
                assert isinstance(output, Transmission)
                port.send(output.data)
        try:
            data = received.get(timeout=0.01)
        except queue.Empty:
            continue
        now_ns = time.time_ns()
        outputs = node.on_bytes("vehicle", data, now_ns)
        published += [(now_ns, output.message) for output in outputs if isinstance(output, Publication)]
    port.close()
    return published


def test_px4s_truth_comes_at_its_rate_fresh_and_from_home(tmp_path):
    px4 = Px4(os.environ["ALIGHT_PX4_RUN"], INSTANCE, tmp_path)
    try:
        url = f"udp://127.0.0.1:{px4.onboard_port}?to=127.0.0.1:{px4.command_port}"
        simulator = {"kind": "mavlink_truth", "system_id": INSTANCE + 1, "truth_url": url}
        published = listen(Settings(simulator=simulator), SECONDS)
    finally:
        px4.close()
    ages_s = sorted((now_ns - truth.at_ns) * 1e-9 for now_ns, truth in published)
    newest = published[-1][1]
    assert len(published) > 60 * (SECONDS - 6.0)
    assert -0.02 < ages_s[len(ages_s) // 2] < 0.05
    assert newest.vehicle_from_pad_ned_m == pytest.approx((-5.0, -3.0, -0.2), abs=0.05)
    assert newest.touching_ground
