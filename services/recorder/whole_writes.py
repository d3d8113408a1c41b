"""A file that holds whole writes only, and outlives a full disk."""

import fcntl
import os
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

    def sync(self) -> None:
        """Wait until the disk itself has everything."""
        with suppress(OSError):
            os.fdatasync(self._file.fileno())

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
