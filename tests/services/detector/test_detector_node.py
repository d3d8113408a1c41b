import numpy as np
import pytest

from alight.runtime.node import Arrival
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.frame import FrameHeader, PixelFormat
from schemas.message import Hop
from schemas.settings import Settings
from services.camera.calibration_file import configured_calibration
from services.detector.service import build

HOP = Hop(service="camera", received_at_ns=1, handled_at_ns=2, published_at_ns=3)


def calibration_arrival(**changes: object) -> Arrival[CameraCalibration]:
    calibration = configured_calibration(Settings().camera).model_copy(update=changes)
    return Arrival(topics.CALIBRATION, calibration, received_at_ns=1, now_ns=1)


def frame_arrival(picture: np.ndarray, sequence: int = 0) -> Arrival[FrameHeader]:
    header = FrameHeader(
        captured_at_ns=1_000_000_000 + sequence,
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
