"""The folder that a command writes into: made and tried before the work begins, so that a wrong one is told at once."""

import tempfile
from pathlib import Path
from typing import BinaryIO


class OutFolderError(OSError):
    """A folder or file that cannot be written: one line with the option, the reason and the remedy."""


def make_folder(folder: Path, given: str) -> None:
    """Make a folder where it is missing.

    Args:
        folder: Which.
        given: How it was asked for, such as `--out DIR`.

    Raises:
        OutFolderError: If nothing can be written there.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise unwritable(given, error) from None


def created(file: Path, given: str) -> BinaryIO:
    """Open a new file to write.

    Args:
        file: Which.
        given: How it was asked for, such as `--out FILE`.

    Raises:
        FileExistsError: If it is there already.
        OutFolderError: If it cannot be written.
    """
    try:
        return file.open("xb")
    except FileExistsError:
        raise
    except OSError as error:
        raise unwritable(given, error) from None


def unwritable(given: str, error: OSError) -> OutFolderError:
    """The error of a file or folder, asked for as `given`, that cannot be written."""
    return OutFolderError(f"{given}: {error.strerror or error}: choose another folder")
