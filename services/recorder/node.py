"""Records every topic, each message when it arrives, into one file a flight."""

from collections.abc import Mapping
from typing import Any, ClassVar

from alight.runtime.clock import nanoseconds
from alight.runtime.node import Arrival, Node, Outputs
from schemas import topics
from schemas.frame import FrameHeader
from schemas.settings import Settings
from services.recorder.flight_file import FlightFile
from services.recorder.picture import PictureEncoder, PictureError


class Recorder(Node):
    """Writes what it hears. It publishes nothing, so that recording a flight cannot change it.

    A message that never comes is simply absent; the readers of the file see the gap. A disk that fails is complained of
    in `health` while the flight goes on.
    """

    service: ClassVar[str] = "recorder"

    def __init__(self, settings: Settings, file: FlightFile) -> None:
        super().__init__()
        self.tick_period_ns = nanoseconds(settings.recorder.flush_period_s)
        self._file = file
        self._pictures = PictureEncoder(settings.recorder)
        self._pictures_refused = 0
        for topic in topics.read_by(self.service):
            self.subscribe(topic, self._on_frame if topic.has_pixels else self._on_any)

    def on_tick(self, now_ns: int) -> Outputs:  # noqa: ARG002
        """Let nothing wait in memory for longer than the flush period."""
        self._file.flush()
        return ()

    def counters(self) -> Mapping[str, int]:
        """Messages written, messages lost to a failing disk or an unknown sender, pictures that were none."""
        return {
            "recorded": self._file.written,
            "lost": self._file.lost,
            "pictures_refused": self._pictures_refused,
        }

    def complaints(self, now_ns: int) -> tuple[str, ...]:  # noqa: ARG002
        """Whether the recording has ended too early."""
        if self._file.failure is None:
            return ()
        return (
            f"recording to {self._file.path.name} stopped: {self._file.failure}; {self._file.lost} messages lost; "
            "make room in recorder.directory and restart the recorder",
        )

    def close(self) -> None:
        """Complete the file."""
        self._file.finish()

    def _on_any(self, arrival: Arrival[Any]) -> Outputs:
        self._file.add(arrival.topic, arrival.message, arrival.now_ns)
        return ()

    def _on_frame(self, arrival: Arrival[FrameHeader]) -> Outputs:
        header = arrival.message
        self._file.add(arrival.topic, header, arrival.now_ns)
        if arrival.pixels is None or not self._pictures.wants(header):
            return ()
        try:
            data = self._pictures.encode(header, arrival.pixels)
        except PictureError:
            self._pictures_refused += 1
            return ()
        self._file.add_picture(arrival.topic, header, data, arrival.now_ns)
        return ()
