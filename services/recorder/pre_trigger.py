"""The seconds before a landing was asked for, kept in memory."""

from collections import deque

from services.recorder.entry import Entry


class PreTriggerRing:
    """The newest entries: no older than a time, no heavier than a limit."""

    def __init__(self, length_ns: int, limit_bytes: int) -> None:
        self._length_ns = length_ns
        self._limit_bytes = limit_bytes
        self._entries: deque[Entry] = deque()
        self._weight_bytes = 0

    def add(self, entry: Entry) -> int:
        """Take one in; how many had to go for it."""
        self._entries.append(entry)
        self._weight_bytes += entry.weight_bytes
        gone = 0
        while self._is_over(entry.logged_at_ns):
            self._weight_bytes -= self._entries.popleft().weight_bytes
            gone += 1
        return gone

    def empty(self) -> list[Entry]:
        """All of them, oldest first; none is left."""
        entries, self._entries, self._weight_bytes = list(self._entries), deque(), 0
        return entries

    def _is_over(self, now_ns: int) -> bool:
        if not self._entries:
            return False
        return self._weight_bytes > self._limit_bytes or self._entries[0].logged_at_ns < now_ns - self._length_ns
