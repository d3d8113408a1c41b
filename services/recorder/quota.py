"""Makes room: of all recordings beside the present one the oldest go first."""

import fcntl
import logging
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mcap.exceptions import McapError
from mcap.records import Header
from mcap.stream_reader import StreamReader

from services.recorder import layout

LOGGER = logging.getLogger("alight")


@dataclass(frozen=True)
class _Recording:
    """The files of one folder."""

    directory: Path
    files: tuple[Path, ...]
    size_bytes: int
    newest_ns: int


class Quota:
    """Watches over what the recordings in the folder above the present one take.

    Only files that name this program as their maker are counted, and only they are removed, with the folder if it is
    empty then. What a recorder still writes to is locked, and stays.
    """

    def __init__(self, directory: Path, limit_bytes: int) -> None:
        self._directory = directory.absolute()
        self._limit_bytes = limit_bytes
        self._checked_bytes: int | None = None
        self.exceeded_bytes = 0
        """By how much the present recording alone is too long."""

    def look(self, written_bytes: int) -> None:
        """Make room if it is needed; to be called with the length of the present recording as often as wanted."""
        step_bytes = self._limit_bytes // 50
        if self._limit_bytes == 0 or (
            self._checked_bytes is not None and written_bytes - self._checked_bytes < step_bytes
        ):
            return
        self._checked_bytes = written_bytes
        with suppress(OSError):
            self._make_room(step_bytes)

    def _make_room(self, step_bytes: int) -> None:
        present, others = self._recordings()
        over_bytes = present + sum(other.size_bytes for other in others) + step_bytes - self._limit_bytes
        for recording in sorted(others, key=lambda one: (one.newest_ns, one.directory)):
            if over_bytes <= 0:
                break
            over_bytes -= _remove(recording)
        self.exceeded_bytes = max(0, over_bytes - step_bytes)

    def _recordings(self) -> tuple[int, list[_Recording]]:
        present_bytes, others = 0, []
        for directory in sorted(path for path in self._directory.parent.iterdir() if path.is_dir()):
            files = tuple(path for path in sorted(directory.glob("*.mcap")) if _is_ours(path))
            sizes = [path.stat() for path in files]
            total_bytes = sum(size.st_size for size in sizes)
            if directory.absolute() == self._directory:
                present_bytes = total_bytes
            elif files:
                newest_ns = max(size.st_mtime_ns for size in sizes)
                others.append(_Recording(directory, files, total_bytes, newest_ns))
        return present_bytes, others


def _is_ours(path: Path) -> bool:
    if path.is_symlink() or not path.is_file():
        return False
    try:
        with path.open("rb") as file:
            head = next(iter(StreamReader(file, record_size_limit=4096).records))
    except (OSError, McapError, StopIteration, ValueError):
        return False
    return isinstance(head, Header) and head.library == layout.LIBRARY


def _remove(recording: _Recording) -> int:
    if any(_is_in_use(path) for path in recording.files):
        return 0
    for path in recording.files:
        path.unlink()
    with suppress(OSError):  # reports and logs stay, and with them the folder
        recording.directory.rmdir()
    LOGGER.info("old recording removed", extra={"directory": str(recording.directory)})
    return recording.size_bytes


def _is_in_use(path: Path) -> bool:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # a file system without locks
        return False
    finally:
        os.close(descriptor)
    return False
