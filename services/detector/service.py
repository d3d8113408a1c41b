"""Builds the detector service from the settings."""

from collections.abc import Mapping

import cv2

from alight.runtime.node import Node
from alight.runtime.port import Port
from schemas.settings import Settings
from services.detector.node import DetectorNode
from services.detector.registry import detector_from


def build(settings: Settings) -> Node:
    """The detector's node.

    Raises:
        ValueError: In one line, if detector or marker family do not exist.
    """
    cv2.setNumThreads(1)  # one core: more would take it from the services beside, and sums would depend on their number
    return DetectorNode(settings, detector_from(settings))


def open_ports(settings: Settings) -> Mapping[str, Port]:  # noqa: ARG001
    """The detector has no byte ports."""
    return {}
