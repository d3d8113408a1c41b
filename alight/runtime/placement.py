"""Keeps the services that steer together on one of the host's processors.

Each of them works for a fraction of a millisecond a frame, one after the other. Wherever the kernel finds room for them, they find
caches that a picture has just gone through. On a processor of their own they find what they left there a frame ago, and each wakes
the next without a word from one processor to another. What works on pictures gives way to them there, and has the others. By
`station.bench overhead`, flown in turns on two virtual processors: 1.9 to 2.5 ms (six flights), without it 2.8 to 2.9 (three).
"""

import os
from pathlib import Path

TOGETHER = frozenset({"geolocator", "filter", "commander", "simulator"})
"""In a flight they use some 15 % of one of two virtual processors (2026), the busiest of them 5."""

_THREADS = Path("/proc/self/task")


def gather(service: str, *, wanted: bool) -> str:
    """Put all threads of this process on the processor of those that steer; to be called when it has loaded.

    Only a process that runs in real time may go there: another would have to wait there for whoever comes, while the processor
    beside it is free. It is the last of those that this process may use: the first has the host's interrupts on most computers,
    and is one of the slow ones where not all are alike.

    Args:
        service: Whose process this is.
        wanted: Whether the settings want it.

    Returns:
        Where it runs, for the log: `processor 3` or `any`.
    """
    if not wanted or service not in TOGETHER or not _is_real_time():
        return "any"
    processors = os.sched_getaffinity(0)
    if len(processors) < 2:
        return "any"
    chosen = max(processors)
    for thread in _THREADS.iterdir():
        _place(int(thread.name), chosen)
    return f"processor {chosen}"


def _place(thread: int, processor: int) -> None:
    try:
        os.sched_setaffinity(thread, {processor})
    except ProcessLookupError:
        return  # it has ended meanwhile


def _is_real_time() -> bool:
    return hasattr(os, "sched_getscheduler") and os.sched_getscheduler(0) == os.SCHED_FIFO
