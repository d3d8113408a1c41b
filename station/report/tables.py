"""The report's tables, as HTML."""

from collections.abc import Iterable, Sequence
from html import escape

from station.flight_record import FlightRecord
from station.metrics.latency import Percentiles, Stage
from station.metrics.summary import FlightSummary
from station.metrics.text import length
from station.report.flight_path import FlightPaths, since_s


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numeric: frozenset[int] = frozenset()) -> str:
    """An HTML table; texts are escaped, the numeric columns stand to the right. On a phone each row is a block."""

    def cell(tag: str, column: int, text: str) -> str:
        mark = ' class="number"' if column in numeric else ""
        name = f' data-head="{escape(head[column])}"' if tag == "td" else ""
        return f"<{tag}{mark}{name}>{escape(text)}</{tag}>"

    def cells(tag: str, texts: Sequence[str]) -> str:
        return "".join(cell(tag, column, text) for column, text in enumerate(texts))

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return (
        f'<div class="wide"><table class="stacked"><thead><tr>{cells("th", head)}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def measures(summary: FlightSummary) -> str:
    """The flight in the paper's terms and in truth."""
    paper, contact = summary.paper, summary.touchdown
    rows = []
    if paper:
        rows += [
            ("Distance flown (Eq. 29)", f"{paper.distance_m:.2f} m", "37.44 m", "steps between the logged positions"),
            ("Straight line to the pad", f"{paper.straight_line_m:.2f} m", "24.5 m", "from the start, as navigated"),
        ]
    if paper and paper.time_s is not None:
        rmse = f"{length(paper.rmse_m)}, {paper.rmse_1e7_deg:.2f}e-7 deg"
        rows += [
            (
                "Time to land (Eq. 30)",
                f"{paper.time_s:.2f} s",
                "44.64 s",
                "from 99.8 % of the start height to the ground",
            ),
            (
                "RMSE at the end (Eq. 28)",
                rmse,
                "0.875e-7 deg",
                "last ten positions as navigated, their own error included",
            ),
        ]
    if contact:
        rows += [
            ("True error at first contact", length(contact.error_m), "", f"sinking {contact.sink_rate_mps:.2f} m/s"),
            ("True error at rest", length(contact.rest_error_m), "", "at the end of the record"),
            ("True time to land", f"{contact.after_s:.2f} s", "", "from the descent's beginning to contact"),
            ("True distance flown", f"{contact.distance_flown_m:.2f} m", "", "from the descent's beginning to contact"),
        ]
    return table(("measure", "this flight", "the paper's best mode", "what it is"), rows, frozenset({1, 2}))


def latency(summary: FlightSummary) -> str:
    """The budget by service and stage, median and 99th percentile."""
    budget = summary.latency
    if budget is None:
        return ""
    found = {(entry.service, entry.stage): entry.time for entry in budget.stages}
    rows = [
        (
            service,
            _p50_p99(found.get((service, Stage.TRANSPORT))),
            _p50_p99(found.get((service, Stage.QUEUE))),
            _p50_p99(found.get((service, Stage.HANDLING)) or found.get((service, Stage.CAMERA))),
        )
        for service in dict.fromkeys(entry.service for entry in budget.stages)
    ]
    rows.append(("from the light to the setpoint", "", "", _p50_p99(budget.total)))
    rows.append(("the same without the detector's work", "", "", _p50_p99(budget.overhead)))
    head = ("p50 / p99 [ms]", "on the way to it", "waiting in the service", "at work")
    return table(head, rows, frozenset({1, 2, 3}))


def incidents(summary: FlightSummary, paths: FlightPaths) -> str:
    """What was wrong, and when."""
    rows = [
        (
            f"{since_s(i.first_at_ns, paths.origin_ns):+.1f} s",
            f"{since_s(i.last_at_ns, paths.origin_ns):+.1f} s",
            i.service,
            i.kind.value,
            f"{i.detail} (expected: near the ground the pad leaves the picture)"
            if summary.is_expected(i)
            else i.detail,
        )
        for i in summary.incidents
    ]
    if not rows:
        return "<p>None.</p>"
    return table(("first", "last", "service", "what", "detail"), rows, frozenset({0, 1}))


def versions(record: FlightRecord) -> str:
    """What made the recording."""
    return table(("name", "version"), sorted(record.provenance.versions.items()))


def _p50_p99(time: Percentiles | None) -> str:
    return "" if time is None else f"{time.p50_ms:.2f} / {time.p99_ms:.2f}"
