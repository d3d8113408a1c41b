"""A file that holds whole writes only, and outlives a full disk."""

from contextlib import suppress
from pathlib import Path


class WholeWrites:
    """Appends to a new file; each write arrives whole or not at all.

    After the first failure (disk full, device gone) the file is cut back to the last whole write, `failure` says why,
    and everything further is dropped, so that what is on the disk stays a readable beginning.
    """

    def __init__(self, path: Path) -> None:
        """Create the file.

        Raises:
            OSError: If it exists or cannot be created.
        """
        self._file = path.open("xb", buffering=0)
        self._end = 0
        self.failure: OSError | None = None

    def write(self, data: bytes) -> int:
        """Append `data`, or drop it after a failure; never raises."""
        if self.failure is None:
            try:
                self._append(memoryview(data))
            except OSError as error:
                self.failure = error
                self._cut_back()
        return len(data)

    def tell(self) -> int:
        """How many bytes have been written whole."""
        return self._end

    def flush(self) -> None:
        """Nothing is held back in this process."""

    def close(self) -> None:
        """Let go of the file."""
        with suppress(OSError):
            self._file.close()

    def _append(self, rest: memoryview) -> None:
        length = len(rest)
        while rest:
            rest = rest[self._file.write(rest) :]
        self._end += length

    def _cut_back(self) -> None:
        with suppress(OSError):
            self._file.truncate(self._end)
