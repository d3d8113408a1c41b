"""A recorded flight, read back into typed messages; an unfinished file yields what is whole in it."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from alight.runtime.node import Pixels
from schemas.message import Message
from schemas.topics import Topic
from station.mcap_parts import PartsReader, PictureStore

M = TypeVar("M", bound=Message)
M_co = TypeVar("M_co", bound=Message, covariant=True)


@dataclass(frozen=True)
class Logged(Generic[M_co]):
    """One recorded message."""

    message: M_co
    logged_at_ns: int
    """When it reached the recorder, UTC ns."""


@dataclass(frozen=True)
class Provenance:
    """What made the recording."""

    versions: Mapping[str, str] = field(default_factory=dict)
    """Versions of the program and what it stands on, vehicle and seed, by name."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """All settings of the flight, as JSON; empty if the recording has none."""
    defects: tuple[str, ...] = ()
    """What is wrong with the recording, in words; empty for a finished one."""


class FlightRecord:
    """The messages of one flight by topic, in the order in which they were recorded; pictures are read when asked for."""

    def __init__(
        self,
        entries: Iterable[tuple[str, Logged[Any]]],
        provenance: Provenance | None = None,
        pictures: PictureStore | None = None,
    ) -> None:
        """Take the messages in.

        Args:
            entries: Topic's name and message, in the order of recording.
            provenance: What made the recording.
            pictures: Where the frames' pictures are.
        """
        self.provenance = provenance or Provenance()
        self._pictures = pictures or PictureStore()
        self._entries: dict[str, list[Logged[Any]]] = {}
        for name, logged in entries:
            self._entries.setdefault(name, []).append(logged)

    def logged(self, topic: Topic[M]) -> tuple[Logged[M], ...]:
        """The messages of a topic with the times of their recording."""
        return tuple(self._entries.get(topic.name, ()))

    def messages(self, topic: Topic[M]) -> tuple[M, ...]:
        """The messages of a topic; for a topic with a key for each service those of all, mixed."""
        return tuple(logged.message for logged in self._entries.get(topic.name, ()))

    @property
    def is_empty(self) -> bool:
        """Whether there is no message at all."""
        return not self._entries

    @property
    def picture_times_ns(self) -> tuple[int, ...]:
        """Capture times of the frames whose pictures were kept, ascending, UTC ns."""
        return self._pictures.times_ns

    def picture(self, captured_at_ns: int) -> Pixels | None:
        """The picture of one frame, (height, width) or (height, width, 3) in BGR; None if it is not in the recording."""
        return self._pictures.picture(captured_at_ns)

    def setting(self, section: str, key: str, otherwise: Any) -> Any:
        """One value of the flight's settings, or `otherwise` where the recording has none."""
        found = self.provenance.settings.get(section)
        return found.get(key, otherwise) if isinstance(found, Mapping) else otherwise


def read_flight(path: Path) -> FlightRecord:
    """Read a recording and the parts that a restarted recorder wrote beside it (`flight_2.mcap` ...).

    Args:
        path: The MCAP file, or the folder with a `flight.mcap`.

    Raises:
        FlightRecordError: If there is no such file or it is no MCAP file.
    """
    reader = PartsReader(path / "flight.mcap" if path.is_dir() else path)
    entries = [(name, Logged(message, logged_at_ns)) for name, message, logged_at_ns in reader.messages()]
    settings = json.loads(reader.settings) if reader.settings else {}
    provenance = Provenance(reader.versions, settings, tuple(reader.defects()))
    return FlightRecord(entries, provenance, PictureStore(reader.pictures))
