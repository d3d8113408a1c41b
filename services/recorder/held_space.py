"""Room on the disk that is held back, so that a recording can be ended in order when the disk is full."""

import os
import tempfile
from contextlib import suppress
from pathlib import Path


class HeldSpace:
    """A file without a name that only takes up room; the operating system drops it with the process, however that ends."""

    def __init__(self, directory: Path) -> None:
        """Begin with no room.

        Raises:
            OSError: If no file can be made there.
        """
        self._file = tempfile.TemporaryFile(dir=directory)  # noqa: SIM115 - held until released
        self._size = 0

    def grow_to(self, size_bytes: int) -> None:
        """Hold this much, or what there is."""
        if size_bytes > self._size and not self._file.closed:
            with suppress(OSError):
                os.posix_fallocate(self._file.fileno(), 0, size_bytes)
                self._size = size_bytes

    def release(self) -> None:
        """Give it back."""
        with suppress(OSError):
            self._file.close()
