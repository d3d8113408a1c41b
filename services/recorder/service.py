"""Puts the recorder together from the settings."""

from collections.abc import Mapping

from alight.runtime.node import Node
from alight.runtime.port import Port
from schemas.settings import Settings
from services.recorder.flight_file import FlightFile
from services.recorder.node import Recorder


def build(settings: Settings) -> Node:
    """The recorder, its file open.

    Raises:
        FlightFileError: If the file cannot be created.
    """
    return Recorder(settings, FlightFile(settings))


def open_ports(settings: Settings) -> Mapping[str, Port]:  # noqa: ARG001
    """The recorder has none."""
    return {}
