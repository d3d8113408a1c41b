"""Whom a port hears and answers when anybody may write to it."""

import logging
from typing import NamedTuple

from alight.runtime.clock import nanoseconds

LOGGER = logging.getLogger("alight")
SILENT_AFTER_S = 2.0
"""Whoever has said nothing for longer is gone: an autopilot is never silent for that long, and one that starts anew may write from
another port."""


class Address(NamedTuple):
    """Where a datagram came from."""

    host: str
    port: int


class Correspondent:
    """The first who writes, until he has been silent for `SILENT_AFTER_S`.

    What others write meanwhile is for nobody: to answer the last one would let a single stray datagram divert the commands, and two
    autopilots mixed in one stream would be taken for one that jumps.
    """

    def __init__(self) -> None:
        self.address: Address | None = None
        """Who is answered; None before anybody has written."""
        self.dropped = 0
        """Datagrams of others."""
        self._heard_ns = 0
        self._named: Address | None = None

    def admits(self, sender: Address, now_ns: int) -> bool:
        """Whether a datagram that comes now is to be taken.

        Args:
            sender: Where it came from.
            now_ns: The time on a clock that nobody sets, ns.
        """
        if sender != self.address:
            if self.address is not None and now_ns - self._heard_ns <= nanoseconds(SILENT_AFTER_S):
                self._drop(sender)
                return False
            LOGGER.info("sender answered", extra={"sender": _text(sender)})
            self.address, self._named = sender, None
        self._heard_ns = now_ns
        return True

    def _drop(self, sender: Address) -> None:
        self.dropped += 1
        if sender != self._named and self.address is not None:
            # Once, not once a datagram: whoever is wrong here goes on being wrong.
            self._named = sender
            LOGGER.warning(
                "datagrams of another sender dropped",
                extra={"sender": _text(sender), "answered": _text(self.address)},
            )


def _text(address: Address) -> str:
    return f"{address.host}:{address.port}"
