"""`alight calibrate camera live`: pictures as they come, from the bus or from a camera that nobody else reads."""

import contextlib
import logging
import threading
import time
from collections.abc import Callable, Iterator

from alight.runtime.bus import Bus, BusError
from alight.runtime.live import LiveRunner
from alight.runtime.node import Arrival, Node, Outputs, Pixels
from schemas import topics
from schemas.frame import FrameHeader
from schemas.settings import Settings
from services.camera.service import build as build_camera
from services.camera.service import open_ports as open_camera
from services.detector.node import grey
from station.calibrate.board import Grey

SILENT_S = 15.0
"""Without a frame for so long there is no camera."""
_NOBODY = (
    "start the camera (python -m services.camera), check bus.connect and the vehicle's name, or open a camera here with "
    "--set camera.source=device"
)


class NoFramesError(ValueError):
    """No camera is heard, in one line with the remedy."""


class NewestFrame:
    """Hands the newest frame from the thread that receives to the one that looks at it; what is not looked at in time is lost."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._frame: tuple[str, Grey] | None = None

    def put(self, header: FrameHeader, pixels: Pixels) -> None:
        """A new frame."""
        frame = (f"frame {header.sequence}", grey(pixels))
        with self._changed:
            self._frame = frame
            self._changed.notify()

    def take(self, timeout_s: float) -> tuple[str, Grey] | None:
        """The newest frame that was not taken yet; None if none comes in time."""
        with self._changed:
            self._changed.wait_for(lambda: self._frame is not None, timeout_s)
            frame, self._frame = self._frame, None
        return frame


class FrameListener(Node):
    """Passes frames on."""

    service = "station"

    def __init__(self, newest: NewestFrame) -> None:
        super().__init__()
        self._newest = newest
        self.subscribe(topics.FRAME, self._on_frame)

    def _on_frame(self, arrival: Arrival[FrameHeader]) -> Outputs:
        if arrival.pixels is not None:
            self._newest.put(arrival.message, arrival.pixels)
        return ()


def live_pictures(settings: Settings, seconds: float) -> Iterator[tuple[str, Grey]]:
    """The newest picture each time one is asked for, until the time is over.

    Args:
        settings: With the source `device` or `stream` that camera is opened here; otherwise frames are taken from the bus.
        seconds: How long, at most.

    Raises:
        NoFramesError: If no frame comes.
        BusError: If the bus cannot be joined.
        PortError: If the camera's settings cannot work.
    """
    newest = NewestFrame()
    with _opened(settings, newest) as trouble:
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            frame = newest.take(SILENT_S)
            if frame is None:
                raise NoFramesError(f"live: no frame within {SILENT_S:g} s: {trouble()}")
            yield frame


@contextlib.contextmanager
def _opened(settings: Settings, newest: NewestFrame) -> Iterator[Callable[[], str]]:
    """Frames go to `newest` meanwhile; gives what to call to hear why there are none."""
    if settings.camera.source in ("device", "stream"):
        with _own_camera(settings, newest) as trouble:
            yield trouble
        return
    logging.getLogger("alight").addHandler(logging.NullHandler())  # a look must not print what it refuses
    runner = LiveRunner(FrameListener(newest), settings, ports={}, bus=_bus(settings))
    thread = threading.Thread(target=runner.run, daemon=True)
    thread.start()
    try:
        yield lambda: _NOBODY
    finally:
        runner.stop()
        thread.join(timeout=2.0)


def _bus(settings: Settings) -> Bus:
    """Where the others look for the station: a camera alone has nobody to meet there. If a flight is on, the flight's is used."""
    meeting = settings.bus.model_copy(update={"connect": (), "listen": settings.bus.connect})
    if settings.bus.mode == "peer" and settings.bus.connect:
        with contextlib.suppress(BusError):
            return Bus(settings.vehicle, meeting)
    return Bus(settings.vehicle, settings.bus)


@contextlib.contextmanager
def _own_camera(settings: Settings, newest: NewestFrame) -> Iterator[Callable[[], str]]:
    node = build_camera(settings)

    def deliver(name: str, data: bytes) -> None:
        for output in node.on_bytes(name, data, time.time_ns()):
            pixels = getattr(output, "pixels", None)
            header = getattr(output, "message", None)
            if pixels is not None and isinstance(header, FrameHeader):
                newest.put(header, pixels)

    ports = open_camera(settings)
    for name, port in ports.items():
        port.open(lambda data, name=name: deliver(name, data))  # type: ignore[misc]
    try:
        yield lambda: "; ".join(node.complaints(time.time_ns())) or "it is open, and silent"
    finally:
        for port in ports.values():
            port.close()
