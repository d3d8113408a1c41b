"""`alight recording repair FILE`: makes a whole, indexed file of one that was cut short."""

import argparse
import sys
from pathlib import Path

from station.out_folder import unwritable
from station.recording.files import files_of
from station.recording.salvage import SalvageError, look, salvage

BROKEN = ".broken"
"""Added to the name of the file that was mended; it can be removed."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight recording repair`."""
    parser.add_argument(
        "recording", type=Path, metavar="FILE", help="a recording; of a folder every file that needs it"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help=f"write there; by default in its place, and the old one becomes *{BROKEN}",
    )


def run(arguments: argparse.Namespace) -> int:
    """Repair; returns 1 if something could not be."""
    files = files_of(arguments.recording)
    if not files:
        return _refuse(f"{arguments.recording}: no such recording")
    if arguments.out is not None and len(files) > 1:
        return _refuse(f"--out: {arguments.recording} has {len(files)} files; name one of them")
    return max(_repair(file, arguments.out) for file in files)


def _repair(file: Path, out: Path | None) -> int:
    try:
        found = look(file)
    except (SalvageError, OSError) as error:
        return _refuse(str(error) if isinstance(error, SalvageError) else f"{file}: {error.strerror}")
    if not found.messages:
        return _refuse(f"{file}: holds no messages: nothing can be saved, and it is left as it is")
    if not found.lost and out is None:
        print(f"{file}: whole, {found.messages} messages; nothing to repair")
        return 0
    try:
        _rewrite(file, out)
    except SalvageError as error:
        return _refuse(str(error))
    except OSError as error:
        return _refuse(_unwritten(error, file, out))
    print(f"{out or file}: {found.messages} messages saved")
    for lost in found.lost:
        print(f"lost: {lost}")
    return 0


def _unwritten(error: OSError, file: Path, out: Path | None) -> str:
    if out is None:
        return f"{file}: cannot be repaired in its place ({error.strerror or error}); --out FILE writes elsewhere"
    if isinstance(error, FileExistsError):
        return f"--out {out}: is there already, and nothing is overwritten"
    return str(unwritable(f"--out {out}", error))


def _refuse(reason: str) -> int:
    print(f"alight recording repair: {reason}", file=sys.stderr)
    return 1


def _rewrite(file: Path, out: Path | None) -> None:
    target = out or file.with_name(f"{file.name}.repaired")
    try:
        salvage(file, target)
    except FileExistsError:
        raise
    except BaseException:
        target.unlink(missing_ok=True)
        raise
    if out is None:
        broken = file.with_name(f"{file.name}{BROKEN}")
        if broken.exists():
            target.unlink()
            raise FileExistsError(f"there is a {broken.name} already")
        file.rename(broken)
        target.rename(file)
