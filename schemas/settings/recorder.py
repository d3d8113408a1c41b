"""Settings of the recorder service."""

from schemas.settings.section import Section


class RecorderSettings(Section):
    """What is written to the flight's file."""
