"""How many poses a square's picture allows."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
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


@given(st.floats(1.0, 5.0), st.integers(0, 2**32 - 1))
@settings(max_examples=10)
def test_a_pose_is_as_uncertain_as_its_corners_err_together(distance_m, seed) -> None:
    random = np.random.default_rng(seed)
    root = 0.01 * random.normal(size=(8, 8))
    clean = seen_from(distance_m, 0.2, -0.15)
    claim = replace(clean, corner_sigma_px=0.01 * math.sqrt(8.0), corner_covariance_px2=root @ root.T)
    claimed = np.array(located(claim, 1.0, CAMERA).poses[0].covariance).reshape(6, 6)
    true_m, true_R = pose_of(clean)
    errors = []
    for _ in range(200):
        position_m, R = pose_of(
            replace(clean, corners_px=clean.corners_px + (root @ random.normal(size=8)).reshape(4, 2))
        )
        errors.append(np.concatenate((position_m - true_m, cv2.Rodrigues(R @ true_R.T)[0].ravel())))
    scatter = np.array(errors).T @ np.array(errors) / len(errors)
    ratios = np.diag(scatter) / np.diag(claimed)
    assert ((ratios > 0.6) & (ratios < 1.6)).all()


def pose_of(found: FoundMarker) -> tuple[np.ndarray, np.ndarray]:
    best = located(found, 1.0, CAMERA).poses[0]
    return np.array(best.position_camera_m), R_from_quaternion(best.q_camera_marker)
