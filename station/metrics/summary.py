"""Everything worth saying about one flight."""

import math
from dataclasses import dataclass

from pydantic import ValidationError

from alight.geometry.local import ned_between
from alight.markers.family import FamilyError
from alight.markers.layout import LayoutError, layout_from
from schemas import topics
from schemas.message import GlobalPosition
from schemas.mission import Phase
from schemas.settings.pad import PadSettings
from station.flight_record import FlightRecord
from station.metrics.detection_rate import DetectionRate, PadMarker, PadMarkers, detection_rate
from station.metrics.incidents import Incident, IncidentKind, incidents
from station.metrics.latency import LatencyBudget, latency_budget
from station.metrics.pad_error import PadError, pad_errors
from station.metrics.paper import PaperMetrics, paper_metrics
from station.metrics.phases import LandingPart, PhaseSpan, landing_part, phase_spans
from station.metrics.touchdown import Touchdown, touchdown
from station.metrics.truth_track import TruthTrack
from station.metrics.verdict import Verdict, judge

PAD_RADIUS_M = 0.5
"""Half the side of the paper's pad."""
_NEAR_GROUND = frozenset({Phase.TOUCHDOWN, Phase.LANDED})


@dataclass(frozen=True)
class PadErrors:
    """Measured vectors to the pad against the truth, during the landing."""

    raw: tuple[PadError, ...]
    """Fixes before the correction."""
    corrected: tuple[PadError, ...]
    """Fixes after it."""
    estimate: tuple[PadError, ...]
    """The filter's estimates."""


@dataclass(frozen=True)
class FlightSummary:
    """One flight in numbers; what could not be measured is None."""

    verdict: Verdict
    phases: tuple[PhaseSpan, ...]
    landing: LandingPart | None
    paper: PaperMetrics | None
    touchdown: Touchdown | None
    detection: DetectionRate | None
    latency: LatencyBudget | None
    errors: PadErrors
    incidents: tuple[Incident, ...]
    """Of the whole flight; those of the landing that were not expected are `landing_incidents`."""

    @property
    def landing_incidents(self) -> tuple[Incident, ...]:
        """Incidents reported while it landed, but for those that are expected."""
        part = self.landing
        if part is None:
            return ()
        return tuple(
            i
            for i in self.incidents
            if i.last_at_ns >= part.began_at_ns and i.first_at_ns <= part.ended_at_ns and not self.is_expected(i)
        )

    def is_expected(self, incident: Incident) -> bool:
        """Whether it belongs to a good landing: near the ground the pad leaves the picture, and no estimate comes any more.

        Detections and fixes come on even then, and say that nothing was seen: their silence is never expected.
        """
        if incident.kind is not IncidentKind.STALE or incident.detail != topics.PAD_ESTIMATE.name:
            return False
        during = [
            span.phase
            for span in self.phases
            if span.began_at_ns <= incident.last_at_ns and span.ended_at_ns > incident.first_at_ns
        ] or [span.phase for span in self.phases[-1:]]
        return bool(during) and all(phase in _NEAR_GROUND for phase in during)


def summarise(record: FlightRecord, pad_radius_m: float = PAD_RADIUS_M) -> FlightSummary:
    """Measure one flight.

    Args:
        record: The flight.
        pad_radius_m: How far from the pad's centre still counts as on the pad, metres.
    """
    spans = phase_spans(record.messages(topics.MISSION_STATUS))
    part = landing_part(spans)
    found = incidents(record.messages(topics.HEALTH), part.began_at_ns if part else None)
    truths = record.messages(topics.GROUND_TRUTH)
    if part is None:
        verdict = judge(spans, None, None, pad_radius_m, by_truth=bool(truths))
        return FlightSummary(verdict, spans, None, None, None, None, None, PadErrors((), (), ()), found)
    contact = touchdown(truths, part)
    error_m = max(contact.error_m, contact.rest_error_m) if contact else None
    if not truths and part.landed:
        error_m = _believed_error_m(record, part)
    pad = pad_place(record)
    return FlightSummary(
        verdict=judge(spans, part, error_m, pad_radius_m, by_truth=bool(truths)),
        phases=spans,
        landing=part,
        paper=paper_metrics(record.messages(topics.VEHICLE_STATE), pad, part) if pad else None,
        touchdown=contact,
        detection=_detection(record, part, contact),
        latency=latency_budget(s for s in record.messages(topics.SETPOINT) if part.holds(s.captured_at_ns)),
        errors=_errors(record, part),
        incidents=found,
    )


def pad_markers(record: FlightRecord) -> PadMarkers:
    """The pad's markers by the flight's settings; the paper's pad where there are none, or its layout is not on this machine."""
    settings = {key: record.setting("pad", key, value) for key, value in PadSettings().model_dump().items()}
    try:
        placed = layout_from(PadSettings.model_validate(settings)).markers
    except (LayoutError, FamilyError, ValidationError):
        return PadMarkers((PadMarker(str(settings["family"]), int(settings["id"])),))
    return PadMarkers(tuple(PadMarker(marker.family, marker.id) for marker in placed))


def pad_place(record: FlightRecord) -> GlobalPosition | None:
    """The pad's true place, or else where the last estimate has it; None if nothing says."""
    truths, estimates = record.messages(topics.GROUND_TRUTH), record.messages(topics.PAD_ESTIMATE)
    if truths:
        return truths[-1].pad_position
    return estimates[-1].position if estimates else None


def _believed_error_m(record: FlightRecord, part: LandingPart) -> float | None:
    estimates = [e for e in record.messages(topics.PAD_ESTIMATE) if e.captured_at_ns <= part.ended_at_ns]
    states = [state for state in record.messages(topics.VEHICLE_STATE) if state.at_ns <= part.ended_at_ns]
    if not estimates or not states:
        return None
    return math.hypot(*ned_between(estimates[-1].position, states[-1].position)[:2].tolist())


def _detection(record: FlightRecord, part: LandingPart, contact: Touchdown | None) -> DetectionRate:
    return detection_rate(
        record.messages(topics.FRAME),
        record.messages(topics.DETECTION),
        record.messages(topics.PAD_FIX),
        pad=pad_markers(record),
        began_at_ns=part.looking_since_ns,
        ended_at_ns=contact.at_ns if contact else part.ended_at_ns,
    )


def _errors(record: FlightRecord, part: LandingPart) -> PadErrors:
    truth = TruthTrack(record.messages(topics.GROUND_TRUTH))
    fixes = [
        f for f in record.messages(topics.PAD_FIX) if part.looking_since_ns <= f.captured_at_ns <= part.ended_at_ns
    ]
    estimates = [
        estimate
        for estimate in record.messages(topics.PAD_ESTIMATE)
        if part.looking_since_ns <= estimate.captured_at_ns <= part.ended_at_ns
    ]
    return PadErrors(
        raw=pad_errors(((f.captured_at_ns, f.raw.pad_ned_m) for f in fixes if f.raw), truth),
        corrected=pad_errors(((f.captured_at_ns, f.corrected.pad_ned_m) for f in fixes if f.corrected), truth),
        estimate=pad_errors(((e.captured_at_ns, e.pad_ned_m) for e in estimates), truth),
    )
