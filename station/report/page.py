"""The report of one flight as a page."""

from collections.abc import Sequence
from html import escape

from schemas import topics
from station.flight_record import FlightRecord
from station.metrics.fix_fate import FixFates, fix_fates
from station.metrics.pad_error import rms_horizontal_m
from station.metrics.summary import FlightSummary
from station.metrics.text import length, summary_line
from station.metrics.uncertainty import Uncertainty, uncertainty
from station.report import tables
from station.report.configuration import configuration
from station.report.document import Section, banner, cards, document
from station.report.error_view import error_picture
from station.report.fixes_view import fixes_list, fixes_picture, fixes_table, fixes_words
from station.report.flight_path import FlightPaths, flight_paths
from station.report.health_cards import health_cards
from station.report.height_view import height_picture
from station.report.latency_view import latency_picture
from station.report.moments import DETECTED_BGR, ESTIMATED_BGR, TRUE_BGR, Moment, moments
from station.report.path_view import path_picture
from station.report.phase_line import phase_line
from station.report.picture import Picture
from station.report.uncertainty_view import uncertainty_picture, uncertainty_words


def page(record: FlightRecord, summary: FlightSummary) -> str:
    """The whole report of one flight as HTML."""
    paths = flight_paths(record, summary)
    fates, claims = _fates(record, summary), _claims(record, summary)
    drawn = {picture.name: picture.html() for picture in pictures(record, summary)}
    sections = [
        *_flown(summary, paths, drawn),
        _moments(moments(record, summary, paths)),
        *_measured(summary, paths, drawn, fates, claims),
        *_services(record, summary, paths, drawn),
        Section("Configuration", "Settings that differ from the defaults.", configuration(record.provenance.settings)),
    ]
    versions = f"<details><summary>Versions</summary>{tables.versions(record)}</details>"
    body = "".join(section.html() for section in sections) + versions
    heading = f"Landing of {record.provenance.versions.get('vehicle', 'a vehicle')}"
    return document(
        title=f"{heading}: {summary_line(summary)}",
        heading=heading,
        about=_about(record),
        body=_verdict(record, summary) + cards(_numbers(summary)) + body,
        version=record.provenance.versions.get("alight", ""),
    )


def pictures(record: FlightRecord, summary: FlightSummary) -> Sequence[Picture]:
    """The drawings of a flight's page; those that there is nothing to draw for are left out."""
    paths = flight_paths(record, summary)
    fates, claims = _fates(record, summary), _claims(record, summary)
    found: list[Picture | None] = []
    if paths.navigated or paths.true:
        side_m = float(record.setting("pad", "side_m", 1.0))
        found += [path_picture(summary, paths, side_m), height_picture(summary, paths)]
    found.append(fixes_picture(summary, paths, fates) if fates.fates else None)
    found.append(uncertainty_picture(summary, paths, claims) if claims else None)
    found.append(error_picture(summary))
    found.append(latency_picture(summary.latency) if summary.latency else None)
    return [picture for picture in found if picture is not None]


def _fates(record: FlightRecord, summary: FlightSummary) -> FixFates:
    fates, part = fix_fates(record, summary.phases), summary.landing
    return fates.within(part.looking_since_ns, part.ended_at_ns) if part else fates


def _claims(record: FlightRecord, summary: FlightSummary) -> Uncertainty | None:
    claims = uncertainty(record, summary.landing) if summary.landing else None
    return claims if claims and (claims.fixes or claims.estimates) else None


def _about(record: FlightRecord) -> str:
    statuses = record.messages(topics.MISSION_STATUS)
    parts = [f"guidance {statuses[-1].guidance}"] if statuses else []
    method = {estimate.method for estimate in record.messages(topics.PAD_ESTIMATE)}
    parts += [f"filter {', '.join(sorted(method))}"] if method else []
    return ", ".join([*parts, f"seed {record.provenance.versions.get('seed', 'unknown')}"])


def _verdict(record: FlightRecord, summary: FlightSummary) -> str:
    line = banner(summary_line(summary), good=summary.verdict.ok)
    if not record.provenance.defects:
        return line
    defects = "".join(f"<li>{escape(defect)}</li>" for defect in record.provenance.defects)
    return f'{line}<div class="defects">The recording is not whole:<ul>{defects}</ul></div>'


