"""Looks for garbage when there is time for it, not when a message is being handled.

Python looks after so and so many allocations, which are made while a message is handled. Almost nothing is found then, since what
nobody refers to goes at once anyway; only rings of objects wait to be found. The looking comes in the way of the message, and
leaves the caches to the next one full of what it looked at.
"""

import gc

from alight.runtime.clock import NS_PER_S

PERIOD_NS = NS_PER_S
"""Rings come from exceptions and the like: a few kilobytes a second at worst."""

LONGEST_NS = 10 * NS_PER_S
"""A node that is never quiet collects so often all the same."""


class GarbageCollection:
    """Where Python does not collect by itself any more (`begin`), a collection in a quiet moment once a second."""

    def __init__(self) -> None:
        self._collected_ns = 0

    @staticmethod
    def begin() -> None:
        """From here on collections are made by `collect` alone. What is left of the start is not looked through again."""
        gc.collect()
        gc.freeze()
        gc.disable()

    def collect(self, now_ns: int, *, quiet: bool) -> None:
        """Collect, if it is time; nothing where Python does it by itself.

        Args:
            now_ns: The time, ns; one that is set back delays nothing.
            quiet: Whether nothing waits to be done.
        """
        period_ns = PERIOD_NS if quiet else LONGEST_NS
        if gc.isenabled() or abs(now_ns - self._collected_ns) < period_ns:
            return
        self._collected_ns = now_ns
        gc.collect()
