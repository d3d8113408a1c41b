"""Writes down what a node is given, so that a replay can give it the same again."""

from base64 import b64encode
from typing import Any

from alight.runtime.node import Arrival, Node, Publication
from schemas import topics
from schemas.journal import EntryKind, Journal, JournalEntry

PERIOD_NS = 250_000_000
"""A journal is published this often: what a crash of the service keeps from the recording at most."""
MOST_ENTRIES = 10_000
"""What waits at most; a node that is given more in one period is flooded, and its journal says so by a gap in `number`."""


class JournalKeeper:
    """Keeps the journal of one node; of a node whose service publishes none it keeps nothing."""

    def __init__(self, node: Node, now_ns: int) -> None:
        self._service = node.service
        self._kept = node.service in topics.JOURNAL.publishers
        self._started_at_ns = now_ns
        self._due_ns = now_ns + PERIOD_NS
        self._number = 0
        self._entries: list[JournalEntry] = []

    def message(self, arrival: Arrival[Any]) -> None:
        """The node is about to be given a message."""
        self._note(
            kind=EntryKind.MESSAGE,
            source=arrival.topic.name,
            stamp_ns=arrival.message.stamp_ns,
            received_at_ns=arrival.received_at_ns,
            now_ns=arrival.now_ns,
        )

    def tick(self, now_ns: int) -> None:
        """The node is about to be told the time."""
        self._note(kind=EntryKind.TICK, received_at_ns=now_ns, now_ns=now_ns)

    def bytes(self, port: str, data: bytes, now_ns: int) -> None:
        """The node is about to be given bytes."""
        if self._kept:
            text = b64encode(data).decode()
            self._note(kind=EntryKind.BYTES, source=port, received_at_ns=now_ns, now_ns=now_ns, data=text)

    def due(self, now_ns: int) -> list[Publication]:
        """The journal, when it is time for one."""
        # A clock set back must not silence the journal.
        if now_ns < self._due_ns and self._due_ns - now_ns <= 2 * PERIOD_NS:
            return []
        self._due_ns = now_ns + PERIOD_NS
        return self.rest(now_ns)

    def rest(self, now_ns: int) -> list[Publication]:
        """The journal of what was not published yet; nothing if there is nothing."""
        if not self._entries:
            return []
        journal = Journal(
            at_ns=now_ns,
            service=self._service,
            started_at_ns=self._started_at_ns,
            number=self._number,
            entries=tuple(self._entries),
        )
        self._number += 1
        self._entries = []
        return [Publication(topics.JOURNAL, journal)]

    def _note(self, **fields: Any) -> None:
        if not self._kept:
            return
        if len(self._entries) >= MOST_ENTRIES:
            self._entries = []
            self._number += 1
        self._entries.append(JournalEntry.model_construct(**fields))
