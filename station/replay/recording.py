"""A recording as a replay needs it: messages are found by topic and stamp, and read only when somebody wants them."""

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from alight.runtime.node import Pixels
from schemas import topics
from schemas.journal import Journal
from schemas.message import SCHEMA_VERSION, Message
from schemas.topics import Topic
from station.mcap_parts import PartsReader, PictureStore, StoredMessage


class ReplayRecording:
    """The messages of one flight."""

    def __init__(self, path: Path) -> None:
        """Go through the files once.

        Args:
            path: The MCAP file, or the folder with a `flight.mcap`.

        Raises:
            FlightRecordError: If there is no such file or it is no MCAP file.
        """
        self.path = path / "flight.mcap" if path.is_dir() else path
        reader = PartsReader(self.path)
        self.stored: tuple[StoredMessage, ...] = tuple(reader.stored())
        """Everything, in file order."""
        self.settings: Mapping[str, Any] = json.loads(reader.settings) if reader.settings else {}
        """As recorded, by whatever version recorded it."""
        self.versions: Mapping[str, str] = reader.versions
        self.older = int(reader.versions.get("schema", SCHEMA_VERSION)) < SCHEMA_VERSION
        """Whether an older version of the messages made it: what that did not have cannot be compared."""
        self.defects: tuple[str, ...] = tuple(reader.defects())
        self.pictures = PictureStore(reader.pictures)
        self.ended_at_ns = max((stored.logged_at_ns for stored in self.stored), default=0)
        """When the last message was logged, UTC ns."""
        self._by_topic: defaultdict[str, list[StoredMessage]] = defaultdict(list)
        self._by_stamp: defaultdict[tuple[str, int], list[StoredMessage]] = defaultdict(list)
        for stored in self.stored:
            self._by_topic[stored.topic.name].append(stored)
            self._by_stamp[stored.topic.name, stored.stamp_ns].append(stored)
        self._read: dict[tuple[str, int, int], Message | None] = {}

    def of(self, topic: Topic[Any]) -> Sequence[StoredMessage]:
        """The messages of a topic, in the order of recording."""
        return self._by_topic[topic.name]

    def find(self, topic: Topic[Any], stamp_ns: int, number: int = 0) -> StoredMessage | None:
        """A message that is not read yet; None if it was not recorded. The arguments are those of `message`."""
        found = self._by_stamp.get((topic.name, stamp_ns), ())
        return found[number] if number < len(found) else None

    def message(self, topic: Topic[Any], stamp_ns: int, number: int = 0) -> Message | None:
        """The message of a topic that speaks of this time, UTC ns; None if it was not recorded or cannot be read.

        Args:
            topic: The topic.
            stamp_ns: The time it speaks of, UTC ns.
            number: Which of several that speak of the same time, in the order of recording.
        """
        key = (topic.name, stamp_ns, number)
        if key not in self._read:
            stored = self.find(topic, stamp_ns, number)
            self._read[key] = None if stored is None else _readable(stored)
        return self._read[key]

    def picture(self, captured_at_ns: int) -> Pixels | None:
        """The picture of one frame; None if it was not kept."""
        picture = self.pictures.picture(captured_at_ns)
        if picture is not None:
            picture.flags.writeable = False
        return picture

    def journals(self, service: str) -> list[tuple[Journal, int]]:
        """A service's journals and when each reached the recorder (UTC ns), in the order of recording."""
        return [
            (journal, stored.logged_at_ns)
            for stored in self.of(topics.JOURNAL)
            if stored.sender == service and isinstance(journal := _readable(stored), Journal)
        ]


def _readable(stored: StoredMessage) -> Message | None:
    try:
        return stored.message()
    except ValidationError:
        return None
