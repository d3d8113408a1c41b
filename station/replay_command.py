"""`alight replay FLIGHT.mcap`: a recorded flight once more, on the bus or, with `--through`, through changed code."""

import argparse
import sys
from pathlib import Path

from station.out_folder import OutFolderError, make_folder
from station.replay import command as through
from station.republish import command as republish


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
    parser.add_argument("--settings", type=Path, metavar="FILE", help="TOML file with settings (default: built in)")
    parser.add_argument(
        "--set", action="append", default=[], metavar="SECTION.KEY=VALUE", help="set one key; repeatable"
    )
    through.add_arguments(parser)
    republish.add_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Replay; the exit status."""
    if arguments.through or arguments.update:
        try:
            if arguments.report and not arguments.update:
                make_folder(arguments.report, f"--report {arguments.report}")
        except OutFolderError as error:
            sys.stderr.write(f"alight replay: {error}\n")
            return 2
        return through.run(arguments)
    if arguments.report or arguments.json or arguments.tolerance:
        sys.stderr.write("alight replay: --report, --json and --tolerance need nodes: add --through SERVICE,...\n")
        return 2
    return republish.run(arguments)
