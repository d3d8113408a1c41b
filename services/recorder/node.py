"""Records every topic, each message when it arrives, into one file a flight."""

from collections.abc import Mapping
from typing import Any, ClassVar

from alight.runtime.clock import nanoseconds
from alight.runtime.node import Arrival, Node, Outputs
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.frame import FrameHeader
from schemas.mission import MissionRequest, Verb
from schemas.settings import Settings
from services.recorder import layout
from services.recorder.entries import EntryMaker
from services.recorder.entry import Entry, Picture
from services.recorder.picture import FrameChooser
from services.recorder.provenance import Document
from services.recorder.recording import Recording

LATE_US = 1_000_000
"""Data that waits longer than this for the operating system is complained of: a crash would lose it."""


class Recorder(Node):
    """Writes what it hears. It publishes nothing, so that recording a flight cannot change it.

    A message that never comes is simply absent; the readers of the file see the gap. A disk that fails is complained of
    in `health` while the flight goes on.
    """

    service: ClassVar[str] = "recorder"
    frames_waiting: ClassVar[int] = 120  # it runs in the background, so it may have to wait some seconds for its turn
    takes_any_age: ClassVar[bool] = True

    def __init__(self, settings: Settings, recording: Recording) -> None:
        super().__init__()
        self.tick_period_ns = nanoseconds(settings.recorder.flush_period_s)
        self._recording = recording
        self._frames = FrameChooser(settings.recorder)
        self._entries = EntryMaker(settings)
        self._backlog_told = 0
        self._late_told_us = LATE_US
        for topic in topics.read_by(self.service):
            self.subscribe(topic, self._on_frame if topic.has_pixels else self._on_any)
        self.subscribe(topics.CALIBRATION, self._on_calibration)
        self.subscribe(topics.REQUEST, self._on_request)

    def on_tick(self, now_ns: int) -> Outputs:
        """Let nothing wait in memory for longer than the flush period."""
        self._recording.tick(now_ns)
        return ()

    def counters(self) -> Mapping[str, int]:
        """See `Tally`."""
        tally = self._recording.tally
        return {**tally.counters(), "lost": tally.lost}

    def complaints(self, now_ns: int) -> tuple[str, ...]:  # noqa: ARG002
        """Whether the recording has stopped, or has lost something, or was late, since this was last asked."""
        tally, failure = self._recording.tally, self._recording.failure
        said = []
        if failure is not None:
            said.append(
                f"recording to {self._recording.path.name} stopped: {failure}; {tally.lost_disk} messages lost; "
                "make room in recorder.directory: it goes on by itself"
            )
        if tally.lost_backlog > self._backlog_told:
            said.append(f"{tally.lost_backlog - self._backlog_told} messages or pictures lost: the disk is too slow")
            self._backlog_told = tally.lost_backlog
        if tally.at_risk_max_us > self._late_told_us:
            said.append(f"the disk was {tally.at_risk_max_us / 1e6:.1f} s behind")
            self._late_told_us = tally.at_risk_max_us
        if self._recording.quota_exceeded_bytes > 0:
            said.append("this recording alone is longer than recorder.quota_mb")
        return tuple(said)

    def close(self) -> None:
        """Complete the file."""
        self._recording.finish()

    def _on_any(self, arrival: Arrival[Any]) -> Outputs:
        self._add(self._entries.of_message(arrival.topic, arrival.message, arrival.received_at_ns, arrival.now_ns))
        return ()

    def _on_calibration(self, arrival: Arrival[CameraCalibration]) -> Outputs:
        # Without its stamp it is a new document only when the camera has changed.
        text = arrival.message.model_dump_json(indent=1, exclude={"at_ns"})
        self._recording.keep_document(Document(layout.CALIBRATION_ATTACHMENT, "application/json", text.encode()))
        return self._on_any(arrival)

    def _on_request(self, arrival: Arrival[MissionRequest]) -> Outputs:
        self._on_any(arrival)
        if arrival.message.verb is Verb.LAND:
            self._recording.trigger()
        return ()

    def _on_frame(self, arrival: Arrival[FrameHeader]) -> Outputs:
        self._on_any(arrival)
        header = arrival.message
        if arrival.pixels is not None and self._frames.wants(header):
            picture = Picture(header, arrival.pixels)
            self._add(self._entries.of_picture(arrival.topic, header, picture, arrival.received_at_ns, arrival.now_ns))
        return ()

    def _add(self, entry: Entry | None) -> None:
        if entry is None:
            self._recording.tally.lost_unknown += 1
        else:
            self._recording.add(entry)
