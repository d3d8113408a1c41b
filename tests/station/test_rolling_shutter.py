"""A rolling shutter through camera, detector and geolocator: the pad is where its own rows saw it."""

import math

import numpy as np
import pytest

from alight.geometry.camera import PinholeCamera
from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.rotation import quaternion_from_euler, quaternion_from_rotation_vector, quaternion_multiply
from alight.markers.family import dictionary
from alight.runtime.node import Arrival
from schemas import topics
from schemas.fix import FixVerdict
from schemas.frame import FrameHeader
from schemas.message import GlobalPosition
from schemas.settings import Settings
from schemas.truth import GroundTruth
from schemas.vehicle import VehicleState
from services.camera.calibration_file import configured_calibration
from services.camera.simulated_camera import SimulatedCamera
from services.camera.viewpoint import Viewpoint
from services.detector.aruco import ArucoBackend
from services.detector.detector import View
from services.detector.service import build as build_detector
from services.detector.square_pose import square_points_m
from services.geolocator.service import build as build_geolocator

ROW_TIME_S = 50e-6
"""24 ms from the first of 480 rows to the last: a slow, ordinary sensor."""
PAD = GlobalPosition(latitude_deg=47.4, longitude_deg=8.5, altitude_amsl_m=500.0, ellipsoidal_height_m=540.0)
T0_NS = 1_767_225_600_000_000_000


def settings(true_s: float, believed_s: float) -> Settings:
    return Settings.model_validate(
        {
            "detector": {"backend": "aruco"},
            "camera": {
                "calibration": {"row_time_s": believed_s},
                "simulated": {"optics": {"row_time_s": true_s, "exposure_s": 0.001}},
            },
        }
    )


def truth(place_m, attitude, velocity, rates) -> GroundTruth:
    """A vehicle in motion; the pad lies at PAD."""
    return GroundTruth(
        at_ns=T0_NS,
        vehicle_position=PAD,
        velocity_ned_mps=velocity,
        q_ned_body=quaternion_from_euler(*attitude),
        angular_velocity_body_rps=rates,
        pad_position=PAD,
        pad_azimuth_rad=0.0,
        vehicle_from_pad_ned_m=place_m,
        touching_ground=False,
    )


MOVING = [
    # Far ahead and far behind in the picture, at speed and while it turns about each axis.
    truth((-4.5, 0.5, -8.0), (0.0, 0.0, 0.0), (4.0, 1.0, -1.0), (0.0, 0.0, 0.0)),
    truth((4.0, -1.0, -8.0), (0.0, 0.0, 0.3), (3.0, -2.0, 0.5), (0.0, 0.6, 0.0)),
    truth((-4.0, 2.0, -8.0), (0.05, -0.05, 0.0), (0.0, 3.0, 0.0), (0.8, 0.0, 0.0)),
    truth((4.0, 1.0, -7.0), (0.0, 0.05, 3.0), (1.0, 0.0, 0.0), (0.4, 0.4, 0.5)),
]


def fix_error_m(seen: GroundTruth, chosen: Settings) -> np.ndarray:
    """How far off the pad is put, NED, metres."""
    calibration = configured_calibration(chosen.camera)
    picture = SimulatedCamera(chosen, calibration).capture(seen)
    detector, geolocator = build_detector(chosen), build_geolocator(chosen)
    vehicle_m = np.array(seen.vehicle_from_pad_ned_m)

    def tell(node, topic, message, pixels=None):
        return [each.message for each in node.on_message(Arrival(topic, message, T0_NS, T0_NS, pixels))]

    for node in (detector, geolocator):
        tell(node, topics.CALIBRATION, calibration)
    for before_s in (-0.04, -0.02, 0.0, 0.02, 0.04):
        tell(geolocator, topics.VEHICLE_STATE, state(seen, vehicle_m, before_s))
    header = FrameHeader(captured_at_ns=T0_NS, sequence=1, width_px=640, height_px=480, source="test")
    (detection,) = tell(detector, topics.FRAME, header, picture)
    (fix,) = tell(geolocator, topics.DETECTION, detection)
    assert fix.captured_at_ns == T0_NS
    assert fix.verdict is FixVerdict.ACCEPTED, fix.detail
    return ned_between(PAD, fix.raw.position)


def state(seen: GroundTruth, vehicle_m: np.ndarray, after_s: float) -> VehicleState:
    turned = quaternion_from_rotation_vector(tuple(rate * after_s for rate in seen.angular_velocity_body_rps))
    moved = vehicle_m + np.array(seen.velocity_ned_mps) * after_s
    return VehicleState(
        at_ns=T0_NS + round(after_s * 1e9),
        position=moved_by_ned(PAD, tuple(moved.tolist())),
        velocity_ned_mps=seen.velocity_ned_mps,
        q_ned_body=quaternion_multiply(seen.q_ned_body, turned),
        angular_velocity_body_rps=seen.angular_velocity_body_rps,
    )


@pytest.mark.parametrize("seen", MOVING)
def test_looking_the_pose_up_when_the_pads_rows_were_exposed_removes_most_of_the_error(seen) -> None:
    uncorrected = fix_error_m(seen, settings(ROW_TIME_S, 0.0))
    corrected = fix_error_m(seen, settings(ROW_TIME_S, ROW_TIME_S))
    assert np.linalg.norm(uncorrected[:2]) > 0.01
    assert np.linalg.norm(corrected[:2]) < 0.5 * np.linalg.norm(uncorrected[:2])


def test_with_all_rows_exposed_at_once_a_wrong_row_time_is_the_error() -> None:
    seen = MOVING[0]
    right = fix_error_m(seen, settings(0.0, 0.0))
    wrong = fix_error_m(seen, settings(0.0, ROW_TIME_S))
    assert np.linalg.norm(right[:2]) < 0.5 * np.linalg.norm(wrong[:2])


def test_each_row_of_the_picture_is_seen_from_where_the_camera_was_then() -> None:
    seen = MOVING[1]
    chosen = settings(ROW_TIME_S, ROW_TIME_S)
    calibration = configured_calibration(chosen.camera)
    camera = SimulatedCamera(chosen, calibration)
    backend = ArucoBackend(dictionary("5x5_1000"), "5x5_1000", chosen.detector.aruco)
    lens = PinholeCamera.from_calibration(calibration)
    (found,) = backend.detect(View(camera.capture(seen), 1, lens))

    def projected(corner_m, after_s):
        return lens.project(Viewpoint.from_truth(seen, np.eye(3), after_s).in_camera(corner_m[None]))[0]

    for corner_m, corner_px in zip(square_points_m(1.0), found.corners_px, strict=True):
        at_once = projected(corner_m, 0.0)
        row_s = ROW_TIME_S * (corner_px[1] - 239.5)
        assert math.dist(projected(corner_m, row_s), corner_px) < 0.15
        assert math.dist(at_once, corner_px) > 0.5
