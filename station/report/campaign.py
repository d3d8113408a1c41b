"""The report of many flights: a campaign's results, or a handful of recordings."""

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from station.campaign.summary import CampaignSummary, summarise_rows
from station.flight_record import read_flight
from station.metrics.summary import summarise
from station.report.campaign_rows import (
    ERROR_M,
    INDEX,
    LANDED,
    NAME,
    OUTCOME,
    REASON,
    Factor,
    Row,
    factors,
    landed,
    numbers,
    recording_of,
    text_of,
)
from station.report.document import Section, cards, document
from station.report.error import ReportError
from station.report.tables import table
from station.report.write import check_drawing, write_report

_WORST = 10
_MOST_FAILED = 20
_NUMERIC = (1, 2, 3)
_SHARE_BINS = 4


def write_campaign_report(rows: Sequence[Row], out: Path, title: str = "Campaign") -> Path:
    """Write the page over many flights, and one of each flight that has a recording but no report yet.

    Args:
        rows: One a flight: `index`, `landed`, `outcome`, `reason`, the measures of `campaign_rows`, and factors by their keys.
        out: The campaign's folder; the page is its `report.html`. A path that ends in `.html` is the page itself.
        title: Heading of the page.

    Returns:
        The page.

    Raises:
        ReportError: If there are no flights, matplotlib is missing or a file cannot be written.
    """
    if not rows:
        raise ReportError("there are no flights to report on")
    check_drawing()
    folder, page = (out.parent, out) if out.suffix == ".html" else (out, out / "report.html")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        links = _links(rows, folder)
        page.write_text(campaign_page(rows, links, title), encoding="utf-8")
    except OSError as error:
        raise ReportError(f"{page} cannot be written ({error.strerror}): choose another place") from error
    return page


def campaign_page(rows: Sequence[Row], links: Mapping[int, str], title: str = "Campaign") -> str:
    """The page as HTML.

    Args:
        rows: See `write_campaign_report`.
        links: Addresses of the single flights' reports by position in the rows, relative to the page.
        title: Its heading.
    """
    summary = summarise_rows(_complete(row, number) for number, row in enumerate(rows))
    varied = factors(rows)
    sections = [*_drawn(rows), _failures(summary, rows, links), _worst(rows, links, varied), _shares(rows, varied)]
    body = _banner(summary) + cards(_numbers(rows, summary)) + "".join(section.html() for section in sections)
    about = f"{len(rows)} flights, {len(varied)} factors varied"
    headline = f"{title}: {summary.landed} of {summary.flights} landed"
    return document(headline, title, about, body, version("alight"))


def _complete(row: Row, number: int) -> dict[str, Any]:
    """A row with everything that the summary counts; its index is its place, for whatever the row calls itself."""
    return {LANDED: False, OUTCOME: "unknown", REASON: "", ERROR_M: None, **row, INDEX: number}


def _links(rows: Sequence[Row], folder: Path) -> dict[int, str]:
    found: dict[int, str] = {}
    for number, row in enumerate(rows):
        flight = recording_of(row, folder)
        if flight is None:
            continue
        report = flight / "report.html" if flight.is_dir() else flight.with_suffix(".html")
        if not report.exists():
            record = read_flight(flight)
            write_report(record, summarise(record), report)
        found[number] = Path(os.path.relpath(report, folder)).as_posix()
    return found


def _banner(summary: CampaignSummary) -> str:
    low, high = summary.interval
    share = summary.landed / summary.flights
    line = (
        f"{summary.landed} of {summary.flights} flights landed on the pad: {share:.1%} "
        f"(95 % interval {low:.1%} to {high:.1%})"
    )
    kind = "good" if summary.landed == summary.flights else "bad" if summary.landed == 0 else "mixed"
    return f'<div class="verdict {kind}">{escape(line)}</div>'


def _numbers(rows: Sequence[Row], summary: CampaignSummary) -> list[tuple[str, str]]:
    shown = []
    if summary.errors:
        errors = summary.errors
        shown += [
            (f"{100 * errors.median_m:.1f} cm", "median error at touchdown, of those landed"),
            (f"{100 * errors.p95_m:.1f} cm", "95 % are nearer"),
            (f"{100 * errors.worst_m:.1f} cm", "the worst that landed"),
        ]
    for key, name, form in (
        ("landing_s", "median time to land", "{:.1f} s"),
        ("detection_rate", "of the frames show the pad (median flight)", "{:.1%}"),
        ("latency_p99_ms", "worst flight's capture to setpoint, p99", "{:.1f} ms"),
    ):
        values = numbers(rows, key)
        values = values[np.isfinite(values)]
        if len(values):
            shown.append((form.format(values.max() if key == "latency_p99_ms" else np.median(values)), name))
    return shown


def _drawn(rows: Sequence[Row]) -> list[Section]:
    from station.report.factor_view import factor_picture, measure_picture  # noqa: PLC0415 - loads matplotlib, an extra
    from station.report.touchdown_view import touchdown_picture  # noqa: PLC0415

    touchdown, by_factor, measures = touchdown_picture(rows), factor_picture(rows), measure_picture(rows)
    sections = []
    if touchdown:
        count = int(np.isfinite(numbers(rows, ERROR_M)).sum())
        about = f"By the ground truth, at the first contact; {count} of {len(rows)} flights touched the ground."
        sections.append(Section("Error at touchdown", about, touchdown.html()))
    else:
        sections.append(Section("Error at touchdown", "No flight's touchdown is known.", ""))
    if by_factor:
        about_factors = (
            "One dot a flight, the line is the median; red strokes at the top are flights that did not land on the pad. Factors "
            "that explain more of the error come first."
        )
        sections.append(Section("Error by factor", about_factors, by_factor.html()))
    if measures:
        sections.append(Section("What else was measured", "The dashed line is the median.", measures.html()))
    return sections


