"""`alight recording migrate FILE --out FILE`: an old recording in the present version of the messages."""

import argparse
import sys
from pathlib import Path

from schemas.message import SCHEMA_VERSION
from station.migration.chain import MigrationError
from station.migration.rewritten import rewritten


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the options."""
    parser.description = (
        f"Write a recording of any older version with messages of schema version {SCHEMA_VERSION}. Alight itself reads old ones as "
        "they are; this is for other programs."
    )
    parser.add_argument("flight", type=Path, metavar="FILE.mcap", help="the old recording")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.mcap", help="the file to write")


def run(arguments: argparse.Namespace) -> int:
    """Migrate; the exit status."""
    try:
        count = rewritten(arguments.flight, arguments.out)
    except FileExistsError:
        sys.stderr.write(f"alight recording migrate: {arguments.out}: is there already, and nothing is overwritten\n")
        return 2
    except (MigrationError, OSError) as error:
        sys.stderr.write(f"alight recording migrate: {error}\n")
        return 2
    print(f"{arguments.out}: {count} messages, schema version {SCHEMA_VERSION}")
    return 0