def _numbers(summary: FlightSummary) -> list[tuple[str, str]]:
    numbers: list[tuple[str, str]] = []
    if summary.touchdown:
        numbers.append((length(summary.touchdown.error_m), "true error at touchdown"))
        numbers.append((f"{summary.touchdown.after_s:.1f} s", "from the descent's beginning to the touchdown"))
    if summary.paper:
        if summary.paper.time_s is not None:
            numbers.append((f"{summary.paper.time_s:.1f} s", "time to land (paper, Eq. 30)"))
        numbers.append((f"{summary.paper.distance_m:.1f} m", f"flown; {summary.paper.straight_line_m:.1f} m straight"))
    if summary.detection and summary.detection.rate is not None:
        numbers.append((f"{summary.detection.rate:.1%}", f"of {summary.detection.examined} frames show the pad"))
    estimate_m = rms_horizontal_m(summary.errors.estimate)
    if estimate_m is not None:
        numbers.append((length(estimate_m), "RMS error of the estimate"))
    if summary.latency:
        total = summary.latency.total
        numbers.append((f"{total.p50_ms:.1f} ms", f"capture to setpoint (p99 {total.p99_ms:.1f} ms)"))
    return numbers


def _flown(summary: FlightSummary, paths: FlightPaths, drawn: dict[str, str]) -> list[Section]:
    sections = []
    if "path" in drawn:
        about_path = (
            "The path that was really flown, the path that the autopilot believed in, and, around the pad, where each fix "
            "and each estimate would have it: the tighter around the centre, the better."
        )
        about_height = "Setpoints are what the commander asked of the autopilot, in the autopilot's own coordinates."
        sections.append(Section("Path", about_path, drawn["path"]))
        sections.append(Section("Height and setpoints over time", about_height, drawn["height"]))
    else:
        sections.append(Section("Path", "The recording says nothing of where the vehicle or the pad was.", ""))
    if summary.phases:
        began = "descent" if paths.descended else "record"
        about = f"When each phase of the mission began, and why. Times are from the beginning of the {began}."
        sections.append(Section("Phases of the mission", about, phase_line(summary, paths)))
    return sections


def _moments(shown: Sequence[Moment]) -> Section:
    title = "What the camera saw"
    if not shown:
        return Section(title, "The recording holds no picture in which the pad was found.", "")
    figures = "".join(
        f'<figure><img alt="{escape(moment.caption)}" src="data:image/jpeg;base64,{moment.jpeg_base64}">'
        f"<figcaption>{escape(moment.caption)}</figcaption></figure>"
        for moment in shown
    )
    about = (
        "Evenly in height from the first to the last sight of the pad; a small pad is shown magnified in a corner. The red "
        "dot marks the upper left corner of the print."
    )
    estimated, true = (any(moment.off_px[which] is not None for moment in shown) for which in (0, 1))
    keys = [_key(DETECTED_BGR, "what the detector found")]
    keys.append(_key(ESTIMATED_BGR, "where the newest estimate has the pad") if estimated else "no estimate yet")
    keys.append(_key(TRUE_BGR, "where it truly is") if true else "no truth in the recording")
    return Section(title, about, f'<p>{" &nbsp; ".join(keys)}</p><div class="moments">{figures}</div>')


def _key(colour_bgr: tuple[int, int, int], meaning: str) -> str:
    blue, green, red = colour_bgr
    return f'<span class="key" style="background:rgb({red},{green},{blue})"></span>{escape(meaning)}'


def _measured(
    summary: FlightSummary, paths: FlightPaths, drawn: dict[str, str], fates: FixFates, claims: Uncertainty | None
) -> list[Section]:
    sections = [_fixes(paths, drawn, fates)]
    if claims is not None:
        sections.append(Section("Uncertainty against error", uncertainty_words(claims), drawn["uncertainty"]))
    else:
        sections.append(Section("Uncertainty against error", "Neither a truth nor fixes enough to compare with.", ""))
    if "error" in drawn:
        about = "Each dot is one measurement of the pad against the truth at the time of capture; lines are medians."
        sections.append(Section("Error over height", about, drawn["error"]))
    if summary.paper or summary.touchdown:
        about = (
            "The paper's best mode is its mean of five flights with the exponential law, mean window and correction."
        )
        sections.append(Section("In numbers", about, tables.measures(summary)))
    return sections


def _fixes(paths: FlightPaths, drawn: dict[str, str], fates: FixFates) -> Section:
    title = "What became of each fix"
    if not fates.fates:
        return Section(title, "There is no fix in the recording.", "")
    about = fixes_words(fates)
    return Section(title, about, drawn["fixes"] + fixes_table(fates) + fixes_list(fates, paths))


def _services(record: FlightRecord, summary: FlightSummary, paths: FlightPaths, drawn: dict[str, str]) -> list[Section]:
    sections = []
    if summary.latency:
        about = (
            f"Mean over {summary.latency.setpoints} setpoints that a new estimate caused. Each bar begins where the one above "
            "ends, so the last one ends at the mean time from the light to the setpoint."
        )
        sections.append(Section("From the light to the setpoint", about, drawn["latency"] + tables.latency(summary)))
    about_health = "Each service's own account over the whole recording, about once a second; the landing is shaded."
    sections.append(Section("Services", about_health, health_cards(record, summary, paths)))
    about_incidents = "What the services reported as wrong, in the whole recording."
    sections.append(Section("Incidents", about_incidents, tables.incidents(summary, paths)))
    return sections
