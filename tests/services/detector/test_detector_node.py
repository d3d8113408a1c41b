from itertools import pairwise

import numpy as np
import pytest

from alight.runtime.node import Arrival
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.frame import FrameHeader, PixelFormat
from schemas.message import Hop
from schemas.settings import Settings
from schemas.vehicle import LandedState, VehicleStatus
from services.camera.calibration_file import configured_calibration
from services.detector.service import build

HOP = Hop(service="camera", received_at_ns=1, handled_at_ns=2, published_at_ns=3)


def calibration_arrival(**changes: object) -> Arrival[CameraCalibration]:
    calibration = configured_calibration(Settings().camera).model_copy(update=changes)
    return Arrival(topics.CALIBRATION, calibration, received_at_ns=1, now_ns=1)


def frame_arrival(picture: np.ndarray, sequence: int = 0, at_ns: int | None = None) -> Arrival[FrameHeader]:
    header = FrameHeader(
        captured_at_ns=1_000_000_000 + sequence if at_ns is None else at_ns,
        hops=(HOP,),
        sequence=sequence,
        width_px=picture.shape[1],
        height_px=picture.shape[0],
        pixel_format=PixelFormat.BGR8 if picture.ndim == 3 else PixelFormat.MONO8,
        source="test",
    )
    return Arrival(topics.FRAME, header, received_at_ns=1, now_ns=1, pixels=picture)


def detection_of(node, picture, sequence=0):
    (publication,) = node.on_message(frame_arrival(picture, sequence))
    assert publication.topic is topics.DETECTION
    return publication.message


@pytest.fixture
def node():
    node = build(Settings())
    node.on_message(calibration_arrival())
    return node


def test_a_detection_carries_the_frames_time_number_and_hops(node, studio) -> None:
    detection = detection_of(node, studio.shoot(0.0, 0.0, -6.0).picture, sequence=7)
    assert (detection.captured_at_ns, detection.frame_sequence, detection.hops) == (1_000_000_007, 7, (HOP,))
    assert detection.detector == "aided"
    (marker,) = detection.markers
    assert (marker.family, marker.id, marker.side_m) == ("5x5_1000", 68, 1.0)


def test_a_frame_without_a_marker_makes_an_empty_detection(node) -> None:
    assert detection_of(node, np.full((480, 640), 90, np.uint8)).markers == ()
    assert node.complaints(0) == ()


def test_a_colour_frame_is_as_good_as_a_grey_one(node, studio) -> None:
    grey = studio.shoot(0.0, 0.0, -6.0).picture
    assert len(detection_of(node, np.repeat(grey[..., None], 3, axis=2)).markers) == 1


def test_without_a_calibration_detections_are_empty_and_the_reason_is_told(studio) -> None:
    node = build(Settings())
    assert detection_of(node, studio.shoot(0.0, 0.0, -6.0).picture).markers == ()
    assert "no camera calibration has come yet" in node.complaints(0)[0]
    assert node.counters()["frames_without_calibration"] == 1


def test_a_calibration_for_another_size_locates_nothing_and_the_reason_is_told(node, studio) -> None:
    node.on_message(calibration_arrival(width_px=1280, height_px=960))
    assert detection_of(node, studio.shoot(0.0, 0.0, -6.0).picture).markers == ()
    assert "frames are 640x480, the calibration is for 1280x960" in node.complaints(0)[0]
    node.on_message(calibration_arrival())
    assert len(detection_of(node, studio.shoot(0.0, 0.0, -6.0).picture, 1).markers) == 1
    assert node.complaints(0) == ()


def test_a_lens_model_without_an_inverse_locates_nothing(node, studio) -> None:
    node.on_message(calibration_arrival(distortion=(-90.0, 0.0, 0.0, 0.0, 0.0)))
    assert detection_of(node, studio.shoot(2.0, 2.0, -6.0).picture).markers == ()


def looked_at(node, landed_state: LandedState, told_at_s: float, seconds: float = 2.0, rate_hz: int = 50) -> list[int]:
    """Which frames of a camera are looked at after the autopilot has said where the vehicle is, by number."""
    status = VehicleStatus(at_ns=round(told_at_s * 1e9), connected=True, landed_state=landed_state)
    node.on_message(Arrival(topics.VEHICLE_STATUS, status, received_at_ns=1, now_ns=1))
    picture = np.full((480, 640), 90, np.uint8)
    times_ns = [10_000_000_000 + number * 1_000_000_000 // rate_hz for number in range(round(seconds * rate_hz))]
    arrivals = [frame_arrival(picture, number, at_ns) for number, at_ns in enumerate(times_ns)]
    return [arrival.message.sequence for arrival in arrivals if list(node.on_message(arrival))]


def test_on_the_ground_it_looks_a_few_times_a_second_and_in_the_air_always(node) -> None:
    on_ground = looked_at(node, LandedState.ON_GROUND, told_at_s=10.0)
    assert {later - earlier for earlier, later in pairwise(on_ground)} == {10}
    assert node.counters()["frames_left_out"] == 100 - len(on_ground)
    assert len(looked_at(node, LandedState.IN_AIR, told_at_s=10.0)) == 100


def test_an_autopilot_that_fell_silent_on_the_ground_lets_it_look_at_every_frame(node) -> None:
    assert len(looked_at(node, LandedState.ON_GROUND, told_at_s=7.0)) == 100


@pytest.mark.parametrize(
    ("section", "says"),
    [
        ({"detector": {"backend": "arucoo"}}, "no detector 'arucoo': there are: aided, apriltag, aruco, charuco"),
        ({"pad": {"family": "5x6"}}, "no marker family '5x6'"),
    ],
)
def test_a_detector_or_family_that_does_not_exist_stops_the_service(section, says) -> None:
    with pytest.raises(ValueError, match=says):
        build(Settings.model_validate(section))
