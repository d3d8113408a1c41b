"""From when to when the recorder listened: what was published outside of that cannot be in the recording."""

from collections.abc import Mapping, Sequence
from typing import Any

from alight.runtime.clock import nanoseconds
from schemas.topics import Topic
from station.replay.life import Life
from station.replay.recording import ReplayRecording

LATE_NS = nanoseconds(0.05)
"""A recorder that begins this long after another service has missed something."""
JOINING_NS = nanoseconds(2.0)
"""Until then after its first message a late recorder may still be finding publishers."""
ENDING_NS = nanoseconds(0.1)
"""When all services are stopped, the last messages of some come after the recorder's end."""


class Listening:
    """When the recorder of one flight listened."""

    def __init__(self, recording: ReplayRecording, lives: Mapping[str, Sequence[Life]]) -> None:
        logged_ns = [stored.logged_at_ns for stored in recording.stored]
        starts_ns = [life.started_at_ns for its_lives in lives.values() for life in its_lives if life.started_at_ns]
        self._recording = recording
        self._begin_ns = min(logged_ns, default=0)
        self._end_ns = max(logged_ns, default=0) - ENDING_NS
        self._late = min(starts_ns, default=self._begin_ns) < self._begin_ns - LATE_NS

    def heard(self, topic: Topic[Any], published_at_ns: int) -> bool:
        """Whether a message of a topic that was published at this time, UTC ns, would be in the recording."""
        if published_at_ns > self._end_ns:
            return False
        if self._recording.older and not self._recording.of(topic):
            return False  # what an older version did not publish at all is no addition of this replay
        if not self._late:
            return True
        first = next((stored.logged_at_ns for stored in self._recording.of(topic)), self._begin_ns)
        return published_at_ns >= min(first, self._begin_ns + JOINING_NS)
