"""A recorder that keeps in memory what the metrics need, for flights of which no file shall remain."""

from typing import Any, ClassVar

from alight.runtime.node import Arrival, Node, Outputs
from schemas import topics
from schemas.settings import Settings
from station.flight_record import FlightRecord, Logged, Provenance

MEASURED = (
    topics.MISSION_STATUS,
    topics.GROUND_TRUTH,
    topics.VEHICLE_STATE,
    topics.FRAME,
    topics.DETECTION,
    topics.PAD_FIX,
    topics.PAD_ESTIMATE,
    topics.SETPOINT,
    topics.HEALTH,
)
"""What `station.metrics.summary.summarise` looks at."""


class MemoryRecorder(Node):
    """Takes the recorder's place in a lockstep flight; pictures are not kept."""

    service: ClassVar[str] = "recorder"

    def __init__(self, settings: Settings) -> None:
        super().__init__()
        self._settings = settings
        self._entries: list[tuple[str, Logged[Any]]] = []
        for topic in MEASURED:
            self.subscribe(topic, self._on_any)

    def record(self) -> FlightRecord:
        """The flight so far."""
        return FlightRecord(self._entries, Provenance(settings=self._settings.model_dump(mode="json")))

    def _on_any(self, arrival: Arrival[Any]) -> Outputs:
        self._entries.append((arrival.topic.name, Logged(arrival.message, arrival.now_ns)))
        return ()
