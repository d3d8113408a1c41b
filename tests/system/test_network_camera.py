"""A camera on the network: a process reads its stream, another finds the pad in it, and both outlive its absence."""

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from picture_server import PictureServer

from alight.runtime.live import LiveRunner
from alight.runtime.node import Arrival, Node, Outputs
from schemas import topics
from schemas.detection import Detection
from schemas.health import Health
from schemas.settings import Settings

pytestmark = pytest.mark.system

REPOSITORY = Path(__file__).parents[2]
BUS = "tcp/127.0.0.1:17461"


class Onlooker(Node):
    """Notes how often the pad was seen, and what the camera complains of."""

    service = "station"

    def __init__(self) -> None:
        super().__init__()
        self.seen = 0
        self.camera_says: tuple[str, ...] = ()
        self.subscribe(topics.DETECTION, self._on_detection)
        self.subscribe(topics.HEALTH, self._on_health)

    def _on_detection(self, arrival: Arrival[Detection]) -> Outputs:
        self.seen += any(marker.id == 68 for marker in arrival.message.markers)
        return ()

    def _on_health(self, arrival: Arrival[Health]) -> Outputs:
        if arrival.message.service == "camera":
            self.camera_says = arrival.message.complaints
        return ()


def pad_picture() -> np.ndarray:
    marker = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000), 68, 140)
    picture = np.full((480, 640), 230, np.uint8)
    picture[170:310, 250:390] = marker
    return picture


def wait_for(condition: Callable[[], bool], what: str, timeout_s: float = 60.0) -> None:
    deadline_s = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline_s, f"never: {what}"
        time.sleep(0.05)


@pytest.fixture
def onlooker() -> Iterator[Onlooker]:
    node = Onlooker()
    runner = LiveRunner(node, Settings.model_validate({"bus": {"connect": [], "listen": [BUS]}}), {})
    thread = threading.Thread(target=runner.run, daemon=True)
    thread.start()
    yield node
    runner.stop()
    thread.join(10.0)


def test_the_pad_is_found_in_a_network_stream_and_again_after_it_was_gone(onlooker: Onlooker) -> None:
    server = PictureServer(pad_picture())
    live = ("camera.source=stream", f"camera.live.url={server.url}", "camera.live.silent_s=1")
    sets = [word for key in (f'bus.connect=["{BUS}"]', *live) for word in ("--set", key)]
    processes = [
        subprocess.Popen([sys.executable, "-m", f"services.{name}", *sets], cwd=REPOSITORY)
        for name in ("camera", "detector")
    ]
    try:
        wait_for(lambda: onlooker.seen >= 10, "the pad was seen")
        server.end()
        wait_for(lambda: any("127.0.0.1" in text for text in onlooker.camera_says), "the camera complained")
        before = onlooker.seen
        server = PictureServer(pad_picture(), port=server.port)
        wait_for(lambda: onlooker.seen >= before + 10, "the pad was seen again")
        wait_for(lambda: onlooker.camera_says == (), "the camera was content again")
    finally:
        server.end()
        for process in processes:
            process.terminate()
        assert [process.wait(20.0) for process in processes] == [0, 0]
