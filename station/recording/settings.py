"""`alight recording settings FLIGHT`: the settings that a flight was flown with."""

import argparse
import sys
from pathlib import Path

from station.mcap_parts import FlightRecordError, PartsReader


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the options."""
    parser.add_argument("flight", type=Path, metavar="FLIGHT", help="a recording (flight.mcap) or its folder")


def run(arguments: argparse.Namespace) -> int:
    """Print them as JSON, which every `--settings` takes; the exit status."""
    flight: Path = arguments.flight
    try:
        reader = PartsReader(flight / "flight.mcap" if flight.is_dir() else flight)
        for _ in reader.stored():
            if reader.settings is not None:
                break
    except FlightRecordError as error:
        sys.stderr.write(f"alight recording settings: {error}\n")
        return 2
    if reader.settings is None:
        sys.stderr.write(f"alight recording settings: {flight}: the recording holds no settings\n")
        return 1
    print(reader.settings.decode())
    return 0
