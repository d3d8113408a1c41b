"""What can go wrong with a report."""


class ReportError(Exception):
    """A report that cannot be written: one line with the remedy."""