def _failures(summary: CampaignSummary, rows: Sequence[Row], links: Mapping[int, str]) -> Section:
    if not summary.failures:
        return Section("Failures", "None: every flight landed on the pad.", "")
    most = summary.failures[0][1]
    items = "".join(
        f'<li><span class="count">{count}</span><span class="track"><span class="bar" style="left:0;'
        f'width:{100 * count / most:.1f}%;background:var(--bad)"></span></span>'
        f'<span class="why">{escape(reason)} <span class="first">first: {_flight(first, rows, links)}</span></span></li>'
        for reason, count, first in summary.failures
    )
    outcomes = Counter(str(row.get(OUTCOME)) for row in rows if not row.get(LANDED))
    about = (
        "By reason, numbers left out: " + ", ".join(f"{count} {name}" for name, count in outcomes.most_common()) + "."
    )
    return Section("Failures", about, f'<ol class="reasons">{items}</ol>')


def _worst(rows: Sequence[Row], links: Mapping[int, str], varied: Sequence[Factor]) -> Section:
    error_m, good = numbers(rows, ERROR_M), landed(rows)
    failed = [number for number in range(len(rows)) if not good[number]]
    far = [number for number in np.argsort(-np.nan_to_num(error_m, nan=-1.0)).tolist() if good[number]][:_WORST]
    head = ("flight", "error", "time to land", "pad seen", "outcome", "the strongest factors")
    body = "".join(_worst_row(head, rows, number, links, varied) for number in [*failed[:_MOST_FAILED], *far])
    about = f"The flights that did not land, then the {len(far)} that landed farthest from the centre"
    about += f" ({len(failed) - _MOST_FAILED} more failed)." if len(failed) > _MOST_FAILED else "."
    about += " A linked flight has a report of its own." if links else " No flight has a recording."
    heads = "".join(f"<th{_alignment(column)}>{escape(text)}</th>" for column, text in enumerate(head))
    made = (
        f'<div class="wide"><table class="stacked"><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table></div>'
    )
    return Section("Worst cases", about, made)


def _alignment(column: int) -> str:
    return ' class="number"' if column in _NUMERIC else ""


def _worst_row(
    head: Sequence[str], rows: Sequence[Row], number: int, links: Mapping[int, str], varied: Sequence[Factor]
) -> str:
    row = rows[number]
    error_m, landing_s, rate = (float(numbers([row], key)[0]) for key in (ERROR_M, "landing_s", "detection_rate"))
    outcome = str(row.get(OUTCOME, "")) + (f": {row[REASON]}" if row.get(REASON) else "")
    special = ", ".join(f"{factor.key} {text_of(row.get(factor.key))}" for factor in varied[:6])
    cells = (
        _flight(number, rows, links),
        escape("" if np.isnan(error_m) else f"{100 * error_m:.1f} cm"),
        escape("" if np.isnan(landing_s) else f"{landing_s:.1f} s"),
        escape("" if np.isnan(rate) else f"{rate:.1%}"),
        escape(outcome),
        escape(special),
    )
    return (
        "<tr>"
        + "".join(
            f'<td{_alignment(column)} data-head="{name}">{cell}</td>'
            for column, (name, cell) in enumerate(zip(head, cells, strict=True))
        )
        + "</tr>"
    )


def _flight(number: int, rows: Sequence[Row], links: Mapping[int, str]) -> str:
    row = rows[number]
    name = escape(str(row.get(NAME) or row.get(INDEX, number)))
    return f'<a href="{escape(links[number])}">{name}</a>' if number in links else name


def _shares(rows: Sequence[Row], varied: Sequence[Factor]) -> Section:
    """Share landed and median error by level, or by quarter of the range."""
    if not varied:
        return Section("By level", "Nothing varied but chance.", "")
    lines = [line for factor in varied for line in _levels(rows, factor)]
    head = ("factor", "value", "flown", "landed", "95 % interval", "median error")
    made = table(head, lines, frozenset({2, 3, 4, 5}))
    about = "Flown and landed for each value; numbers that vary continuously are cut into quarters of the flights."
    return Section("By level", about, f"<details><summary>Table of {len(lines)} levels</summary>{made}</details>")


def _levels(rows: Sequence[Row], factor: Factor) -> list[tuple[str, ...]]:
    if factor.numbers is None:
        groups = [(name, factor.level_of == level) for level, name in enumerate(factor.levels)]
    else:
        known = factor.numbers[np.isfinite(factor.numbers)]
        edges = np.quantile(known, np.linspace(0, 1, _SHARE_BINS + 1))
        place = np.clip(np.searchsorted(edges, factor.numbers, side="right") - 1, 0, _SHARE_BINS - 1)
        groups = [(f"{edges[n]:.3g} to {edges[n + 1]:.3g}", place == n) for n in range(_SHARE_BINS)]
    lines: list[tuple[str, ...]] = []
    for name, inside in groups:
        chosen = [_complete(row, number) for number, row in enumerate(rows) if inside[number]]
        if chosen:
            part = summarise_rows(chosen)
            low, high = part.interval
            median = f"{100 * part.errors.median_m:.1f} cm" if part.errors else ""
            counts = (str(part.flights), str(part.landed), f"{low:.0%} to {high:.0%}")
            lines.append((factor.key, name, *counts, median))
    return lines
