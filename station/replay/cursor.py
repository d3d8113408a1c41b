"""One node of a replay: the node itself, and how far it has got through what it is given."""

import heapq
import importlib
from collections import Counter
from collections.abc import Sequence

from alight.runtime.node import Node
from schemas import topics
from schemas.journal import EntryKind, JournalEntry
from schemas.settings import Settings
from schemas.topics import Delivery
from station.replay.life import Life
from station.replay.result import Origin


class Cursor:
    """Goes through the lives of one service; each begins with a node that is built anew."""

    def __init__(self, service: str, rank: int, lives: Sequence[Life], settings: Settings) -> None:
        """Begin before the first life.

        Args:
            service: The service.
            rank: Breaks ties of time between services: causes first.
            lives: What it was given; without any it is given only what the other replayed nodes publish.
            settings: What its nodes are built with.
        """
        self.service = service
        self.rank = rank
        self.given: list[list[JournalEntry]] = [[]]
        """What was given, by life."""
        self.newest: dict[str, tuple[int, Origin]] = {}
        self.lacked = False
        """Whether the node of this life was given something in flight that the recording has not: it may remember it."""
        self.failures: Counter[str] = Counter()
        self.life: Life | None = lives[0] if lives else None
        self.node = build(service, settings)
        self._lives = lives
        self._settings = settings
        self._life_number = 0
        self._position = 0
        self._extra: list[tuple[int, int, JournalEntry]] = []
        self._added = 0
        self._named: Counter[tuple[str, int]] = Counter()

    def peek(self) -> JournalEntry | None:
        """What the node is given next; None at the end."""
        own = self._own()
        if self._extra and (own is None or self._extra[0][0] < own.now_ns):
            return self._extra[0][2]
        return own

    def take(self) -> tuple[JournalEntry, int]:
        """Go on by one entry; it, and how often its topic and stamp were named before (events may share a stamp)."""
        own = self._own()
        if self._extra and (own is None or self._extra[0][0] < own.now_ns):
            entry = heapq.heappop(self._extra)[2]
        else:
            assert own is not None
            entry = own
            self._begin_life_if_due()
            self._position += 1
        number = self._named[entry.source, entry.stamp_ns] if entry.kind is EntryKind.MESSAGE else 0
        if entry.kind is EntryKind.MESSAGE:
            self._named[entry.source, entry.stamp_ns] += 1
        return entry, number

    def add(self, entry: JournalEntry) -> None:
        """Give the node something that it was not given in flight, when its time comes."""
        heapq.heappush(self._extra, (entry.now_ns, self._added, entry))
        self._added += 1

    def admits(self, entry: JournalEntry) -> bool:
        """Whether an added message comes in order, as the gate before the node demands."""
        newest_ns, _ = self.newest.get(entry.source, (-1, Origin.RECORDED))
        return topics.BY_NAME[entry.source].delivery is Delivery.EVENT or entry.stamp_ns > newest_ns

    def note(self, entry: JournalEntry, origin: Origin) -> None:
        """Remember what the node is given, or what it would be given if the recording had it."""
        self.given[-1].append(entry)
        self.lacked = self.lacked or origin is Origin.STAND_IN
        if origin is not Origin.STAND_IN and entry.kind is EntryKind.MESSAGE:
            self.newest[entry.source] = (entry.stamp_ns, origin)

    def _own(self) -> JournalEntry | None:
        number, position = self._life_number, self._position
        while number < len(self._lives):
            if position < len(self._lives[number].entries):
                return self._lives[number].entries[position]
            number, position = number + 1, 0
        return None

    def _begin_life_if_due(self) -> None:
        assert self.life is not None
        while self._position >= len(self.life.entries):
            self._life_number, self._position = self._life_number + 1, 0
            self.life = self._lives[self._life_number]
            self.node = build(self.service, self._settings)
            self.newest, self.lacked = {}, False
            self.given.append([])


def build(service: str, settings: Settings) -> Node:
    """A service's node.

    Raises:
        ValueError: If the settings are at fault.
    """
    node: Node = importlib.import_module(f"services.{service}.service").build(settings)
    return node
