"""A recording written by hand: for programs that make recordings of what nobody published."""

from pathlib import Path
from typing import Any

from schemas.frame import FrameHeader
from schemas.message import Message
from schemas.settings import Settings
from schemas.topics import Topic
from services.recorder.entries import EntryMaker
from services.recorder.flight_file import FlightFile


class MessageFile:
    """Takes messages and finished pictures in the order in which they shall stand in the file."""

    def __init__(self, settings: Settings) -> None:
        """Create the file.

        Raises:
            FlightFileError: If it cannot be created.
        """
        self._file = FlightFile(settings)
        self._entries = EntryMaker(settings)

    @property
    def path(self) -> Path:
        """The file."""
        return self._file.path

    @property
    def failure(self) -> str | None:
        """Why it could not be written, if so."""
        return self._file.failure

    def add(self, topic: Topic[Any], message: Message, now_ns: int) -> None:
        """Write one message, as if it had arrived at `now_ns`."""
        entry = self._entries.of_message(topic, message, now_ns, now_ns)
        if entry is not None:
            self._file.add(entry)

    def add_picture(self, topic: Topic[Any], header: FrameHeader, data: bytes, now_ns: int) -> None:
        """Write a frame's picture, in the form that `recorder.frames` names."""
        entry = self._entries.of_picture(topic, header, data, now_ns, now_ns)
        if entry is not None:
            self._file.add(entry)

    def flush(self, now_ns: int) -> None:
        """Close the chunk: what is read together lies together."""
        self._file.tick(now_ns)

    def finish(self) -> None:
        """Write the index and close."""
        self._file.finish()
