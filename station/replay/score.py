"""How good fixes and estimates of a flight were: for the recorded ones and the replayed ones alike."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from alight.geometry.local import ned_between
from alight.runtime.clock import nanoseconds, seconds
from schemas import topics
from schemas.detection import Detection
from schemas.estimate import PadEstimate
from schemas.fix import FixVerdict, PadFix
from schemas.message import GlobalPosition, Message, Vector3
from schemas.mission import MissionStatus
from schemas.topics import Topic
from schemas.truth import GroundTruth
from station.metrics.detection_rate import PadMarker
from station.metrics.pad_error import pad_errors
from station.metrics.phases import landing_part, phase_spans
from station.metrics.touchdown import touchdown
from station.metrics.truth_track import TruthTrack
from station.replay.recording import ReplayRecording
from station.replay.result import Origin, ReplayResult

M = TypeVar("M", bound=Message)
_SCORED: tuple[Topic[Any], ...] = (topics.DETECTION, topics.PAD_FIX, topics.PAD_ESTIMATE)
SAMPLING_NS = nanoseconds(0.05)


@dataclass(frozen=True)
class Score:
    """One flight's fixes and estimates in numbers; what could not be measured is None."""

    reference: str
    """What they are measured against."""
    detections: int
    seen: int
    """Detections with the pad's marker."""
    fixes: int
    """Accepted ones."""
    estimates: int
    fix_rmse_m: float | None
    """Horizontal, of accepted and corrected fixes, metres."""
    fix_rmse_down_m: float | None
    estimate_rmse_m: float | None
    """Horizontal, metres."""
    estimate_rmse_down_m: float | None
    estimate_worst_m: float | None
    """Largest horizontal error, metres."""
    availability: float | None
    """Share of the time in which the newest estimate was not stale, 0 to 1."""

    @property
    def detection_rate(self) -> float | None:
        """Share of detections with the pad's marker, 0 to 1."""
        return self.seen / self.detections if self.detections else None

    def rows(self) -> Iterator[tuple[str, str]]:
        """Names and values for people, in the order of the rows."""
        yield "frames with the pad", _share(self.detection_rate)
        yield "accepted fixes", str(self.fixes)
        yield "fixes, RMSE horizontal", _length(self.fix_rmse_m)
        yield "fixes, RMSE vertical", _length(self.fix_rmse_down_m)
        yield "estimates", str(self.estimates)
        yield "estimates, RMSE horizontal", _length(self.estimate_rmse_m)
        yield "estimates, RMSE vertical", _length(self.estimate_rmse_down_m)
        yield "estimates, worst horizontal", _length(self.estimate_worst_m)
        yield "time with a fresh estimate", _share(self.availability)


@dataclass(frozen=True)
class Track:
    """Horizontal errors of a flight's estimates over time."""

    at_s: NDArray[np.float64]
    """Capture times since the first message, (N,) seconds."""
    error_m: NDArray[np.float64]
    """(N,) metres."""


