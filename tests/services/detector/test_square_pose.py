"""How many poses a square's picture allows."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.camera import PinholeCamera
from alight.geometry.rotation import R_from_quaternion, R_x, R_y
from schemas.settings import Settings
from services.camera.calibration_file import configured_calibration
from services.detector.detector import FoundMarker
from services.detector.square_pose import located, square_points_m

CAMERA = PinholeCamera.from_calibration(configured_calibration(Settings().camera))
FACING = np.diag([1.0, -1.0, -1.0])


def seen_from(distance_m: float, roll_rad: float, pitch_rad: float, noise_px: np.ndarray | float = 0.0) -> FoundMarker:
    corners_m = square_points_m(1.0) @ (R_x(roll_rad) @ R_y(pitch_rad) @ FACING).T + (0.1, -0.2, distance_m)
    return FoundMarker("5x5_1000", 68, CAMERA.project(corners_m) + noise_px, 0.1)


def angle_between_rad(one: np.ndarray, other: np.ndarray) -> float:
    return math.acos(min(1.0, max(-1.0, (float(np.trace(one.T @ other)) - 1.0) / 2.0)))


@given(st.floats(1.0, 40.0), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.integers(0, 2**32 - 1))
def test_two_poses_are_never_the_same_one_twice_and_the_better_comes_first(distance_m, roll, pitch, seed) -> None:
    noise_px = np.random.default_rng(seed).normal(0.0, 0.1, (4, 2))
    marker = located(seen_from(distance_m, roll, pitch, noise_px), 1.0, CAMERA)
    assert marker is not None
    errors_px = [pose.reprojection_error_px for pose in marker.poses]
    assert errors_px == sorted(errors_px)
    if len(marker.poses) == 1:
        assert marker.ambiguity == 0.0
        return
    one, other = (R_from_quaternion(pose.q_camera_marker) for pose in marker.poses)
    assert angle_between_rad(one, other) > math.radians(0.5)
    assert marker.ambiguity == pytest.approx(errors_px[0] / errors_px[1])


def test_near_by_the_second_pose_fits_much_worse() -> None:
    marker = located(seen_from(2.0, 0.1, -0.05), 1.0, CAMERA)
    assert marker is not None and len(marker.poses) == 2
    assert marker.ambiguity < 0.01


def test_far_away_it_allows_two() -> None:
    marker = located(seen_from(20.0, 0.2, 0.1), 1.0, CAMERA)
    assert marker is not None and len(marker.poses) == 2
