"""Several recordings as the rows of a campaign."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from station.flight_record import FlightRecord, read_flight
from station.metrics.pad_error import rms_horizontal_m
from station.metrics.summary import FlightSummary, summarise
from station.report.campaign import write_campaign_report
from station.report.campaign_rows import EAST_M, ERROR_M, INDEX, LANDED, NAME, NORTH_M, OUTCOME, REASON, RECORDING
from station.report.configuration import differences

_NO_FACTORS = ("recorder.", "bus.")
PAGE = "flights.html"


@dataclass
class Flights:
    """Recordings that are reported on together."""

    paths: list[Path] = field(default_factory=list)
    rows: list[dict[str, Any]] = field(default_factory=list)
    settings: list[Mapping[str, Any]] = field(default_factory=list)

    def add(self, path: Path, record: FlightRecord, summary: FlightSummary) -> None:
        """Take one flight in."""
        name = path.name if path.is_dir() or path.stem != "flight" else path.parent.name
        row = flight_row(summary) | {INDEX: len(self.rows), NAME: name}
        self.paths.append(path)
        self.rows.append(row)
        self.settings.append(record.provenance.settings)

    def write(self, page: Path | None) -> Path:
        """Write the page over all of them.

        Args:
            page: Where to; by default in the folder that holds them all.

        Raises:
            ReportError: If it cannot be written.
        """
        target = page or self._folder() / PAGE
        varied = self._varied()
        rows = [
            {**row, **factors, RECORDING: os.path.relpath(path, target.parent)}
            for row, factors, path in zip(self.rows, varied, self.paths, strict=True)
        ]
        return write_campaign_report(rows, target, "Flights")

    def _folder(self) -> Path:
        folders = [path.resolve() if path.is_dir() else path.resolve().parent for path in self.paths]
        return Path(os.path.commonpath(folders))

    def _varied(self) -> Sequence[Mapping[str, Any]]:
        """Of each flight the settings in which the flights differ from each other; the default where it has none."""
        changed = [differences(settings) for settings in self.settings]
        default = {key: standard for flight in changed for key, _, standard in flight}
        each = [{**default, **{key: value for key, value, _ in flight}} for flight in changed]
        keys = [
            key
            for key in default
            if not key.startswith(_NO_FACTORS) and key != "seed" and len({flight[key] for flight in each}) > 1
        ]
        return [{key: _number_or_text(flight[key]) for key in keys} for flight in each]


def flight_row(summary: FlightSummary) -> dict[str, Any]:
    """What a campaign's row says of a flight, from its summary."""
    contact, detection, latency = summary.touchdown, summary.detection, summary.latency
    return {
        OUTCOME: summary.verdict.outcome.value,
        LANDED: summary.verdict.ok,
        REASON: "" if summary.verdict.ok else summary.verdict.reason,
        ERROR_M: contact.error_m if contact else None,
        NORTH_M: contact.contact_ned_m[0] if contact else None,
        EAST_M: contact.contact_ned_m[1] if contact else None,
        "sink_rate_mps": contact.sink_rate_mps if contact else None,
        "landing_s": contact.after_s if contact else None,
        "path_m": contact.distance_flown_m if contact else None,
        "detection_rate": detection.rate if detection else None,
        "estimate_rms_m": rms_horizontal_m(summary.errors.estimate),
        "latency_p99_ms": latency.total.p99_ms if latency else None,
    }


def read_and_summarise(path: Path, pad_radius_m: float) -> tuple[FlightRecord, FlightSummary]:
    """A recording and what it was worth.

    Raises:
        FlightRecordError: If it cannot be read.
    """
    record = read_flight(path)
    return record, summarise(record, pad_radius_m)


def _number_or_text(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
