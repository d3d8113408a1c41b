"""`alight experiment filters`: compare filters on the same fixes, of recorded flights or of descents flown for it."""

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from alight.runtime.settings_file import SettingsError, assigned, settings_from
from schemas.settings import Settings
from station.count_progress import CountProgress
from station.experiment.descent_flights import fly_descents
from station.experiment.filter_comparison import Comparison, ComparisonError, compare
from station.experiment.filter_table import comparison_lines
from station.flight_record import FlightRecord
from station.mcap_parts import FlightRecordError

METHODS = ("kalman", "moving", "mean", "median", "none")
EPILOG = """\
Recorded flights need the ground truth: simulated ones have it. With --flights, descents in wind are flown in lockstep first,
with GNSS that wanders a metre a minute, an 80 ms old picture, lost frames and gross outliers (station/experiment/descent.toml);
those that are in --out already are not flown again.

exit status: 0 if the comparison was made; 1 if it could not be.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the options."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = EPILOG
    parser.add_argument("recordings", nargs="*", type=Path, metavar="FLIGHT", help="recordings: files or folders")
    parser.add_argument("--flights", type=_positive, metavar="N", help="fly N descents instead")
    parser.add_argument("--first-seed", type=int, default=0, metavar="N", help="seed of the first of them (default 0)")
    parser.add_argument("--jobs", type=_positive, default=1, metavar="N", help="flights at a time (default 1)")
    parser.add_argument(
        "--out", type=Path, default=Path("experiments/filters"), metavar="DIR", help="where flights and figures go"
    )
    parser.add_argument(
        "--methods", type=_methods, default=("kalman", "mean", "none"), metavar="A,B", help=f"of {', '.join(METHODS)}"
    )
    parser.add_argument(
        "--relocate",
        action="store_true",
        help="make the fixes anew from the recorded detections, and show besides what the latest pose instead of that at "
        "capture time costs, and the other ways to a fix where geolocator.height says how high the pad lies",
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="SECTION.KEY=VALUE", help="set one key; repeatable"
    )


def run(arguments: argparse.Namespace) -> int:
    """Fly if asked to, compare, print and draw; the exit status."""
    if bool(arguments.recordings) == bool(arguments.flights):
        sys.stderr.write("alight experiment filters: give either recordings or --flights N\n")
        return 1
    from station.experiment.filter_figures import write_figures  # noqa: PLC0415 - without matplotlib --help still works
    from station.report.error import ReportError  # noqa: PLC0415

    try:
        recordings = _flown(arguments) if arguments.flights else arguments.recordings
        result = _compared(recordings, arguments)
        print("\n".join(comparison_lines(result)))
        for files in write_figures(result, arguments.out):
            print(f"\n{files.svg}\n{files.pdf}")
    except (SettingsError, ComparisonError, FlightRecordError, ReportError, OSError) as error:
        sys.stderr.write(f"alight experiment filters: {error}\n")
        return 1
    return 0


def _flown(arguments: argparse.Namespace) -> list[Path]:
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.flights)
    return fly_descents(
        seeds,
        arguments.out / "flights",
        os.environ,
        arguments.set,
        jobs=arguments.jobs,
        on_flown=lambda seed, said: print(f"seed {seed}: {said}", file=sys.stderr, flush=True),
    )


def _compared(recordings: list[Path], arguments: argparse.Namespace) -> Comparison:
    def overridden(record: FlightRecord) -> Settings:
        settings: dict[str, Any] = dict(record.provenance.settings)
        if not settings:
            raise ComparisonError("a recording has no settings: it cannot be asked what it flew with")
        try:
            return settings_from([("the recording", settings), *assigned(arguments.set)])
        except ValidationError as error:
            raise ComparisonError(f"a recording's settings are of another version: {error}") from None

    return compare(
        recordings,
        {method: method for method in arguments.methods},
        overridden,
        relocate=arguments.relocate,
        on_done=CountProgress("compared", len(recordings)).show,
    )


def _methods(text: str) -> tuple[str, ...]:
    chosen = tuple(text.split(","))
    unknown = [method for method in chosen if method not in METHODS]
    if unknown:
        raise argparse.ArgumentTypeError(f"{', '.join(unknown)}: choose of {', '.join(METHODS)}")
    return chosen


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError("at least 1")
    return number
