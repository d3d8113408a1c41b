"""Lets the recorder write what an import has gathered, as if it had heard it in flight."""

import heapq
from collections import Counter
from collections.abc import Iterable, Sequence

from alight.runtime.node import Arrival, Node
from schemas.settings import Settings
from services.recorder.service import build
from station.recording_import.heard import Heard


def write(streams: Sequence[Iterable[Heard]], settings: Settings) -> Counter[str]:
    """Record the streams, each in order of arrival, merged by it; returns the messages by topic.

    If a stream fails half-way, no file is left.

    Raises:
        ValueError: In one line, if the file cannot be created.
    """
    recorder = build(settings)
    try:
        counts = _record(recorder, streams)
    except BaseException:
        recorder.close()
        # Half a recording would pass for a whole one.
        (settings.recorder.directory / settings.recorder.file_name).unlink(missing_ok=True)
        raise
    recorder.close()
    return counts


def _record(recorder: Node, streams: Sequence[Iterable[Heard]]) -> Counter[str]:
    counts: Counter[str] = Counter()
    next_tick_ns = 0
    for heard in heapq.merge(*streams, key=lambda one: one.at_ns):
        if recorder.tick_period_ns is not None and heard.at_ns >= next_tick_ns:
            next_tick_ns = heard.at_ns + recorder.tick_period_ns
            list(recorder.on_tick(heard.at_ns))
        list(recorder.on_message(Arrival(heard.topic, heard.message, heard.at_ns, heard.at_ns, heard.pixels)))
        counts[heard.topic.name] += 1
    return counts
