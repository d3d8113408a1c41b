"""`alight replay FLIGHT.mcap`: a recorded flight once more, on the bus or, with `--through`, through changed code."""

import argparse
import sys
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the options."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(
        "flights",
        type=Path,
        nargs="+",
        metavar="FLIGHT",
        help="a recording (flight.mcap) or the folder it lies in",
    )


def run(arguments: argparse.Namespace) -> int:  # noqa: ARG001
    """Replay; the exit status."""
    sys.stderr.write("alight replay: say through which nodes, with --through detector,geolocator,filter,commander\n")
    return 2
