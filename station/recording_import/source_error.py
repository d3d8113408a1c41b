"""What is wrong with what was given to be imported."""


class SourceError(ValueError):
    """A log, a video or stamps that cannot be imported: which file, why, and what to do. One line."""
