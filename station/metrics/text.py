"""A flight's summary as text for the terminal."""

from alight.runtime.clock import seconds
from station.metrics.latency import Stage
from station.metrics.pad_error import rms_horizontal_m
from station.metrics.summary import FlightSummary

_WIDTH = 21


def summary_line(summary: FlightSummary) -> str:
    """The flight in one line, such as `landed 3.1 cm from the pad's centre after 17.4 s`."""
    verdict = summary.verdict
    if not verdict.ok:
        return verdict.reason
    time_s = _time_s(summary)
    error_m = summary.touchdown.error_m if summary.touchdown else verdict.error_m
    by = "" if verdict.by_truth else " (by its own estimate)"
    return f"landed {length(error_m or 0.0)} from the pad's centre{by} after {time_s or 0.0:.1f} s"


def _time_s(summary: FlightSummary) -> float | None:
    """From the beginning of the descent to the true contact; where no truth knows that, the paper's time."""
    if summary.touchdown is not None:
        return summary.touchdown.after_s
    if summary.paper is not None and summary.paper.time_s is not None:
        return summary.paper.time_s
    part = summary.landing
    return seconds(part.ended_at_ns - part.began_at_ns) if part else None


def summary_lines(summary: FlightSummary) -> list[str]:
    """The line and everything measured below it."""
    measured = (_flown, _touched, _seen, _errors, _latency, _phases)
    rows = [row for rows_of in measured for row in rows_of(summary)]
    text = [summary_line(summary)] + [f"  {name:<{_WIDTH}}{value}" for name, value in rows]
    if summary.landing_incidents:
        text.append("  incidents while landing")
        text += [f"    {i.service}: {i.kind.value}: {i.detail} ({i.reports}x)" for i in summary.landing_incidents]
    return text


def length(length_m: float) -> str:
    """A length as people say it: centimetres below a metre."""
    return f"{length_m * 100:.1f} cm" if abs(length_m) < 1.0 else f"{length_m:.2f} m"


def _flown(summary: FlightSummary) -> list[tuple[str, str]]:
    paper = summary.paper
    if paper is None:
        return []
    true = f", {summary.touchdown.distance_flown_m:.2f} m by the truth" if summary.touchdown else ""
    flown = f"{paper.distance_m:.2f} m ({paper.straight_line_m:.2f} m in a straight line{true})"
    if paper.time_s is None:
        return [("distance flown", flown), ("time to land", "never reached the ground")]
    return [
        ("distance flown", flown),
        ("time to land", f"{paper.time_s:.1f} s (paper, Eq. 30: 0.2 % of the height at begin and end left out)"),
        ("last ten positions", f"RMSE {length(paper.rmse_m)} ({paper.rmse_1e7_deg:.2f}e-7 deg) as navigated"),
    ]


def _touched(summary: FlightSummary) -> list[tuple[str, str]]:
    contact = summary.touchdown
    if contact is None:
        return []
    where = f"{length(contact.error_m)} off at contact, {length(contact.rest_error_m)} at rest"
    when = f"{contact.after_s:.1f} s after the descent began"
    return [("true touchdown", f"{where}, sinking {contact.sink_rate_mps:.2f} m/s, {when}")]


def _seen(summary: FlightSummary) -> list[tuple[str, str]]:
    detection = summary.detection
    if detection is None or detection.rate is None:
        return [("pad seen", "no frame was examined")] if detection else []
    unexamined = detection.frames - detection.examined
    skipped = f", {unexamined} frames skipped" if unexamined > 0 else ""
    fixes = ", ".join(f"{count} {verdict}" for verdict, count in detection.fixes)
    return [
        ("pad seen", f"in {detection.seen} of {detection.examined} frames ({detection.rate:.1%}{skipped})"),
        ("fixes", fixes or "none"),
    ]


def _errors(summary: FlightSummary) -> list[tuple[str, str]]:
    errors = summary.errors
    named = (("estimate", errors.estimate), ("raw fix", errors.raw), ("corrected fix", errors.corrected))
    known = [(name, rms_horizontal_m(series)) for name, series in named]
    text = ", ".join(f"{name} {length(rms_m)}" for name, rms_m in known if rms_m is not None)
    return [("horizontal RMS error", text)] if text else []


def _latency(summary: FlightSummary) -> list[tuple[str, str]]:
    budget = summary.latency
    if budget is None:
        return []
    total, rest = budget.total, budget.overhead
    by_service: dict[str, list[str]] = {}
    for stage in budget.stages:
        kind = "" if stage.stage in (Stage.CAMERA, Stage.HANDLING) else f" {stage.stage.value}"
        by_service.setdefault(stage.service, []).append(f"{stage.time.p50_ms:.2f}{kind}")
    return [
        ("capture to setpoint", f"p50 {total.p50_ms:.1f} ms, p99 {total.p99_ms:.1f} ms ({budget.setpoints} setpoints)"),
        ("without the detector", f"p50 {rest.p50_ms:.1f} ms, p99 {rest.p99_ms:.1f} ms"),
        ("median by stage, ms", "; ".join(f"{name} {' + '.join(parts)}" for name, parts in by_service.items())),
    ]


def _phases(summary: FlightSummary) -> list[tuple[str, str]]:
    spans = ", ".join(f"{span.phase.value} {span.duration_s:.1f} s" for span in summary.phases)
    return [("phases", spans)] if spans else []
