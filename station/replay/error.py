"""What ends a replay before it begins."""


class ReplayError(ValueError):
    """A flight that cannot be replayed as asked: one line with the reason and the remedy."""
