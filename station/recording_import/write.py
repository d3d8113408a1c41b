"""Lets the recorder write what an import has gathered, as if it had heard it in flight."""

import heapq
from collections import Counter
from collections.abc import Iterable, Sequence

from alight.runtime.node import Arrival
from schemas.settings import Settings
from services.recorder.service import build
from station.recording_import.heard import Heard


def write(streams: Sequence[Iterable[Heard]], settings: Settings) -> Counter[str]:
    """Record the streams, each in order of arrival, merged by it; returns the messages by topic.

    Raises:
        ValueError: In one line, if the file cannot be created.
    """
    recorder = build(settings)
    counts: Counter[str] = Counter()
    next_tick_ns = 0
    try:
        for heard in heapq.merge(*streams, key=lambda one: one.at_ns):
            if recorder.tick_period_ns is not None and heard.at_ns >= next_tick_ns:
                next_tick_ns = heard.at_ns + recorder.tick_period_ns
                list(recorder.on_tick(heard.at_ns))
            arrival = Arrival(heard.topic, heard.message, heard.at_ns, heard.at_ns, heard.pixels)
            list(recorder.on_message(arrival))
            counts[heard.topic.name] += 1
    finally:
        recorder.close()
    return counts
