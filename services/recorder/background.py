"""Takes the disk, the compression and the making of pictures off the node's thread.

A disk that stalls for a second then delays nothing but its own queue, and what waits is bounded: pictures are given up
first, and what was given up is counted.
"""

import logging
import queue
import threading
from collections.abc import Callable
from pathlib import Path

from services.recorder.entry import Entry, Picture
from services.recorder.flight_file import FlightFile
from services.recorder.host import Host
from services.recorder.provenance import Document
from services.recorder.tally import Tally

LOGGER = logging.getLogger("alight")

_PICTURES_SHARE = 0.75


class BackgroundFile:
    """A flight's file that is written by a thread of its own; to the node it looks the same."""

    def __init__(self, file: FlightFile, host: Host, limit_bytes: int) -> None:
        """Start the thread.

        Args:
            file: Where to write; from now on nobody else may.
            host: Tells the time, for the lag.
            limit_bytes: What may wait.
        """
        self._file = file
        self._host = host
        self._limit_bytes = limit_bytes
        self._waiting_bytes = 0
        self._taken_bytes = 0
        self._work: queue.SimpleQueue[tuple[Callable[[], None], int] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="disk", daemon=True)
        self._thread.start()

    @property
    def tally(self) -> Tally:
        """See `FlightFile.tally`."""
        return self._file.tally

    @property
    def failure(self) -> str | None:
        """See `FlightFile.failure`."""
        return self._file.failure

    @property
    def path(self) -> Path:
        """See `FlightFile.path`."""
        return self._file.path

    @property
    def quota_exceeded_bytes(self) -> int:
        """See `FlightFile.quota_exceeded_bytes`."""
        return self._file.quota_exceeded_bytes

    def add(self, entry: Entry) -> None:
        """Queue one entry, or give it up where too much waits already."""
        waiting_bytes = self._waiting_bytes - self._taken_bytes
        limit_bytes = self._limit_bytes * (_PICTURES_SHARE if isinstance(entry.data, Picture) else 1.0)
        if waiting_bytes + entry.weight_bytes > limit_bytes:
            self._file.tally.lost_backlog += 1
            return
        self._waiting_bytes += entry.weight_bytes
        self._work.put((lambda: self._add(entry), entry.weight_bytes))

    def keep_document(self, document: Document) -> None:
        """See `FlightFile.keep_document`."""
        self._work.put((lambda: self._file.keep_document(document), 0))

    def trigger(self) -> None:
        """See `FlightFile.trigger`."""
        self._work.put((self._file.trigger, 0))

    def tick(self, now_ns: int) -> None:
        """See `FlightFile.tick`."""
        self._work.put((lambda: self._file.tick(now_ns), 0))

    def finish(self) -> None:
        """Write what waits and complete the file."""
        self._work.put((self._file.finish, 0))
        self._work.put(None)
        self._thread.join()

    def _add(self, entry: Entry) -> None:
        self._file.add(entry)
        lag_us = (self._host.now_ns() - entry.received_at_ns) // 1000
        self._file.tally.lag_max_us = max(self._file.tally.lag_max_us, lag_us)

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            do, weight_bytes = work
            try:
                do()
            except Exception:
                # A bug must not silently end the recording of a flight.
                LOGGER.exception("the recording has a bug")
            self._taken_bytes += weight_bytes
