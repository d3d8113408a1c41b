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
"""So long after its own first message a late recorder may still be finding publishers, and any recorder those of a service that has just
started: of what that said before, it is given the newest."""
ENDING_NS = nanoseconds(0.1)
"""When all services are stopped, the last messages of some come after the recorder's end."""


class Listening:
    """When the recorder of one flight listened."""

    def __init__(self, recording: ReplayRecording, lives: Mapping[str, Sequence[Life]]) -> None:
        logged_ns = [stored.logged_at_ns for stored in recording.stored]
        starts_ns = [life.started_at_ns for its_lives in lives.values() for life in its_lives if life.started_at_ns]
        self._recording = recording
        self._lives = lives
        self._begin_ns = min(logged_ns, default=0)
        self._end_ns = max(logged_ns, default=0) - ENDING_NS
        self._late = min(starts_ns, default=self._begin_ns) < self._begin_ns - LATE_NS

    def heard(self, topic: Topic[Any], published_at_ns: int) -> bool:
        """Whether a message of a topic that was published at this time, UTC ns, would be in the recording."""
        if published_at_ns > self._end_ns:
            return False
        if self._recording.older and not self._recording.of(topic):
            return False  # what an older version did not publish at all is no addition of this replay
        if self._is_still_sought(topic, published_at_ns):
            return False
        if not self._late:
            return True
        first = next((stored.logged_at_ns for stored in self._recording.of(topic)), self._begin_ns)
        return published_at_ns >= min(first, self._begin_ns + JOINING_NS)

    def _is_still_sought(self, topic: Topic[Any], published_at_ns: int) -> bool:
        """Whether the recorder had not heard anything on this topic yet from a publisher that had just started."""
        starts_ns = (life.started_at_ns for service in topic.publishers for life in self._lives.get(service, ()))
        started_ns = max((start_ns for start_ns in starts_ns if start_ns and start_ns <= published_at_ns), default=None)
        if started_ns is None or published_at_ns > started_ns + JOINING_NS:
            return False
        logged_ns = (stored.logged_at_ns for stored in self._recording.of(topic))
        first_ns = next((at_ns for at_ns in logged_ns if at_ns >= started_ns), None)
        return first_ns is None or published_at_ns < first_ns
