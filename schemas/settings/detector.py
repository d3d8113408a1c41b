"""Settings of the detector service."""

from schemas.settings.section import Section


class DetectorSettings(Section):
    """How markers are found."""
