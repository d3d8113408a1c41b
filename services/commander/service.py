"""How the commander is built and what it opens."""

from collections.abc import Mapping

from alight.runtime.endpoint import open_endpoint
from alight.runtime.node import Node
from alight.runtime.port import Port
from schemas.settings import Settings
from services.commander.node import VEHICLE, CommanderNode


def build(settings: Settings) -> Node:
    """The node."""
    return CommanderNode(settings)


def open_ports(settings: Settings) -> Mapping[str, Port]:
    """The link to the autopilot."""
    return {VEHICLE: open_endpoint(settings.commander.vehicle_url)}
