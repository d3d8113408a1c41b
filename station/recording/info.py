"""`alight recording info FILE`: what is in a recording."""

import argparse
import sys
from collections import Counter
from pathlib import Path

from station.mcap_parts import FlightRecordError, PartsReader


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight recording info`."""
    parser.add_argument("flight", type=Path, metavar="FLIGHT", help="a recording (flight.mcap) or its folder")


def run(arguments: argparse.Namespace) -> int:
    """Print the counts by topic; returns 1 if the file is none."""
    flight: Path = arguments.flight
    try:
        reader = PartsReader(flight / "flight.mcap" if flight.is_dir() else flight)
        counts = Counter(name for name, _, _ in reader.messages())
    except FlightRecordError as error:
        print(error, file=sys.stderr)
        return 1
    for name, count in sorted(counts.items()):
        print(f"{name:24} {count:>8}")
    for defect in reader.defects():
        print(f"note: {defect}")
    return 0
