"""`alight report FLIGHT.mcap`: the report of a recorded flight."""

import argparse
import sys
from pathlib import Path

from station.flight_record import read_flight
from station.mcap_parts import FlightRecordError
from station.metrics.summary import PAD_RADIUS_M, summarise
from station.metrics.text import summary_lines
from station.report.error import ReportError
from station.report.write import write_report


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight report`."""
    parser.add_argument(
        "flight", type=Path, metavar="FLIGHT", help="a recording (flight.mcap) or the folder it lies in"
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="where to write it; beside the recording by default")
    parser.add_argument(
        "--pad-radius-m",
        type=float,
        default=PAD_RADIUS_M,
        metavar="METRES",
        help="how far from the pad's centre still counts as on the pad (default: %(default)s)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Write the report and print the summary; returns 0 if both could be done, whatever became of the flight."""
    flight: Path = arguments.flight
    beside = flight / "report.html" if flight.is_dir() else flight.with_suffix(".html")
    target: Path = arguments.out or beside
    try:
        record = read_flight(flight)
        summary = summarise(record, arguments.pad_radius_m)
        write_report(record, summary, target)
    except (FlightRecordError, ReportError) as error:
        print(error, file=sys.stderr)
        return 1
    for defect in record.provenance.defects:
        print(f"note: {defect}", file=sys.stderr)
    print("\n".join(summary_lines(summary)))
    print(f"report: {target}")
    return 0
