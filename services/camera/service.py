"""Builds the camera service from the settings."""

from collections.abc import Mapping

import cv2

from alight.runtime.node import Node
from alight.runtime.port import Port
from schemas.settings import Settings
from services.camera.calibration_file import configured_calibration
from services.camera.files import FileSource
from services.camera.played_node import PlayedCameraNode
from services.camera.simulated_node import SimulatedCameraNode


def build(settings: Settings) -> Node:
    """The camera's node.

    Raises:
        ValueError: In one line, if calibration, files or the pad's marker cannot be had.
    """
    cv2.setNumThreads(1)  # one core: more would take it from the services beside, and sums would depend on their number
    camera = settings.camera
    calibration = configured_calibration(camera)
    if camera.source == "simulated":
        return SimulatedCameraNode(settings, calibration)
    source = FileSource(camera.files.paths, loop=camera.files.loop, mirrored=camera.files.mirrored)
    return PlayedCameraNode(source, calibration, camera.rate_hz)


def build_live(settings: Settings) -> Node:
    """The same node, ready for frames that have to be in time.

    Raises:
        ValueError: See `build`.
    """
    node = build(settings)
    if isinstance(node, SimulatedCameraNode):
        node.prepare()
    return node


def open_ports(settings: Settings) -> Mapping[str, Port]:  # noqa: ARG001
    """The camera has no byte ports."""
    return {}
