"""Each service's health over the flight, as series."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from schemas.health import Health
from station.metrics.incidents import Incident, IncidentKind

Series = NDArray[np.float64]


@dataclass(frozen=True)
class ServiceHealth:
    """One service; every series is (N,), one value a report, NaN where the report says nothing."""

    service: str
    at_ns: NDArray[np.int64]
    """Times of the reports, UTC ns."""
    output_hz: Series
    """Messages published a second, all topics together."""
    handling_p99_ms: Series
    """99th percentile of the time to handle one message, ms."""
    lost: Series
    """Messages overwritten before they were taken up, or refused, since the report before."""
    stale: Series
    """How many inputs were silent for too long."""
    restarts_at_ns: tuple[int, ...]
    """First reports after each restart, UTC ns."""
    dropped: int
    """Messages overwritten, in the whole flight."""
    refused: dict[str, int]
    """Messages refused in the whole flight, by reason."""


def health_history(reports: Sequence[Health], found: Sequence[Incident] = ()) -> tuple[ServiceHealth, ...]:
    """One history a service, by name.

    Args:
        reports: Health of all services, in order of time.
        found: The flight's incidents: they tell the restarts.
    """
    names = sorted({report.service for report in reports})
    return tuple(_history(name, [report for report in reports if report.service == name], found) for name in names)


def _history(service: str, reports: Sequence[Health], found: Sequence[Incident]) -> ServiceHealth:
    dropped = np.array([sum(entry.dropped for entry in report.inputs) for report in reports], float)
    refused = np.array([sum(sum(entry.refused.values()) for entry in report.inputs) for report in reports], float)
    p99 = [np.nan if report.handling_p99_ms is None else report.handling_p99_ms for report in reports]
    restarts = tuple(i.first_at_ns for i in found if i.service == service and i.kind is IncidentKind.RESTARTED)
    return ServiceHealth(
        service=service,
        at_ns=np.array([report.at_ns for report in reports], np.int64),
        output_hz=np.array([sum(entry.rate_hz for entry in report.outputs) for report in reports], float),
        handling_p99_ms=np.array(p99, float),
        lost=_risen(dropped) + _risen(refused),
        stale=np.array([sum(entry.stale for entry in report.inputs) for report in reports], float),
        restarts_at_ns=restarts,
        dropped=int(_risen(dropped).sum()),
        refused=_refused_by_reason(reports),
    )


def _risen(counter: Series) -> Series:
    """How much a counter since start rose from report to report; one that fell began anew at zero."""
    steps = np.diff(counter, prepend=0.0)
    return np.where(steps < 0.0, counter, steps)


def _refused_by_reason(reports: Sequence[Health]) -> dict[str, int]:
    reasons = sorted({reason for report in reports for entry in report.inputs for reason in entry.refused})
    totals = {
        reason: _risen(
            np.array([sum(entry.refused.get(reason, 0) for entry in report.inputs) for report in reports], float)
        )
        for reason in reasons
    }
    return {reason: int(steps.sum()) for reason, steps in totals.items() if steps.sum() > 0}
