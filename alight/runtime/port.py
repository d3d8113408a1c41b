"""A port: the edge where a node's bytes meet the world (a UDP socket, a serial line, a pipe)."""

from collections.abc import Callable
from typing import Protocol


class Port(Protocol):
    """Carries bytes. `deliver` may be called from a thread of the port's own."""

    def open(self, deliver: Callable[[bytes], None]) -> None:
        """Begin; hand every received chunk to `deliver`.

        Raises:
            PortError: If it cannot be had (busy, no such device), in one line with the remedy.
        """
        ...

    def send(self, data: bytes) -> None:
        """Send; what cannot be sent now is lost, as on any radio link."""
        ...

    def close(self) -> None:
        """Let go."""
        ...


class PortError(Exception):
    """A port that cannot be opened."""
