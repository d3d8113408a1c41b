"""How often the pad was seen, and what became of what was seen."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from schemas.detection import Detection, Marker
from schemas.fix import PadFix
from schemas.frame import FrameHeader


@dataclass(frozen=True)
class PadMarker:
    """Which marker is the pad."""

    family: str
    id: int

    def among(self, detection: Detection) -> Marker | None:
        """The pad's marker in a detection; None if it is not there."""
        return next((m for m in detection.markers if m.id == self.id and m.family == self.family), None)


@dataclass(frozen=True)
class PadMarkers:
    """All markers of a pad: seeing one of them is seeing the pad."""

    markers: tuple[PadMarker, ...]

    def among(self, detection: Detection) -> tuple[Marker, ...]:
        """Those of them in a detection, the largest print first."""
        found = [marker for name in self.markers if (marker := name.among(detection)) is not None]
        return tuple(sorted(found, key=lambda marker: -marker.side_m))


@dataclass(frozen=True)
class DetectionRate:
    """Frames between the start of the search and the touchdown."""

    frames: int
    """Frames that the camera published (and the recorder heard)."""
    examined: int
    """Frames that the detector answered for."""
    seen: int
    """Frames with a marker of the pad in them."""
    first_seen_at_ns: int | None
    last_seen_at_ns: int | None
    fixes: tuple[tuple[str, int], ...]
    """Fixes by verdict, most frequent first."""

    @property
    def rate(self) -> float | None:
        """Frames with the pad's marker, of those examined, 0 to 1; None if there were none."""
        return self.seen / self.examined if self.examined else None


def detection_rate(
    frames: Sequence[FrameHeader],
    detections: Sequence[Detection],
    fixes: Sequence[PadFix],
    *,
    pad: PadMarkers,
    began_at_ns: int,
    ended_at_ns: int,
) -> DetectionRate:
    """Count what was captured between two times, UTC ns."""

    def within(message: FrameHeader | Detection | PadFix) -> bool:
        return began_at_ns <= message.captured_at_ns <= ended_at_ns

    examined = [detection for detection in detections if within(detection)]
    seen_ns = [detection.captured_at_ns for detection in examined if pad.among(detection)]
    verdicts = Counter(fix.verdict.value for fix in fixes if within(fix))
    return DetectionRate(
        frames=sum(within(frame) for frame in frames),
        examined=len(examined),
        seen=len(seen_ns),
        first_seen_at_ns=min(seen_ns, default=None),
        last_seen_at_ns=max(seen_ns, default=None),
        fixes=tuple(sorted(verdicts.items(), key=lambda item: (-item[1], item[0]))),
    )
