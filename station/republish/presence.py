"""Who lives on the bus."""


class Presence:
    """The services whose liveliness tokens are on the bus; `note` may be called from any one thread."""

    def __init__(self) -> None:
        self.services: frozenset[str] = frozenset()
        """Replaced as a whole, never changed, so that it can be read while it is noted in another thread."""

    def note(self, service: str, alive: bool) -> None:
        """A token appeared or vanished."""
        self.services = self.services | {service} if alive else self.services - {service}
