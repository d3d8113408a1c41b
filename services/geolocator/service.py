"""Puts the geolocator together from the settings."""

from collections.abc import Mapping

from alight.runtime.node import Node
from alight.runtime.port import Port
from schemas.settings import Settings
from services.geolocator.correction_file import configured_correction
from services.geolocator.node import Geolocator


def build(settings: Settings) -> Node:
    """The geolocator.

    Raises:
        CorrectionFileError: In one line, if the correction's file cannot be used.
    """
    correction = configured_correction(settings.geolocator)
    geolocator = settings.geolocator.model_copy(update={"correction": correction})
    return Geolocator(settings.model_copy(update={"geolocator": geolocator}))


def open_ports(settings: Settings) -> Mapping[str, Port]:  # noqa: ARG001
    """The geolocator has none."""
    return {}
