"""The detector's node: a detection for every frame that it looks at, with markers or without.

It looks at every frame, but on the ground only at some: a pad between the legs is the dearest picture to search, a vehicle that
stands goes nowhere, and what the search leaves of the cores is the recorder's.
"""

from collections.abc import Mapping
from typing import ClassVar

import cv2
import numpy as np

from alight.geometry.camera import PinholeCamera
from alight.markers.layout import layout_from
from alight.runtime.clock import nanoseconds
from alight.runtime.node import Arrival, Node, Outputs, Pixels, Publication
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.detection import Detection, Marker
from schemas.estimate import PadEstimate
from schemas.frame import FrameHeader
from schemas.settings import Settings
from schemas.vehicle import GimbalState, VehicleState, VehicleStatus
from services.detector.board_pose import pad_view, said_once
from services.detector.detector import Detector, FoundMarker, View
from services.detector.prior import PriorKeeper
from services.detector.square_pose import located

_MOST_MARKERS = 256
_LOOK_ON_GROUND_NS = nanoseconds(0.2)
"""Well within the time after which who reads detections calls them stale."""


class DetectorNode(Node):
    """Takes frames and the calibration. Without a calibration that fits the frames it publishes empty detections and says why."""

    service: ClassVar[str] = "detector"
    answers_at_once = True

    def __init__(self, settings: Settings, detector: Detector) -> None:
        """Take the detector to use."""
        super().__init__()
        self._detector = detector
        self._layout = layout_from(settings.pad)
        self._prior = PriorKeeper(settings.geolocator.mount)
        self._camera: PinholeCamera | None = None
        self._row_time_s = 0.0
        self._complaint = ""
        self._looked_at_ns: int | None = None
        self._counts = {"frames": 0, "frames_with_markers": 0, "frames_without_calibration": 0, "frames_left_out": 0}
        self.subscribe(topics.FRAME, self._on_frame)
        self.subscribe(topics.CALIBRATION, self._on_calibration)
        self.subscribe(topics.VEHICLE_STATE, self._on_vehicle_state)
        self.subscribe(topics.VEHICLE_STATUS, self._on_vehicle_status)
        self.subscribe(topics.GIMBAL_STATE, self._on_gimbal_state)
        self.subscribe(topics.PAD_ESTIMATE, self._on_pad_estimate)

    def _on_calibration(self, arrival: Arrival[CameraCalibration]) -> Outputs:
        self._camera = PinholeCamera.from_calibration(arrival.message)
        self._row_time_s = arrival.message.row_time_s
        return ()

    def _on_vehicle_state(self, arrival: Arrival[VehicleState]) -> Outputs:
        self._prior.add_state(arrival.message)
        return ()

    def _on_vehicle_status(self, arrival: Arrival[VehicleStatus]) -> Outputs:
        self._prior.add_status(arrival.message)
        return ()

    def _on_gimbal_state(self, arrival: Arrival[GimbalState]) -> Outputs:
        self._prior.add_gimbal(arrival.message)
        return ()

    def _on_pad_estimate(self, arrival: Arrival[PadEstimate]) -> Outputs:
        self._prior.add_estimate(arrival.message)
        return ()

    def _on_frame(self, arrival: Arrival[FrameHeader]) -> Outputs:
        frame = arrival.message
        self._counts["frames"] += 1
        if self._may_rest(frame.captured_at_ns):
            self._counts["frames_left_out"] += 1
            return []
        self._looked_at_ns = frame.captured_at_ns
        self._complaint = self._unfit(frame)
        markers: tuple[Marker, ...] = ()
        if self._complaint:
            self._counts["frames_without_calibration"] += 1
        elif arrival.pixels is not None:
            markers = self._markers(grey(arrival.pixels), frame.captured_at_ns)
        self._counts["frames_with_markers"] += bool(markers)
        pad = pad_view(markers, self._layout, self._camera) if self._camera and markers else None
        detection = Detection(
            captured_at_ns=frame.captured_at_ns,
            hops=frame.hops,
            frame_sequence=frame.sequence,
            detector=self._detector.name,
            markers=said_once(markers, pad) if pad else markers,
            pad=pad,
        )
        return [Publication(topics.DETECTION, detection)]

    def _may_rest(self, captured_at_ns: int) -> bool:
        """Whether the vehicle stands on the ground and was looked from a moment ago."""
        if self._looked_at_ns is None or not self._prior.stands_at(captured_at_ns):
            return False
        return 0 <= captured_at_ns - self._looked_at_ns < _LOOK_ON_GROUND_NS

    def _unfit(self, frame: FrameHeader) -> str:
        """Why poses cannot be had from this frame; empty if they can."""
        if self._camera is None:
            return "no camera calibration has come yet: markers cannot be located"
        believed = (self._camera.width_px, self._camera.height_px)
        if (frame.width_px, frame.height_px) != believed:
            return (
                f"frames are {frame.width_px}x{frame.height_px}, the calibration is for {believed[0]}x{believed[1]}: "
                "give the camera a calibration of its own"
            )
        return ""

    def _markers(self, picture: Pixels, captured_at_ns: int) -> tuple[Marker, ...]:
        """All markers seen. The size of markers that are not on the pad is not known: that of its largest is assumed."""
        if self._camera is None:
            return ()
        prior = self._prior.at(captured_at_ns, self._camera)
        found = self._detector.detect(View(picture, captured_at_ns, self._camera, prior))
        markers = (
            located(marker, self._side_m(marker), self._camera, self._row_time_s) for marker in found[:_MOST_MARKERS]
        )
        return tuple(marker for marker in markers if marker is not None)

    def _side_m(self, marker: FoundMarker) -> float:
        return (self._layout.find(marker.family, marker.id) or self._layout.markers[0]).side_m

    def counters(self) -> Mapping[str, int]:
        """Frames by outcome, and the detector's own."""
        return {**self._counts, **self._detector.counters()}

    def complaints(self, now_ns: int) -> tuple[str, ...]:  # noqa: ARG002
        """That a calibration is missing or does not fit."""
        return (self._complaint,) if self._complaint else ()


def grey(pixels: Pixels) -> Pixels:
    """A picture in grey levels, whatever it was; (height, width)."""
    if pixels.ndim == 2:
        return pixels
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY), np.uint8)
