"""Settings of the filter service."""

from schemas.settings.section import Section


class FilterSettings(Section):
    """How fixes become an estimate."""
