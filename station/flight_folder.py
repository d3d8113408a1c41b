"""The folder of one flight, which is taken back where nothing came of the flight."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from station.out_folder import make_folder

LOGS = "logs"
SETTINGS = "settings.json"


@contextlib.contextmanager
def flight_folder(path: Path) -> Iterator[None]:
    """Make the folder and that of its logs; if what is done there fails before anything was written, remove what was made.

    A folder that was there before is left as it is, and so is one that holds anything but the settings and empty logs.

    Raises:
        OutFolderError: If it cannot be made.
    """
    made = [folder for folder in (path / LOGS, path, *path.parents) if not folder.exists()]
    make_folder(path / LOGS, f"--out {path}")
    try:
        yield
    except BaseException:
        if path in made:
            _take_back(path, made)
        raise


def _take_back(path: Path, made: list[Path]) -> None:
    files = [found for found in path.rglob("*") if not found.is_dir()]
    if not all(file == path / SETTINGS or _is_empty_log(file, path) for file in files):
        return
    with contextlib.suppress(OSError):
        for file in files:
            file.unlink()
        for folder in made:  # only what is empty can be removed so
            folder.rmdir()


def _is_empty_log(file: Path, path: Path) -> bool:
    return file.parent == path / LOGS and file.stat().st_size == 0
