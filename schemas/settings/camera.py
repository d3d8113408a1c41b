"""Settings of the camera service."""

from schemas.settings.section import Section


class CameraSettings(Section):
    """Where frames come from, and the camera's calibration."""
