"""The mission's phases with their reasons on a time line, as HTML: it wraps where a picture would shrink."""

from html import escape

from station.metrics.phases import PhaseSpan
from station.metrics.summary import FlightSummary
from station.report.flight_path import FlightPaths, since_s
from station.report.height_view import PHASE_COLOURS
from station.report.palette import variable


def phase_line(summary: FlightSummary, paths: FlightPaths) -> str:
    """One row a phase: when, which, how long as a bar on the flight's time, why."""
    spans = summary.phases
    first_ns, last_ns = spans[0].began_at_ns, max(spans[-1].ended_at_ns, spans[0].began_at_ns + 1)
    rows = "".join(_row(span, first_ns, last_ns, paths) for span in spans)
    return f'<ol class="phases">{rows}</ol>'


def _row(span: PhaseSpan, first_ns: int, last_ns: int, paths: FlightPaths) -> str:
    left = 100 * (span.began_at_ns - first_ns) / (last_ns - first_ns)
    width = 100 * (span.ended_at_ns - span.began_at_ns) / (last_ns - first_ns)
    left = min(left, 99.4)
    colour = variable(PHASE_COLOURS.get(span.phase, "navigated"))
    bar = f'<span class="bar" style="left:{left:.2f}%;width:{max(0.6, min(width, 100 - left)):.2f}%;background:var({colour})"></span>'
    return (
        f'<li><span class="at">{since_s(span.began_at_ns, paths.origin_ns):+.1f} s</span>'
        f'<span class="name">{escape(span.phase.value)}</span><span class="track">{bar}</span>'
        f'<span class="lasted">{span.duration_s:.1f} s</span>'
        f'<span class="why"><code>{escape(span.code)}</code> {escape(span.reason)}</span></li>'
    )
