"""Whom a port hears and answers when anybody may write to it."""

import logging
from collections import Counter
from typing import NamedTuple

from alight.runtime.clock import nanoseconds

LOGGER = logging.getLogger("alight")
SILENT_AFTER_S = 2.0
"""Whoever has said nothing for longer is gone: an autopilot is never silent for that long, and one that starts anew may write from
another port."""
CHATTIER = 10
FEWEST = 20
"""Who writes ten times as often within that time, and so many datagrams, takes the place: a ground station's heartbeats may have come first."""
_MOST_STRANGERS = 16


class Address(NamedTuple):
    """Where a datagram came from."""

    host: str
    port: int


class Correspondent:
    """The first who writes, until he has been silent for `SILENT_AFTER_S`, or another one has written far more for as long.

    What others write meanwhile is for nobody: to answer the last one would let a single stray datagram divert the commands, and two
    autopilots mixed in one stream would be taken for one that jumps.
    """

    def __init__(self) -> None:
        self.address: Address | None = None
        """Who is answered; None before anybody has written."""
        self.dropped = 0
        """Datagrams of others."""
        self._heard_ns = 0
        self._counts: Counter[Address] = Counter()
        self._counted_since_ns = 0
        self._named: set[Address] = set()

    def admits(self, sender: Address, now_ns: int) -> bool:
        """Whether a datagram that comes now is to be taken.

        Args:
            sender: Where it came from.
            now_ns: The time on a clock that nobody sets, ns.
        """
        takes_over = self._counts_for_more(sender, now_ns)
        if sender != self.address:
            speaks = self.address is not None and now_ns - self._heard_ns <= nanoseconds(SILENT_AFTER_S)
            if speaks and not takes_over:
                self._drop(sender)
                return False
            LOGGER.info("sender answered", extra={"sender": _text(sender)})
            self.address = sender
            self._named.clear()
        self._heard_ns = now_ns
        return True

    def _counts_for_more(self, sender: Address, now_ns: int) -> bool:
        """Count, and judge once every `SILENT_AFTER_S`."""
        if len(self._counts) < _MOST_STRANGERS or sender in self._counts:
            self._counts[sender] += 1
        if now_ns - self._counted_since_ns <= nanoseconds(SILENT_AFTER_S):
            return False
        held = 0 if self.address is None else self._counts[self.address]
        more = self._counts[sender] >= max(FEWEST, CHATTIER * held)
        self._counts.clear()
        self._counted_since_ns = now_ns
        return more

    def _drop(self, sender: Address) -> None:
        self.dropped += 1
        if self.address is not None and sender not in self._named and len(self._named) < _MOST_STRANGERS:
            # Once, not once a datagram: whoever is wrong here goes on being wrong.
            self._named.add(sender)
            LOGGER.warning(
                "datagrams of another sender dropped",
                extra={"sender": _text(sender), "answered": _text(self.address)},
            )


def _text(address: Address) -> str:
    return f"{address.host}:{address.port}"
