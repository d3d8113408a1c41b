"""A flight's line in the results."""

from collections.abc import Mapping
from typing import Any

from station.campaign.flight_task import FlightTask
from station.metrics.pad_error import rms_horizontal_m
from station.metrics.summary import FlightSummary

Row = dict[str, Any]
"""The columns by name: `index`, the factors by their keys, then `MEASURED`; what is unknown is None."""

CRASHED, TIMED_OUT = "crashed", "timed_out"
"""Outcomes beside those of `station.metrics.verdict`: the flight's program failed, or was ended because it hung."""

MEASURED: Mapping[str, type] = {
    "outcome": str,
    "landed": bool,
    "reason": str,
    "error_m": float,
    "touchdown_error_m": float,
    "touchdown_north_m": float,
    "touchdown_east_m": float,
    "rest_error_m": float,
    "sink_rate_mps": float,
    "landing_s": float,
    "path_m": float,
    "flown_s": float,
    "detection_rate": float,
    "fixes_accepted": int,
    "estimate_rms_m": float,
    "latency_p50_ms": float,
    "latency_p99_ms": float,
}
"""What is measured; docs/campaigns.md says what each means."""


def flown_row(task: FlightTask, summary: FlightSummary, failure: str | None, flown_s: float) -> Row:
    """The line of a flight that came to an end.

    Args:
        task: What was to be flown.
        summary: What came of it.
        failure: Why it was given up, if it was.
        flown_s: Virtual seconds.
    """
    contact, detection, latency = summary.touchdown, summary.detection, summary.latency
    ok = summary.verdict.ok and failure is None
    return _row(task) | {
        "outcome": summary.verdict.outcome.value,
        "landed": ok,
        "reason": "" if ok else (failure or summary.verdict.reason),
        "error_m": summary.verdict.error_m,
        "touchdown_error_m": contact.error_m if contact else None,
        "touchdown_north_m": contact.contact_ned_m[0] if contact else None,
        "touchdown_east_m": contact.contact_ned_m[1] if contact else None,
        "rest_error_m": contact.rest_error_m if contact else None,
        "sink_rate_mps": contact.sink_rate_mps if contact else None,
        "landing_s": contact.after_s if contact else None,
        "path_m": contact.distance_flown_m if contact else None,
        "flown_s": flown_s,
        "detection_rate": detection.rate if detection else None,
        "fixes_accepted": dict(detection.fixes).get("accepted", 0) if detection else None,
        "estimate_rms_m": rms_horizontal_m(summary.errors.estimate),
        "latency_p50_ms": latency.total.p50_ms if latency else None,
        "latency_p99_ms": latency.total.p99_ms if latency else None,
    }


def failed_row(task: FlightTask, outcome: str, reason: str) -> Row:
    """The line of a flight that came to no end: `CRASHED` or `TIMED_OUT`."""
    return _row(task) | {"outcome": outcome, "landed": False, "reason": reason}


def _row(task: FlightTask) -> Row:
    return {"index": task.index, **task.drawn, **dict.fromkeys(MEASURED)}
