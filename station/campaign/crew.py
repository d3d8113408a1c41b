"""Who flies: the interface of the local crew and of the one on a Dask cluster."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

from station.campaign.flight_task import FlightTask
from station.campaign.row import Row


class CrewError(RuntimeError):
    """The crew cannot go on; what is flown is safe. One line with the remedy."""


@dataclass(frozen=True)
class Flown:
    """A flight that was flown."""

    row: Row
    took_s: float
    """Wall seconds of whoever flew it."""
    by: str
    """Host and process."""
    software: str


class Crew(Protocol):
    """Flies many flights."""

    def fly(self, tasks: Iterable[FlightTask]) -> Iterator[Flown]:
        """Each task once, in the order in which they are done.

        Raises:
            CrewError: If the crew cannot go on.
        """

    def close(self) -> None:
        """Let everything go that the crew started."""
