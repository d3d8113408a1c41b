"""What the services complained of, and which of them started again."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from schemas.health import Health

NUMBER = r"\d+(\.\d+)?"


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


def incidents(reports: Sequence[Health], all_there_ns: int | None = None) -> tuple[Incident, ...]:
    """All incidents in order of time.

    Args:
        reports: Health of all services, in order of time.
        all_there_ns: When all services had to be running already (the landing began); one whose first report says that it
            began later was started again before it could report at all.

    An incident lasts while each report of the service repeats it (numbers in it may change); what comes back after a
    report without it is another one.
    """
    ended: list[Incident] = []
    going_on: dict[str, dict[str, Incident]] = {}
    newest: dict[str, Health] = {}
    for report in reports:
        before = going_on.get(report.service, {})
        now: dict[str, Incident] = {}
        for kind, detail in _of_one_report(report, newest.get(report.service), all_there_ns):
            key = _sameness(kind, detail)
            known = before.get(key) or Incident(report.service, kind, detail, report.at_ns, report.at_ns, 0)
            now[key] = replace(known, last_at_ns=report.at_ns, reports=known.reports + 1)
        ended += [incident for key, incident in before.items() if key not in now]
        going_on[report.service], newest[report.service] = now, report
    ended += [incident for open_ones in going_on.values() for incident in open_ones.values()]
    return tuple(sorted(ended, key=lambda incident: (incident.first_at_ns, incident.service, incident.detail)))


def _of_one_report(report: Health, before: Health | None, all_there_ns: int | None) -> list[tuple[IncidentKind, str]]:
    listed: list[tuple[IncidentKind, str]] = []
    if before is None:
        anew = all_there_ns is not None and report.at_ns - report.uptime_s * 1e9 > all_there_ns
    else:
        anew = report.uptime_s < before.uptime_s or report.pid != before.pid
    if anew:
        listed.append((IncidentKind.RESTARTED, f"began anew {report.uptime_s:.1f} s before this report"))
    stale = [entry.topic for entry in report.inputs if entry.stale]
    listed += [(IncidentKind.STALE, topic) for topic in stale]
    said = [text for text in report.complaints if not any(text.startswith(f"{topic} silent") for topic in stale)]
    return listed + [(IncidentKind.COMPLAINT, text) for text in said]


def _sameness(kind: IncidentKind, detail: str) -> str:
    return f"{kind}: {re.sub(NUMBER, '#', detail)}"
