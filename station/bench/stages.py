"""What each stage costs on one core, side by side in one run."""

import statistics
import time
from collections.abc import Callable
from typing import TypeVar

import cv2

from alight.runtime.node import Arrival, Node, Output, Pixels, Publication
from schemas import topics
from schemas.message import Message
from schemas.settings import Settings
from schemas.topics import Topic
from services.camera.service import build as build_camera
from services.detector.service import build as build_detector
from services.geolocator.service import build as build_geolocator
from station.bench.hover import Hover
from station.bench.table import print_table

M = TypeVar("M", bound=Message)
T = TypeVar("T")
HEIGHTS_M = (20.0, 10.0, 5.0, 2.0, 1.0)
FRAMES = 60


def bench_stages() -> None:
    """Render, detect and locate at several heights; OpenCV's default detector on the same pictures beside ours."""
    cv2.setNumThreads(1)
    rows = [stages_row(height_m) for height_m in HEIGHTS_M]
    head = ("height, m", "render", "detect", "OpenCV default", "OpenCV / ours", "locate", "found")
    print_table("Milliseconds a frame, median, one thread, 640x480, tracking", head, rows)


def stages_row(height_m: float, frames: int = FRAMES) -> tuple[str, ...]:
    """Height, milliseconds to render, to detect, of OpenCV, their ratio, milliseconds to locate, and "found/looked at"."""
    return _Chain(height_m).row(frames)


class _Chain:
    """Camera, detector and geolocator fed by hand, each call timed."""

    def __init__(self, height_m: float) -> None:
        settings = Settings()
        self._height_m = height_m
        self._hover = Hover(height_m)
        self._camera, self._detector = build_camera(settings), build_detector(settings)
        self._geolocator = build_geolocator(settings)
        self._plain = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000))
        self._spent_ms: dict[str, list[float]] = {"render": [], "detect": [], "opencv": [], "locate": []}
        self._found = 0
        at_ns = self._hover.time_ns(0)
        for output in self._camera.on_tick(at_ns):
            if isinstance(output, Publication) and output.topic is topics.CALIBRATION:
                for node in (self._detector, self._geolocator):
                    self._give(node, topics.CALIBRATION, output.message, at_ns)

    def row(self, frames: int) -> tuple[str, ...]:
        """See `stages_row`."""
        for number in range(1, frames + 1):
            self._step(number)
        medians = {name: statistics.median(values) for name, values in self._spent_ms.items()}
        return (
            f"{self._height_m:g}",
            *(f"{medians[name]:.2f}" for name in ("render", "detect", "opencv")),
            f"{medians['opencv'] / medians['detect']:.1f}",
            f"{medians['locate']:.2f}",
            f"{self._found}/{len(self._spent_ms['detect'])}",
        )

    def _step(self, number: int) -> None:
        at_ns = self._hover.time_ns(number)
        truth, told_ns = self._hover.truth(number), self._hover.told_ns(number)
        frame = self._timed("render", self._camera, topics.GROUND_TRUTH, truth, told_ns)
        if frame is None or frame.pixels is None:
            return
        detection = self._timed("detect", self._detector, topics.FRAME, frame.message, at_ns, frame.pixels)
        began_s = time.perf_counter()
        self._plain.detectMarkers(frame.pixels)
        self._spent_ms["opencv"].append(1e3 * (time.perf_counter() - began_s))
        self._give(self._geolocator, topics.VEHICLE_STATE, self._hover.state(number), at_ns)
        assert detection is not None, "the detector publishes for every frame"
        fix = self._timed("locate", self._geolocator, topics.DETECTION, detection.message, at_ns)
        self._found += fix is not None and "raw" in fix.message.model_fields_set

    def _timed(
        self, name: str, node: Node, topic: Topic[M], message: Message, at_ns: int, pixels: Pixels | None = None
    ) -> Publication | None:
        outputs, spent_ms = _timed(lambda: self._give(node, topic, message, at_ns, pixels))
        if outputs:
            self._spent_ms[name].append(spent_ms)
        return next((output for output in outputs if isinstance(output, Publication)), None)

    @staticmethod
    def _give(node: Node, topic: Topic[M], message: Message, at_ns: int, pixels: Pixels | None = None) -> list[Output]:
        return list(node.on_message(Arrival(topic, message, at_ns, at_ns, pixels)))


def _timed(call: Callable[[], T]) -> tuple[T, float]:
    began_s = time.perf_counter()
    result = call()
    return result, 1e3 * (time.perf_counter() - began_s)
