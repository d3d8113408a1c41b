"""Puts the filter together from the settings."""

from collections.abc import Mapping

from alight.runtime.node import Node
from alight.runtime.port import Port
from schemas.settings import Settings
from services.filter.node import Filter


def build(settings: Settings) -> Node:
    """The filter."""
    return Filter(settings)


def open_ports(settings: Settings) -> Mapping[str, Port]:  # noqa: ARG001
    """The filter has none."""
    return {}
