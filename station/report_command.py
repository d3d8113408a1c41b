"""`alight report FLIGHT...`: the report of a recorded flight, or of several with a page over all of them."""

import argparse
import sys
from pathlib import Path

from station.flight_record import FlightRecord
from station.mcap_parts import EmptyRecordingError, FlightRecordError
from station.metrics.summary import PAD_RADIUS_M, FlightSummary
from station.metrics.text import summary_line, summary_lines
from station.report.error import ReportError
from station.report.flights import Flights, read_and_summarise
from station.report.write import check_drawing, write_report


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight report`."""
    parser.add_argument(
        "flight",
        type=Path,
        nargs="+",
        metavar="FLIGHT",
        help="a recording (flight.mcap) or the folder it lies in; several get a page over all of them, too, and of "
        "several, what is no recording is left out",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="where to write the page; by default beside the recording, or flights.html in the folder that holds them all",
    )
    parser.add_argument(
        "--figures", type=Path, metavar="DIR", help="also draw the landings for print, as SVG and PDF (docs/reports.md)"
    )
    parser.add_argument(
        "--pad-radius-m",
        type=float,
        default=PAD_RADIUS_M,
        metavar="METRES",
        help="how far from the pad's centre still counts as on the pad (default: %(default)s)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Write the reports and print the summary; returns 0 if all could be done, whatever became of the flights."""
    try:
        check_drawing()
        paths = _recordings(arguments.flight)
        if len(paths) == 1:
            record, summary = _report(paths[0], arguments.out or _beside(paths[0]), arguments.pad_radius_m)
            print("\n".join(summary_lines(summary)))
            print(f"report: {arguments.out or _beside(paths[0])}")
            reported = [(record, summary)] if arguments.figures else []
        else:
            if arguments.out and arguments.out.suffix != ".html":
                raise ReportError(f"--out {arguments.out}: name a page that ends in .html")
            reported = _report_all(paths, arguments)
        if arguments.figures:
            _draw_figures(reported, arguments.figures)
    except (FlightRecordError, ReportError) as error:
        print(f"alight report: {error}", file=sys.stderr)
        return 1
    return 0


def _recordings(named: list[Path]) -> list[Path]:
    """Of several (`flights/*`) those that are recordings, with a note of each other; what does not exist is a mistake, and stays.

    Raises:
        ReportError: If none is left.
    """
    if len(named) == 1:
        return named
    left_out = [path for path in named if path.exists() and not _may_be_recording(path)]
    for path in left_out:
        print(f"note: {path} is no recording, and is left out", file=sys.stderr)
    if len(left_out) == len(named):
        raise ReportError("none of these is a recording; name .mcap files or the folders that they lie in")
    return [path for path in named if path not in left_out]


def _may_be_recording(path: Path) -> bool:
    return any(path.glob("*.mcap")) if path.is_dir() else path.suffix == ".mcap"


def _report(path: Path, target: Path, pad_radius_m: float) -> tuple[FlightRecord, FlightSummary]:
    record, summary = read_and_summarise(path, pad_radius_m)
    if record.is_empty:
        raise EmptyRecordingError(path, record.provenance.defects)
    write_report(record, summary, target)
    for defect in record.provenance.defects:
        print(f"note: {defect}", file=sys.stderr)
    return record, summary


def _report_all(paths: list[Path], arguments: argparse.Namespace) -> list[tuple[FlightRecord, FlightSummary]]:
    flights, reported = Flights(), []
    for path in paths:
        record, summary = _report(path, _beside(path), arguments.pad_radius_m)
        print(f"{path}: {summary_line(summary)}")
        flights.add(path, record, summary)
        if arguments.figures:
            reported.append((record, summary))
    print(f"report: {flights.write(arguments.out)}")
    return reported


def _beside(path: Path) -> Path:
    return path / "report.html" if path.is_dir() else path.with_suffix(".html")


def _draw_figures(reported: list[tuple[FlightRecord, FlightSummary]], directory: Path) -> None:
    from station.report.figures.flight_tracks import landing_track  # noqa: PLC0415 - loads matplotlib, which is an extra
    from station.report.figures.landings import time_series, trajectories  # noqa: PLC0415

    tracks = [track for record, summary in reported if (track := landing_track(record, summary)) is not None]
    if not tracks:
        raise ReportError("no figures: in none of the flights did the descent begin")
    for files in [*trajectories(tracks, directory), *time_series(tracks, directory)]:
        print(f"figure: {files.svg}, {files.pdf}")