class Scorer:
    """Measures messages of one flight between the start of the search for the pad and the landing's end."""

    def __init__(self, recording: ReplayRecording) -> None:
        self._recording = recording
        truths = list(_recorded(recording, topics.GROUND_TRUTH, GroundTruth))
        self._truth = TruthTrack(truths) if truths else None
        estimates = list(_recorded(recording, topics.PAD_ESTIMATE, PadEstimate))
        self._pad: GlobalPosition | None = estimates[-1].position if estimates else None
        pad: Mapping[str, Any] = recording.settings.get("pad", {})
        self._marker = PadMarker(pad.get("family", "5x5_1000"), pad.get("id", 68))
        part = landing_part(phase_spans(tuple(_recorded(recording, topics.MISSION_STATUS, MissionStatus))))
        contact = touchdown(truths, part) if part else None
        self._begin_ns = part.looking_since_ns if part else 0
        self._end_ns = part.ended_at_ns if part else 2**63 - 1
        if contact is not None:
            self._end_ns = contact.at_ns

    def recorded(self) -> Score:
        """The flight as it was."""
        return self._score({topic.name: self._recorded(topic) for topic in _SCORED})

    def replayed(self, result: ReplayResult) -> Score:
        """The flight as it would have been; topics that were not replayed are as they were."""
        return self._score({topic.name: self._replayed(topic, result) for topic in _SCORED})

    def recorded_track(self) -> Track:
        """The errors of the recorded estimates."""
        return self._track(self._recorded(topics.PAD_ESTIMATE))

    def replayed_track(self, result: ReplayResult) -> Track:
        """The errors of the replayed ones."""
        return self._track(self._replayed(topics.PAD_ESTIMATE, result))

    def _recorded(self, topic: Topic[Any]) -> Sequence[Message]:
        return list(_recorded(self._recording, topic, Message))

    def _replayed(self, topic: Topic[Any], result: ReplayResult) -> Sequence[Message]:
        if topic.name not in result.counts:
            return self._recorded(topic)
        return [output.message for output in result.of(topic.name) if output.origin is not Origin.UNHEARD]

    def _track(self, messages: Sequence[Message]) -> Track:
        estimates = list(self._within(messages, PadEstimate))
        measured = [
            (e.captured_at_ns, self._errors_m([(e.captured_at_ns, e.pad_ned_m, e.position)])) for e in estimates
        ]
        known = [(at_ns, error_m[0]) for at_ns, error_m in measured if len(error_m)]
        origin_ns = min((stored.logged_at_ns for stored in self._recording.stored), default=0)
        return Track(
            np.array([seconds(at_ns - origin_ns) for at_ns, _ in known]),
            np.array([float(np.hypot(error_m[0], error_m[1])) for _, error_m in known]),
        )

    def _score(self, messages: Mapping[str, Sequence[Message]]) -> Score:
        detections = list(self._within(messages[topics.DETECTION.name], Detection))
        fixes = [f for f in self._within(messages[topics.PAD_FIX.name], PadFix) if f.verdict is FixVerdict.ACCEPTED]
        estimates = list(self._within(messages[topics.PAD_ESTIMATE.name], PadEstimate))
        fix_errors_m = self._errors_m(
            (f.captured_at_ns, f.corrected.pad_ned_m, f.corrected.position) for f in fixes if f.corrected
        )
        estimate_errors_m = self._errors_m((e.captured_at_ns, e.pad_ned_m, e.position) for e in estimates)
        return Score(
            reference="the ground truth" if self._truth else "the last estimate",
            detections=len(detections),
            seen=sum(self._marker.among(detection) is not None for detection in detections),
            fixes=len(fixes),
            estimates=len(estimates),
            fix_rmse_m=_rmse(fix_errors_m[:, :2]),
            fix_rmse_down_m=_rmse(fix_errors_m[:, 2:]),
            estimate_rmse_m=_rmse(estimate_errors_m[:, :2]),
            estimate_rmse_down_m=_rmse(estimate_errors_m[:, 2:]),
            estimate_worst_m=float(np.hypot(*estimate_errors_m[:, :2].T).max()) if len(estimate_errors_m) else None,
            availability=self._availability(estimates),
        )

    def _within(self, messages: Iterable[Message], kind: type[M]) -> Iterator[M]:
        return (m for m in messages if isinstance(m, kind) and self._begin_ns <= m.stamp_ns <= self._end_ns)

    def _errors_m(self, measured: Iterable[tuple[int, Vector3, GlobalPosition]]) -> NDArray[np.float64]:
        """Errors of the pad's place, north, east, down, (N, 3) metres."""
        if self._truth is not None:
            errors = pad_errors(((captured_at_ns, ned_m) for captured_at_ns, ned_m, _ in measured), self._truth)
            return np.array([error.ned_m for error in errors], float).reshape(-1, 3)
        if self._pad is None:
            return np.empty((0, 3))
        pad = self._pad
        return np.array([ned_between(pad, position) for _, _, position in measured], float).reshape(-1, 3)

    def _availability(self, estimates: Sequence[PadEstimate]) -> float | None:
        """Sampled between the first and the last detection."""
        detections_ns = [stored.stamp_ns for stored in self._recording.of(topics.DETECTION)] or [
            stored.stamp_ns for stored in self._recording.of(topics.FRAME)
        ]
        inside_ns = [at_ns for at_ns in detections_ns if self._begin_ns <= at_ns <= self._end_ns]
        if len(inside_ns) < 2:
            return None
        asked_ns = np.arange(min(inside_ns), max(inside_ns), SAMPLING_NS)
        # The end of the hops is when it was published; what there was not in flight has its own.
        known_ns = np.array([e.hops[-1].published_at_ns if e.hops else e.captured_at_ns for e in estimates], np.int64)
        captured_ns = np.array([e.captured_at_ns for e in estimates], np.int64)
        if not len(known_ns):
            return 0.0
        newest = np.searchsorted(known_ns, asked_ns, side="right") - 1
        age_ns = asked_ns - captured_ns[np.maximum(newest, 0)]
        stale_after_s = topics.PAD_ESTIMATE.stale_after_s or 1.0
        return float(np.mean((newest >= 0) & (age_ns <= nanoseconds(stale_after_s))))


def _recorded(recording: ReplayRecording, topic: Topic[Any], kind: type[M]) -> Iterator[M]:
    for stored in recording.of(topic):
        message = recording.message(topic, stored.stamp_ns)
        if isinstance(message, kind):
            yield message


def _rmse(errors_m: NDArray[np.float64]) -> float | None:
    return float(np.sqrt(np.mean(np.sum(np.square(errors_m), axis=1)))) if len(errors_m) else None


def _length(value_m: float | None) -> str:
    return "-" if value_m is None else f"{100 * value_m:.2f} cm"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.1%}"
