"""Writes down what a node is given, so that a replay can give it the same again."""

from base64 import b64encode
from collections.abc import Iterator
from typing import Any

from alight.runtime.node import Arrival, Node, Publication
from schemas import topics
from schemas.journal import EntryKind, Journal, JournalEntry

PERIOD_NS = 250_000_000
"""A journal is published this often: what a crash of the service keeps from the recording at most."""
MOST_ENTRIES = 10_000
"""What waits at most; a node that is given more in one period is flooded, and its journal says so by a gap in `number`."""

MOST_BYTES = 200_000
"""Length of one journal at most: the wire refuses what is not much longer."""
ENTRY_BYTES = 250
"""What an entry without bytes takes, about."""


class JournalKeeper:
    """Keeps the journal of one node; of a node whose service publishes none it keeps nothing."""

    def __init__(self, node: Node, now_ns: int) -> None:
        self._service = node.service
        self._kept = node.service in topics.JOURNAL.publishers
        self._started_at_ns = now_ns
        self._due_ns = now_ns + PERIOD_NS
        self._number = 0
        self._entries: list[JournalEntry] = []

    def keep_nothing(self) -> None:
        """Keep no journal: there is nobody to read it."""
        self._kept = False

    def message(self, arrival: Arrival[Any]) -> None:
        """The node is about to be given a message."""
        if not self._kept:
            return
        self._note(
            kind=EntryKind.MESSAGE,
            source=arrival.topic.name,
            stamp_ns=arrival.message.stamp_ns,
            received_at_ns=arrival.received_at_ns,
            now_ns=arrival.now_ns,
        )

    def tick(self, now_ns: int) -> None:
        """The node is about to be told the time."""
        if not self._kept:
            return
        self._note(kind=EntryKind.TICK, received_at_ns=now_ns, now_ns=now_ns)

    def bytes(self, port: str, data: bytes, now_ns: int) -> None:
        """The node is about to be given bytes."""
        if self._kept:
            text = b64encode(data).decode()
            self._note(kind=EntryKind.BYTES, source=port, received_at_ns=now_ns, now_ns=now_ns, data=text)

    def is_due(self, now_ns: int) -> bool:
        """Whether it is time for a journal."""
        # A clock set back must not silence the journal.
        return bool(self._entries) and (now_ns >= self._due_ns or self._due_ns - now_ns > 2 * PERIOD_NS)

    def rest(self, now_ns: int) -> list[Publication]:
        """The journal of what was not published yet, in several where it is long; nothing if there is nothing."""
        self._due_ns = now_ns + PERIOD_NS
        entries, self._entries = self._entries, []
        return [Publication(topics.JOURNAL, self._journal(portion, now_ns)) for portion in _portions(entries)]

    def _journal(self, entries: list[JournalEntry], now_ns: int) -> Journal:
        number, self._number = self._number, self._number + 1
        return Journal(
            at_ns=now_ns,
            service=self._service,
            started_at_ns=self._started_at_ns,
            number=number,
            entries=tuple(entries),
        )

    def _note(self, **fields: Any) -> None:
        if len(self._entries) >= MOST_ENTRIES:
            self._entries = []
            self._number += 1
        self._entries.append(JournalEntry.model_construct(**fields))


def _portions(entries: list[JournalEntry]) -> Iterator[list[JournalEntry]]:
    portion: list[JournalEntry] = []
    length = 0
    for entry in entries:
        weight = ENTRY_BYTES + len(entry.data)
        if portion and length + weight > MOST_BYTES:
            yield portion
            portion, length = [], 0
        portion.append(entry)
        length += weight
    if portion:
        yield portion
