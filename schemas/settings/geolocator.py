"""Settings of the geolocator service."""

from schemas.settings.section import Section


class GeolocatorSettings(Section):
    """How a detection becomes a place on the earth."""
