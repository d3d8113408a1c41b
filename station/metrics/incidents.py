"""What the services complained of, and which of them started again."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from schemas.health import Health


class IncidentKind(StrEnum):
    """What happened."""

    RESTARTED = "restarted"
    """The service's process began anew."""
    STALE = "stale input"
    """A topic was silent for longer than its limit."""
    COMPLAINT = "complaint"
    """The service said that something is wrong."""


@dataclass(frozen=True)
class Incident:
    """Something that health reported, once or for a while."""

    service: str
    kind: IncidentKind
    detail: str
    """In words; of a repeated one the first."""
    first_at_ns: int
    last_at_ns: int
    reports: int
    """In how many health reports it stood."""


def incidents(reports: Sequence[Health]) -> tuple[Incident, ...]:
    """All incidents in order of time; complaints that differ only in their numbers are one."""
    found: dict[tuple[str, IncidentKind, str], Incident] = {}
    newest: dict[str, Health] = {}
    for report in reports:
        for kind, detail in _of_one_report(report, newest.get(report.service)):
            key = (report.service, kind, _sameness(kind, detail, report))
            known = found.get(key) or Incident(report.service, kind, detail, report.at_ns, report.at_ns, 0)
            found[key] = Incident(known.service, kind, known.detail, known.first_at_ns, report.at_ns, known.reports + 1)
        newest[report.service] = report
    return tuple(sorted(found.values(), key=lambda incident: (incident.first_at_ns, incident.service)))


def _of_one_report(report: Health, before: Health | None) -> list[tuple[IncidentKind, str]]:
    listed: list[tuple[IncidentKind, str]] = []
    if before is not None and (report.uptime_s < before.uptime_s or report.pid != before.pid):
        listed.append((IncidentKind.RESTARTED, f"began anew {report.uptime_s:.1f} s before this report"))
    stale = [entry.topic for entry in report.inputs if entry.stale]
    listed += [(IncidentKind.STALE, topic) for topic in stale]
    said = [text for text in report.complaints if not any(text.startswith(f"{topic} silent") for topic in stale)]
    return listed + [(IncidentKind.COMPLAINT, text) for text in said]


def _sameness(kind: IncidentKind, detail: str, report: Health) -> str:
    return f"{report.at_ns}" if kind is IncidentKind.RESTARTED else re.sub(r"\d+(\.\d+)?", "#", detail)
