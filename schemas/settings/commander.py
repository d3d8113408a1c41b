"""Settings of the commander service."""

from schemas.settings.section import Section


class CommanderSettings(Section):
    """How the vehicle is brought down, and when it is not."""
