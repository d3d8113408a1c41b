"""What the recorder's node sees of its file."""

from pathlib import Path
from typing import Protocol

from services.recorder.entry import Entry
from services.recorder.provenance import Document
from services.recorder.tally import Tally


class Recording(Protocol):
    """Where entries go. Nothing here raises."""

    @property
    def tally(self) -> Tally:
        """What became of the entries so far."""
        ...

    @property
    def failure(self) -> str | None:
        """Why nothing is recorded at present, if so."""
        ...

    @property
    def path(self) -> Path:
        """The file that is written now, or that was written last."""
        ...

    @property
    def quota_exceeded_bytes(self) -> int:
        """By how much this recording alone is longer than all may be."""
        ...

    def add(self, entry: Entry) -> None:
        """Write one entry."""
        ...

    def keep_document(self, document: Document) -> None:
        """Put a document beside the messages."""
        ...

    def trigger(self) -> None:
        """A landing is asked for."""
        ...

    def tick(self, now_ns: int) -> None:
        """Let nothing wait in memory for longer than the flush period."""
        ...

    def finish(self) -> None:
        """Complete the file."""
        ...
