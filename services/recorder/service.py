"""Puts the recorder together from the settings."""

from collections.abc import Mapping

from alight.runtime.node import Node
from alight.runtime.port import Port
from schemas.settings import Settings
from services.recorder.background import BackgroundFile
from services.recorder.flight_file import FlightFile
from services.recorder.host import Host
from services.recorder.node import Recorder

_BYTES_PER_MB = 1_000_000


def build(settings: Settings) -> Node:
    """The recorder, its file open; it writes at once, and nothing but what it is given, so that a flight in lockstep repeats.

    Raises:
        FlightFileError: If the file cannot be created.
    """
    return Recorder(settings, FlightFile(settings))


def build_live(settings: Settings) -> Node:
    """The same with a thread of its own for the disk, and with the host's name and clocks in the file.

    Raises:
        FlightFileError: If the file cannot be created.
    """
    host = Host()
    limit_bytes = round(settings.recorder.backlog_mb * _BYTES_PER_MB)
    return Recorder(settings, BackgroundFile(FlightFile(settings, host), host, limit_bytes))


def open_ports(settings: Settings) -> Mapping[str, Port]:  # noqa: ARG001
    """The recorder has none."""
    return {}
