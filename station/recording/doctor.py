"""`alight recording doctor FILE`: is it an MCAP file to the letter, and does each message keep to its schema?"""

import argparse
import sys
from pathlib import Path

from station.recording.contents import can_validate, examine_contents, examine_reading
from station.recording.files import files_of
from station.recording.structure import examine

MOST_LINES = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight recording doctor`."""
    parser.add_argument("recordings", type=Path, nargs="+", metavar="FILE", help="recordings, or their folders")


def run(arguments: argparse.Namespace) -> int:
    """Examine; returns 1 if anything is wrong."""
    files = [file for path in arguments.recordings for file in files_of(path)]
    if not files:
        print(f"alight recording doctor: {arguments.recordings[0]}: no such recording", file=sys.stderr)
        return 1
    if not can_validate():
        print("note: messages are not held against their schemas; for that: pip install jsonschema")
    return max(_examine(file) for file in files)


def problems_of(file: Path) -> tuple[list[str], list[str]]:
    """What is wrong with a file, and what is odd about it but allowed."""
    data = file.read_bytes()
    structure = examine(memoryview(data))
    problems = [*structure.problems, *examine_contents(structure)]
    if not structure.problems:
        problems += examine_reading(data, structure)
    return problems, structure.warnings


def _examine(file: Path) -> int:
    problems, warnings = problems_of(file)
    for what, lines in (("wrong", problems), ("odd", warnings)):
        for line in lines[:MOST_LINES]:
            print(f"{what}: {line}")
        if len(lines) > MOST_LINES:
            print(f"{what}: and {len(lines) - MOST_LINES} more")
    print(f"{file}: {len(problems)} errors, {len(warnings)} warnings")
    return 1 if problems else 0
