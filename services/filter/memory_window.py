"""The paper's window with memory (Section 3.1.3 and Algorithm 1)."""

from collections.abc import Callable

from alight.runtime.clock import nanoseconds
from schemas.settings.filter import FilterMethod
from services.filter.averaging import averaged
from services.filter.entry import Entry


class MemoryWindow:
    """Windows that do not overlap: each is averaged when full, cleared, and begun with its result.

    So the past keeps the weight 1/L. Algorithm 1 instead releases at a rate, from whatever the window holds if that is
    enough; a window that is full before it is time drops its oldest fix for each new one, and keeps the memory.
    """

    def __init__(self, settings: FilterMethod) -> None:
        self._method = settings.method
        self._length = 1 if settings.method == "none" else settings.window_length
        self._period_ns = nanoseconds(1.0 / settings.rate_hz) if settings.rate_hz > 0.0 else 0
        enough = settings.min_entries if self._period_ns and settings.min_entries else self._length
        self._enough = min(enough, self._length)
        self._memory: Entry | None = None
        self._fixes: list[Entry] = []
        self._released_at_ns: int | None = None

    def __len__(self) -> int:
        """How many entries it holds, the memory included."""
        return len(self._entries)

    @property
    def _entries(self) -> list[Entry]:
        return self._fixes if self._memory is None else [self._memory, *self._fixes]

    def clear(self) -> None:
        """Forget all entries and the memory; the rate stays limited."""
        self._memory = None
        self._fixes = []

    def add(self, entry: Entry) -> None:
        """Take a fix in."""
        self._fixes.append(entry)
        if len(self) > self._length:
            del self._fixes[0]

    @property
    def holds_enough(self) -> bool:
        """Whether it holds enough entries for a result, with at least one fix among them."""
        return bool(self._fixes) and len(self) >= self._enough

    def centre(self) -> Entry:
        """The median of what it holds, whatever the method.

        Raises:
            ValueError: If that is no place on the earth.
        """
        return averaged(self._entries, "median")

    def keep(self, wanted: Callable[[Entry], bool]) -> int:
        """Drop the fixes that are not wanted; returns how many."""
        before = len(self._fixes)
        self._fixes = [entry for entry in self._fixes if wanted(entry)]
        return before - len(self._fixes)

    def release(self, captured_at_ns: int) -> tuple[Entry, int] | None:
        """The result and the number of entries in it, if the window holds enough and it is time.

        Args:
            captured_at_ns: Capture time of the newest fix, UTC ns: the rate is judged by it.

        Raises:
            ValueError: If the average is no place on the earth; the window is then cleared.
        """
        early = self._released_at_ns is not None and captured_at_ns - self._released_at_ns < self._period_ns
        if early or not self.holds_enough:
            return None
        entries = self._entries
        self.clear()
        result = averaged(entries, self._method)
        self._released_at_ns = captured_at_ns
        self._memory = None if self._method == "none" else result
        return result, len(entries)
