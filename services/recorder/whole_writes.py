"""A file that holds whole writes only, and outlives a full disk."""

import fcntl
import os
import threading
from contextlib import suppress
from pathlib import Path

from services.recorder.held_space import HeldSpace


class WholeWrites:
    """Appends to a new file; each write arrives whole or not at all.

    When the disk is full the room that was held back is used, and `full` says why: time to end the file in order. After
    a failure that this does not mend (device gone) the file is cut back to the last whole write, `failure` says why, and
    everything further is dropped, so that what is on the disk stays a readable beginning.
    """

    def __init__(self, path: Path) -> None:
        """Create the file, and lock it: it is in use.

        Raises:
            OSError: If it exists or cannot be created.
        """
        self._file = path.open("xb", buffering=0)
        with suppress(OSError):  # a file system without locks
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        self._held = HeldSpace(path.parent)
        self._end = 0
        self._syncing: threading.Thread | None = None
        self.full: OSError | None = None
        self.failure: OSError | None = None

    def hold_back(self, size_bytes: int) -> None:
        """Keep this much of the disk for the end."""
        if self.full is None:
            self._held.grow_to(size_bytes)

    def write(self, data: bytes) -> int:
        """Append `data`, or drop it after a failure; never raises."""
        if self.failure is None:
            error = self._try(data)
            if error is not None and self.full is None:
                self.full = error
                self._held.release()
                error = self._try(data)
            self.failure = error
        return len(data)

    def tell(self) -> int:
        """How many bytes have been written whole."""
        return self._end

    def flush(self) -> None:
        """Nothing is held back in this process."""

    def begin_sync(self) -> None:
        """Let the disk itself take everything, in a thread of its own: on a busy disk that takes seconds, and writing goes on."""
        if self._syncing is not None and self._syncing.is_alive():
            return
        with suppress(OSError, RuntimeError):  # no descriptor or no thread to be had: the next one will
            self._syncing = threading.Thread(target=_sync, args=(os.dup(self._file.fileno()),), daemon=True)
            self._syncing.start()

    def close(self) -> None:
        """Let go of the file."""
        self._held.release()
        with suppress(OSError):
            self._file.close()

    def _try(self, data: bytes) -> OSError | None:
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            with suppress(OSError):
                self._file.truncate(self._end)
                self._file.seek(self._end)
            return error
        self._end += len(data)
        return None


def _sync(descriptor: int) -> None:
    with suppress(OSError):
        os.fdatasync(descriptor)
    with suppress(OSError):
        os.close(descriptor)
