"""How long things took in a flight: for messages that there were not in it."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from statistics import median_low

from alight.runtime.clock import nanoseconds
from schemas import topics
from schemas.journal import EntryKind
from schemas.message import Traced
from schemas.settings import Settings
from station.replay.life import Life
from station.replay.recording import ReplayRecording

_SAMPLES = 200
"""Outputs looked at for each service: enough for a median."""


class Latencies:
    """Medians of one flight; where it has none, the durations of lockstep flights."""

    def __init__(
        self, processing_ns: Mapping[str, int], transport_ns: Mapping[tuple[str, str], int], hop_ns: int
    ) -> None:
        self._processing_ns = processing_ns
        self._transport_ns = transport_ns
        self._hop_ns = hop_ns

    def of_service(self, service: str) -> int:
        """From handling an input to publishing what follows from it, nanoseconds."""
        return self._processing_ns.get(service, 0)

    def between(self, topic: str, publisher: str, reader: str) -> int:
        """From the publisher's handling of the cause to the reader's handling of the message, nanoseconds."""
        return self.of_service(publisher) + self._transport_ns.get((topic, reader), self._hop_ns)


def median_latencies_ns(
    recording: ReplayRecording, lives: Mapping[str, Sequence[Life]], settings: Settings
) -> Latencies:
    """Measure a flight."""
    processing_ns = {name: nanoseconds(value) for name, value in settings.lockstep.processing_s.items()}
    published_at_ns: dict[tuple[str, int], int] = {}
    for service in topics.SERVICES:
        measured_ns = []
        for topic in topics.published_by(service):
            if not issubclass(topic.message, Traced) or topic.has_pixels:
                continue
            for stored in recording.of(topic)[-_SAMPLES:]:
                message = recording.message(topic, stored.stamp_ns)
                if isinstance(message, Traced) and message.hops and message.hops[-1].service == service:
                    hop = message.hops[-1]
                    measured_ns.append(hop.published_at_ns - hop.handled_at_ns)
                    published_at_ns[topic.name, stored.stamp_ns] = hop.published_at_ns
        if measured_ns:
            processing_ns[service] = max(0, median_low(measured_ns))
    return Latencies(processing_ns, _transport_ns(lives, published_at_ns), nanoseconds(settings.lockstep.hop_s))


def _transport_ns(
    lives: Mapping[str, Sequence[Life]], published_at_ns: Mapping[tuple[str, int], int]
) -> dict[tuple[str, str], int]:
    """From publication to handling, by topic and reader, nanoseconds."""
    measured_ns: defaultdict[tuple[str, str], list[int]] = defaultdict(list)
    for reader, its_lives in lives.items():
        for life in its_lives:
            for entry in life.entries:
                left_ns = published_at_ns.get((entry.source, entry.stamp_ns))
                if left_ns is not None and entry.kind is EntryKind.MESSAGE:
                    measured_ns[entry.source, reader].append(entry.now_ns - left_ns)
    return {key: max(0, median_low(values)) for key, values in measured_ns.items()}
