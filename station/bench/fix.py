"""What a fix and an estimate cost, from the message that comes in to the one that goes out, with warm caches and with cold ones."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from alight.runtime.node import Arrival, Node, Pixels, Publication
from schemas import topics
from schemas.message import Message
from schemas.settings import Settings
from schemas.topics import Topic
from services.camera.service import build as build_camera
from services.detector.service import build as build_detector
from services.filter.service import build as build_filter
from services.geolocator.service import build as build_geolocator
from station.bench.hover import Hover
from station.bench.table import print_table

T = TypeVar("T")
HEIGHT_M = 5.0
MOMENTS = 20
TARGET_MS = 0.3
_MEMORY = np.zeros(64 << 20, np.uint8)
_LINE_BYTES = 64


@dataclass(frozen=True)
class _Condition:
    """What happens between two calls."""

    name: str
    calls: int
    disturb: Callable[[], object]


CONDITIONS = (
    _Condition("nothing (warm)", 2000, lambda: None),
    _Condition("2 MB read and written", 1000, lambda: _use(2 << 20)),
    _Condition("64 MB read and written", 200, lambda: _use(64 << 20)),
)
"""Other work in between takes the caches: 2 MB are more than those of one core, 64 MB more than all."""


def bench_fix() -> None:
    """Time the geolocator's handler, and the filter's, on the detections of rendered pictures, and print."""
    sight = _Sight()
    spent = {condition: _spent_ms(sight, condition) for condition in CONDITIONS}
    rows = [
        (condition.name, service, str(len(values)), *(f"{np.percentile(values, part):.3f}" for part in (50, 99)))
        for condition, services in spent.items()
        for service, values in services.items()
    ]
    print_table("Message in to message out, ms", ("between the calls", "service", "calls", "median", "p99"), rows)
    for condition, services in spent.items():
        median = float(np.median(services["geolocator"]))
        met = "met" if median <= TARGET_MS else "MISSED"
        print(f"{condition.name}: detection in to fix out {median:.3f} ms (target <= {TARGET_MS}: {met})")


class _Sight:
    """Some moments of a vehicle that sways above the pad, and what the detector saw at each."""

    def __init__(self) -> None:
        settings = Settings()
        self._hover = Hover(HEIGHT_M)
        self._camera, self._detector = build_camera(settings), build_detector(settings)
        begins_ns = self._hover.time_ns(0)
        self.calibration = next(
            output.message
            for output in self._camera.on_tick(begins_ns)
            if isinstance(output, Publication) and output.topic is topics.CALIBRATION
        )
        _give(self._detector, topics.CALIBRATION, self.calibration, begins_ns)
        self._detections = [self._seen(number) for number in range(MOMENTS)]

    def time_ns(self, number: int) -> int:
        """When a moment is come to, UTC ns."""
        return self._hover.time_ns(MOMENTS + number)

    def state(self, number: int) -> Message:
        """The vehicle's state then."""
        return self._hover.state(_moment(number)).model_copy(update={"at_ns": self.time_ns(number)})

    def detection(self, number: int) -> Message:
        """What is seen then."""
        return self._detections[_moment(number)].model_copy(update={"captured_at_ns": self.time_ns(number)})

    def _seen(self, number: int) -> Message:
        at_ns = self._hover.time_ns(number)
        frame = _give(self._camera, topics.GROUND_TRUTH, self._hover.truth(number), self._hover.told_ns(number))
        assert frame is not None
        detection = _give(self._detector, topics.FRAME, frame.message, at_ns, frame.pixels)
        assert detection is not None
        return detection.message


def _spent_ms(sight: _Sight, condition: _Condition) -> dict[str, list[float]]:
    geolocator, filter_ = build_geolocator(Settings()), build_filter(Settings())
    _give(geolocator, topics.CALIBRATION, sight.calibration, sight.time_ns(0))
    spent: dict[str, list[float]] = {"geolocator": [], "filter": []}
    for number in range(condition.calls):
        at_ns, state, detection = sight.time_ns(number), sight.state(number), sight.detection(number)
        for node in (geolocator, filter_):
            _give(node, topics.VEHICLE_STATE, state, at_ns)
        condition.disturb()
        fix, taken_ms = _timed(lambda: _give(geolocator, topics.DETECTION, detection, at_ns))  # noqa: B023
        assert fix is not None
        assert fix.message.corrected is not None  # type: ignore[attr-defined]
        spent["geolocator"].append(taken_ms)
        condition.disturb()
        estimate, taken_ms = _timed(lambda: _give(filter_, topics.PAD_FIX, fix.message, at_ns))  # noqa: B023
        if estimate is not None:
            spent["filter"].append(taken_ms)
        tuple(filter_.on_tick(at_ns))
    return spent


def _moment(number: int) -> int:
    """To and fro through the moments, so that the vehicle never jumps."""
    step = number % (2 * MOMENTS)
    return step if step < MOMENTS else 2 * MOMENTS - 1 - step


def _give(
    node: Node, topic: Topic[Any], message: Message, at_ns: int, pixels: Pixels | None = None
) -> Publication | None:
    outputs = list(node.on_message(Arrival(topic, message, at_ns, at_ns, pixels)))
    return next((output for output in outputs if isinstance(output, Publication)), None)


def _timed(call: Callable[[], T]) -> tuple[T, float]:
    began_s = time.perf_counter()
    result = call()
    return result, 1e3 * (time.perf_counter() - began_s)


def _use(count: int) -> None:
    _MEMORY[:count:_LINE_BYTES] += 1
