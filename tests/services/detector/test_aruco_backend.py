import numpy as np
import pytest

from alight.geometry.rotation import R_from_quaternion, quaternion_from_R, rotation_vector_from_quaternion
from alight.markers.family import dictionary
from schemas.settings.detector import Aruco
from services.detector.aruco import ArucoBackend
from services.detector.detector import View, WantedMarker
from services.detector.edge_corners import refined_corners
from services.detector.pattern_check import PatternCheck
from services.detector.square_pose import located

PAD = WantedMarker("5x5_1000", 68)
FRAME_NS = 33_333_333


def backend(wanted=None, **settings) -> ArucoBackend:
    return ArucoBackend(dictionary(PAD.family), PAD.family, Aruco(**settings), wanted)


def pad_in(markers):
    return next((marker for marker in markers if marker.id == PAD.id), None)


@pytest.mark.parametrize("height_m", [20.0, 12.0, 5.0, 2.0])
def test_corners_are_found_where_they_are_within_what_the_detector_says_of_itself(studio, height_m) -> None:
    errors, sigmas = [], []
    for number in range(8):
        shot = studio.shoot_at_random(height_m, number)
        marker = pad_in(backend().detect(View(shot.picture, 1, studio.camera)))
        if marker is None:
            continue
        errors.append(marker.corners_px - shot.corners_px)
        sigmas.append(marker.corner_sigma_px)
    assert len(errors) >= 6
    assert np.sqrt(np.mean(np.square(errors))) < (0.15 if height_m >= 20.0 else 0.05)
    normalised = np.mean([np.mean(error**2) / sigma**2 for error, sigma in zip(errors, sigmas, strict=True)])
    assert 0.1 < normalised < 2.0


@pytest.mark.parametrize("offset_m", [-0.2, 0.0, 0.2])
@pytest.mark.parametrize("height_m", [8.0, 3.0])
def test_the_edge_of_a_shadow_across_the_pad_does_not_hide_it(shaded_studio, height_m, offset_m) -> None:
    studio = shaded_studio(offset_m)
    for number in range(3):
        shot = studio.shoot_at_random(height_m, number)
        marker = pad_in(backend(PAD).detect(View(shot.picture, 1, studio.camera)))
        assert marker is not None
        assert np.abs(marker.corners_px - shot.corners_px).max() < 0.5


def test_without_a_camera_there_are_corners_too(studio) -> None:
    shot = studio.shoot(0.3, 0.2, -6.0, (0.05, 0.02, 0.7))
    marker = pad_in(backend().detect(View(shot.picture, 1)))
    assert np.abs(marker.corners_px - shot.corners_px).max() < 0.2


def test_a_pad_that_jumps_out_of_the_search_window_is_found_in_the_whole_frame_at_once(studio) -> None:
    detector = backend(PAD)
    near, far = studio.shoot(0.0, 0.0, -5.0), studio.shoot(2.5, -2.5, -5.0)
    for number, shot in enumerate((near, near, far, far)):
        assert pad_in(detector.detect(View(shot.picture, (number + 1) * FRAME_NS, studio.camera))) is not None
    counters = detector.counters()
    assert (counters["found_in_window"], counters["missed_in_window"], counters["whole_frame_searches"]) == (2, 1, 2)


def test_the_window_loses_nothing_on_the_way_down(studio) -> None:
    """Every frame in which the whole-frame search sees the pad, the tracking one sees it too, at the same place."""
    tracking, plain = backend(PAD), backend()
    seen = 0
    for number, height_m in enumerate(np.geomspace(20.0, 0.8, 30)):
        shot = studio.shoot(0.02 * height_m, 0.03 * height_m, -height_m, (0.02, -0.03, 0.4))
        view = View(shot.picture, (number + 1) * FRAME_NS, studio.camera)
        expected, found = pad_in(plain.detect(view)), pad_in(tracking.detect(view))
        if expected is not None:
            seen += 1
            assert np.abs(found.corners_px - expected.corners_px).max() < 0.15
    assert seen >= 25
    assert tracking.counters()["found_in_window"] > 20


def test_an_empty_frame_and_noise_hold_no_marker(studio) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (480, 640), dtype=np.uint8)
    for picture in (np.zeros((480, 640), np.uint8), noise, studio.shoot(60.0, 0.0, -8.0).picture):
        assert backend(PAD).detect(View(picture, 1, studio.camera)) == ()


def test_edges_that_are_not_there_are_not_fitted() -> None:
    corners = np.array([[100.0, 100], [200, 100], [200, 200], [100, 200]])
    assert refined_corners(np.full((480, 640), 128, np.uint8), corners, 7, None) is None


@pytest.mark.parametrize("height_m", [15.0, 6.0, 2.0])
def test_the_better_pose_is_the_true_one_within_its_covariance(studio, height_m) -> None:
    shot = studio.shoot(0.1 * height_m, 0.2 * height_m, -height_m, (0.15, 0.1, 0.8))
    marker = located(pad_in(backend().detect(View(shot.picture, 1, studio.camera))), 1.0, studio.camera)
    pose = marker.poses[0]
    R = R_from_quaternion(pose.q_camera_marker)
    turned = rotation_vector_from_quaternion(quaternion_from_R(shot.R_camera_marker @ R.T))
    error = np.concatenate((shot.centre_camera_m - np.array(pose.position_camera_m), turned))
    covariance = np.array(pose.covariance).reshape(6, 6)
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    assert error @ np.linalg.solve(covariance, error) < 22.5  # 99.9 % of chi-square with six degrees of freedom
    assert np.linalg.norm(error[:3]) < 0.01 * height_m
    assert len(marker.poses) == 2
    assert marker.poses[0].reprojection_error_px <= marker.poses[1].reprojection_error_px
    assert 0.0 <= marker.ambiguity <= 1.0


def test_a_square_seen_from_straight_above_is_ambiguous_and_its_covariance_stays_finite(studio) -> None:
    shot = studio.shoot(0.0, 0.0, -15.0)
    marker = located(pad_in(backend().detect(View(shot.picture, 1, studio.camera))), 1.0, studio.camera)
    tilted = studio.shoot(0.0, 6.0, -6.0, (0.5, 0.0, 0.0))
    clear = located(pad_in(backend().detect(View(tilted.picture, 1, studio.camera))), 1.0, studio.camera)
    assert marker.ambiguity > clear.ambiguity
    assert np.isfinite(marker.poses[0].covariance).all()


def test_a_picture_agrees_with_its_own_pattern_and_not_with_another_markers(studio) -> None:
    shot = studio.shoot(0.0, 0.0, -5.0)
    check = PatternCheck(dictionary(PAD.family))
    assert check.agreement(shot.picture, shot.corners_px, 68) > 0.95
    assert not check.agrees(shot.picture, shot.corners_px, 69)
