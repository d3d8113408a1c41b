"""The report's page: everything in one HTML text, nothing fetched from anywhere."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files

from schemas import topics
from station.flight_record import FlightRecord
from station.metrics.pad_error import rms_horizontal_m
from station.metrics.summary import FlightSummary
from station.metrics.text import length, summary_line
from station.report import tables
from station.report.error_view import error_view
from station.report.flight_path import FlightPaths, flight_paths
from station.report.height_view import height_view
from station.report.latency_view import latency_view
from station.report.moments import Moment, moments
from station.report.path_view import path_view


@dataclass(frozen=True)
class _Section:
    title: str
    explanation: str
    content: str

    def html(self) -> str:
        return f"<section><h2>{escape(self.title)}</h2><p>{escape(self.explanation)}</p>{self.content}</section>"


def page(record: FlightRecord, summary: FlightSummary) -> str:
    """The whole report of one flight as HTML."""
    paths = flight_paths(record, summary)
    style = files("station.report").joinpath("style.css").read_text()
    title = f"Landing of {record.provenance.versions.get('vehicle', 'a vehicle')}"
    sections = [*_pictures(record, summary, paths), *_tables(record, summary, paths)]
    body = "".join(section.html() for section in sections)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}: {escape(summary_line(summary))}</title><style>{style}</style></head><body><main>"
        f"<header><h1>{escape(title)}</h1><p>{escape(_about(record))}</p></header>"
        f"{_verdict(record, summary)}{_numbers(summary)}{body}{_details(record)}"
        f"<footer>Alight {escape(record.provenance.versions.get('alight', ''))}. This page is complete in itself.</footer>"
        "</main></body></html>\n"
    )


def _about(record: FlightRecord) -> str:
    statuses = record.messages(topics.MISSION_STATUS)
    parts = [f"guidance {statuses[-1].guidance}"] if statuses else []
    method = {estimate.method for estimate in record.messages(topics.PAD_ESTIMATE)}
    parts += [f"filter {', '.join(sorted(method))}"] if method else []
    return ", ".join([*parts, f"seed {record.provenance.versions.get('seed', 'unknown')}"])


def _verdict(record: FlightRecord, summary: FlightSummary) -> str:
    line = summary_line(summary)
    mark = "good" if summary.verdict.ok else "bad"
    banner = f'<div class="verdict {mark}">{escape(line[0].upper() + line[1:])}</div>'
    if not record.provenance.defects:
        return banner
    defects = "".join(f"<li>{escape(defect)}</li>" for defect in record.provenance.defects)
    return f'{banner}<div class="defects">The recording is not whole:<ul>{defects}</ul></div>'


def _numbers(summary: FlightSummary) -> str:
    numbers: list[tuple[str, str]] = []
    if summary.touchdown:
        numbers.append((length(summary.touchdown.error_m), "true error at touchdown"))
    if summary.paper:
        if summary.paper.time_s is not None:
            numbers.append((f"{summary.paper.time_s:.1f} s", "time to land"))
        numbers.append((f"{summary.paper.distance_m:.1f} m", f"flown; {summary.paper.straight_line_m:.1f} m straight"))
    if summary.detection and summary.detection.rate is not None:
        numbers.append((f"{summary.detection.rate:.1%}", f"of {summary.detection.examined} frames show the pad"))
    estimate_m = rms_horizontal_m(summary.errors.estimate)
    if estimate_m is not None:
        numbers.append((length(estimate_m), "RMS error of the estimate"))
    if summary.latency:
        total = summary.latency.total
        numbers.append((f"{total.p50_ms:.1f} ms", f"capture to setpoint (p99 {total.p99_ms:.1f} ms)"))
    cards = "".join(f"<div><b>{escape(value)}</b><span>{escape(name)}</span></div>" for value, name in numbers)
    return f'<div class="numbers">{cards}</div>' if cards else ""


def _plot(svg: str) -> str:
    return f'<figure class="plot">{svg}</figure>'


def _pictures(record: FlightRecord, summary: FlightSummary, paths: FlightPaths) -> Sequence[_Section]:
    sections = []
    if paths.navigated or paths.true:
        side_m = float(record.setting("pad", "side_m", 1.0))
        about_path = (
            "The path that was really flown, the path that the autopilot believed in, and, around the pad, where each fix "
            "and each estimate would have it: the tighter around the centre, the better. Large dots are from below 5 m."
        )
        about_height = "Setpoints are what the commander asked of the autopilot, in the autopilot's own coordinates."
        sections.append(_Section("Path", about_path, _plot(path_view(summary, paths, side_m))))
        sections.append(_Section("Height and setpoints over time", about_height, _plot(height_view(summary, paths))))
    sections.append(_moments_section(moments(record, summary, paths)))
    errors = error_view(summary)
    if errors is not None:
        about_errors = (
            "Each dot is one measurement of the pad against the truth at the time of capture; lines are medians."
        )
        sections.append(_Section("Error over height", about_errors, _plot(errors)))
    if summary.latency:
        about_latency = (
            f"Mean over {summary.latency.setpoints} setpoints that a new estimate caused. Each bar begins where the one above "
            "ends, so the last one ends at the mean time from the light to the setpoint."
        )
        picture = _plot(latency_view(summary.latency)) + tables.latency(summary)
        sections.append(_Section("From the light to the setpoint", about_latency, picture))
    return sections


def _moments_section(shown: Sequence[Moment]) -> _Section:
    if not shown:
        return _Section("What the camera saw", "The recording holds no picture in which the pad was found.", "")
    figures = "".join(
        f'<figure><img alt="{escape(moment.caption)}" src="data:image/jpeg;base64,{moment.jpeg_base64}">'
        f"<figcaption>{escape(moment.caption)}</figcaption></figure>"
        for moment in shown
    )
    about = (
        "Evenly in height from the first to the last sight of the pad. Green is what the detector found; the red dot marks "
        "the upper left corner of the print. A small pad is shown magnified in a corner."
    )
    return _Section("What the camera saw", about, f'<div class="moments">{figures}</div>')


def _tables(record: FlightRecord, summary: FlightSummary, paths: FlightPaths) -> Sequence[_Section]:
    sections = []
    if summary.paper or summary.touchdown:
        about = (
            "The paper's best mode is its mean of five flights with the exponential law, mean window and correction."
        )
        sections.append(_Section("In numbers", about, tables.measures(summary)))
    if summary.phases:
        about = "Times are from the beginning of the descent."
        sections.append(_Section("Phases of the mission", about, tables.phases(summary, paths)))
    if summary.detection:
        about = "Only an accepted fix may steer; the others say why not. From the search for the pad to touchdown."
        sections.append(_Section("What became of each frame", about, tables.fixes(summary)))
    about = "What the services reported as wrong, in the whole recording."
    sections.append(_Section("Incidents", about, tables.incidents(summary, paths)))
    sections.append(_Section("Services", "Their last report of health.", tables.health(record, summary)))
    return sections


def _details(record: FlightRecord) -> str:
    return (
        f"<details><summary>Versions</summary>{tables.versions(record)}</details>"
        f"<details><summary>Settings</summary>{tables.settings(record)}</details>"
    )
