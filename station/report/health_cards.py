"""Each service's health over time: one card a service, with a small curve for each thing that can go wrong."""

from html import escape

import numpy as np

from schemas import topics
from schemas.health import Health
from station.flight_record import FlightRecord
from station.metrics.health_history import Series, ServiceHealth, health_history
from station.metrics.summary import FlightSummary
from station.report.flight_path import FlightPaths, since_s
from station.report.palette import variable

_WIDTH, _HEIGHT = 200.0, 34.0


def health_cards(record: FlightRecord, summary: FlightSummary, paths: FlightPaths) -> str:
    """Cards of all services that reported, or a sentence that none did."""
    reports = record.messages(topics.HEALTH)
    if not reports:
        return "<p>No service's health is in the recording.</p>"
    last = {report.service: report for report in reports}
    first_ns, last_ns = reports[0].at_ns, max(reports[-1].at_ns, reports[0].at_ns + 1)
    histories = health_history(reports, summary.incidents)
    cards = "".join(_card(one, last[one.service], summary, (first_ns, last_ns), paths) for one in histories)
    return f'<div class="services">{cards}</div>'


def _card(
    history: ServiceHealth, last: Health, summary: FlightSummary, whole_ns: tuple[int, int], paths: FlightPaths
) -> str:
    curves = (
        ("published", "/s", history.output_hz, "estimate"),
        ("handling, p99", " ms", history.handling_p99_ms, "corrected"),
        ("dropped or refused", " a report", history.lost, "bad"),
        ("silent inputs", "", history.stale, "setpoint"),
    )
    rows = "".join(
        _curve(history, name, unit, series, colour, summary, whole_ns) for name, unit, series, colour in curves
    )
    restarts = ", ".join(f"{since_s(at_ns, paths.origin_ns):+.1f} s" for at_ns in history.restarts_at_ns)
    marks = [f"{last.uptime_s:.0f} s up"]
    marks += [f"restarted {len(history.restarts_at_ns)}x ({restarts})"] if restarts else []
    marks += [f"{history.dropped} dropped"] if history.dropped else []
    marks += [f"{count} refused: {reason}" for reason, count in history.refused.items()]
    ill = bool(restarts or history.lost.sum() or last.complaints)
    said = f'<p class="said">{escape("; ".join(last.complaints))}</p>' if last.complaints else ""
    return (
        f'<article class="{"ill" if ill else "well"}"><h3>{escape(history.service)}</h3>'
        f"<p>{escape(', '.join(marks))}</p>{rows}{said}</article>"
    )


def _curve(
    history: ServiceHealth,
    name: str,
    unit: str,
    series: Series,
    colour: str,
    summary: FlightSummary,
    whole_ns: tuple[int, int],
) -> str:
    known = series[np.isfinite(series)]
    if not len(known) or not known.any():
        value = "none" if len(known) else "not measured"
        return f'<div class="curve"><span>{escape(name)}</span><b>{value}</b></div>'
    text = f"{_short(float(np.median(known)))}, at most {_short(float(known.max()))}{unit}"
    return (
        f'<div class="curve"><span>{escape(name)}</span><b>{escape(text)}</b>'
        f"{_svg(history, series, colour, summary, whole_ns)}</div>"
    )


def _svg(history: ServiceHealth, series: Series, colour: str, summary: FlightSummary, whole_ns: tuple[int, int]) -> str:
    first_ns, last_ns = whole_ns
    x = _WIDTH * (history.at_ns - first_ns) / (last_ns - first_ns)
    y = _HEIGHT - 2 - (_HEIGHT - 4) * series / max(1e-9, float(np.nanmax(series)))
    pieces, pen = [], "M"
    for column, row in zip(x, y, strict=True):
        if np.isfinite(row):
            pieces.append(f"{pen}{column:.1f} {row:.1f}")
        pen = "L" if np.isfinite(row) else "M"
    return (
        f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" preserveAspectRatio="none" aria-hidden="true">'
        f"{_landing(summary, first_ns, last_ns)}{_restarts(history, first_ns, last_ns)}"
        f'<path d="{"".join(pieces)}" fill="none" stroke="var({variable(colour)})" stroke-width="1.5" '
        'stroke-linecap="round" vector-effect="non-scaling-stroke"></path></svg>'
    )


def _landing(summary: FlightSummary, first_ns: int, last_ns: int) -> str:
    part = summary.landing
    if part is None:
        return ""
    begin, end = (
        min(_WIDTH, max(0.0, _WIDTH * (at_ns - first_ns) / (last_ns - first_ns)))
        for at_ns in (part.began_at_ns, part.ended_at_ns)
    )
    return f'<rect x="{begin:.1f}" y="0" width="{end - begin:.1f}" height="{_HEIGHT:g}" fill="var(--faint)" opacity="0.45"></rect>'


def _restarts(history: ServiceHealth, first_ns: int, last_ns: int) -> str:
    columns = [_WIDTH * (at_ns - first_ns) / (last_ns - first_ns) for at_ns in history.restarts_at_ns]
    return "".join(
        f'<path d="M{x:.1f} 0V{_HEIGHT:g}" fill="none" stroke="var(--bad)" stroke-width="2" vector-effect="non-scaling-stroke"></path>'
        for x in columns
    )


def _short(value: float) -> str:
    return f"{value:.0f}" if value >= 100 or value == int(value) else f"{value:.2g}"
