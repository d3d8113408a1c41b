"""Builds the camera service from the settings."""

from collections.abc import Mapping
from functools import partial

import cv2

from alight.runtime.node import Node
from alight.runtime.port import Port
from schemas.settings import Settings
from services.camera.calibration_file import configured_calibration
from services.camera.files import FileSource
from services.camera.grabber import Grabber
from services.camera.live_node import PORT as LENS
from services.camera.live_node import LiveCameraNode
from services.camera.opencv_lens import OpenCvLens, checked, name_of
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
    if camera.source in ("device", "stream"):
        return LiveCameraNode(camera.live, calibration, name_of(camera))
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


def open_ports(settings: Settings) -> Mapping[str, Port]:
    """The lens of a camera that is there; none for pictures that are made or played.

    Raises:
        PortError: If the settings of the camera cannot work.
    """
    camera = settings.camera
    if camera.source not in ("device", "stream"):
        return {}
    checked(camera)
    calibration = configured_calibration(camera)
    size = (calibration.width_px, calibration.height_px)
    width_px, height_px = size if camera.live.rotated_deg in (0, 180) else size[::-1]
    by_driver = camera.live.stamp == "driver" and camera.source == "device"
    pause_s = camera.live.longest_pause_s
    lens = partial(OpenCvLens, camera, width_px, height_px)
    return {LENS: Grabber(lens, by_driver=by_driver, longest_pause_s=pause_s)}
