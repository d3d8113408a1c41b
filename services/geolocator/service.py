"""Puts the geolocator together from the settings."""

from collections.abc import Mapping

from alight.runtime.node import Node
from alight.runtime.port import Port
from schemas.settings import Settings
from services.geolocator.node import Geolocator


def build(settings: Settings) -> Node:
    """The geolocator."""
    return Geolocator(settings)


def open_ports(settings: Settings) -> Mapping[str, Port]:  # noqa: ARG001
    """The geolocator has none."""
    return {}
