"""What the simulator is made of when it runs as a process."""

from collections.abc import Mapping

from alight.runtime.endpoint import open_endpoint
from alight.runtime.node import Node
from alight.runtime.port import Port
from schemas.settings import Settings
from services.simulator.node import SimulatorNode
from services.simulator.truth_node import TruthNode


def build(settings: Settings) -> Node:
    """The node of the kind that the settings name."""
    if settings.simulator.kind == "mavlink_truth":
        return TruthNode(settings)
    return SimulatorNode(settings)


def open_ports(settings: Settings) -> Mapping[str, Port]:
    """The ports of the node in live mode."""
    simulator = settings.simulator
    if simulator.kind == "mavlink_truth":
        return {"vehicle": open_endpoint(simulator.truth_url)}
    ports = {"vehicle": open_endpoint(simulator.url)}
    if simulator.gcs_url:
        ports["gcs"] = open_endpoint(simulator.gcs_url)
    return ports
