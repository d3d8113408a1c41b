"""Of the two planar solutions the geolocator takes the pad's, and keeps good fixes from far away."""

import math

import numpy as np
import pytest
from geolocation_scene import POSE_SIGMA, Scene, diagonal, fly, geolocator, show

from alight.geometry.rotation import quaternion_from_rotation_vector, quaternion_multiply
from schemas.fix import FixVerdict


def tilted(pose, tilt_deg, error_px, sigma=POSE_SIGMA):
    """The same pose with the print tilted about its own x axis."""
    tilt = quaternion_from_rotation_vector((math.radians(tilt_deg), 0.0, 0.0))
    return pose.model_copy(
        update={
            "q_camera_marker": quaternion_multiply(pose.q_camera_marker, tilt),
            "reprojection_error_px": error_px,
            "covariance": diagonal(sigma),
        }
    )


def located(scene, *poses, **marker):
    node = geolocator()
    fly(node, scene, -20, 10)
    return show(node, scene.marker(*poses, **marker))


NEAR = Scene(vehicle_ned_m=(1.0, -1.0, -4.0))
FAR = Scene(vehicle_ned_m=(3.0, -5.0, -24.0))


def test_level_solution_wins_although_the_tilted_one_fits_a_little_better():
    pose = NEAR.true_pose()
    fix = located(NEAR, tilted(pose, 40.0, 0.20), tilted(pose, 1.0, 0.25))
    assert fix.detail.startswith("solution 2 of 2")


def test_better_fit_wins_when_both_are_level():
    pose = NEAR.true_pose()
    fix = located(NEAR, tilted(pose, 3.0, 0.2), tilted(pose, -2.0, 1.0))
    assert fix.detail.startswith("solution 1 of 2")


def test_pad_that_stands_upright_near_by_is_refused():
    pose = NEAR.true_pose()
    fix = located(NEAR, tilted(pose, 60.0, 0.2), tilted(pose, -55.0, 0.3))
    assert fix.verdict is FixVerdict.NOT_LEVEL
    assert "60.0 deg" in fix.detail


def test_pose_that_admits_that_it_knows_no_tilt_is_not_refused_for_it():
    pose = NEAR.true_pose()
    unsure = (0.02, 0.02, 0.05, 0.3, 0.3, 0.01)
    assert located(NEAR, tilted(pose, 40.0, 0.2)).verdict is FixVerdict.NOT_LEVEL
    assert located(NEAR, tilted(pose, 40.0, 0.2, unsure)).verdict is FixVerdict.ACCEPTED


def test_upside_down_print_is_never_level():
    pose = FAR.true_pose()
    fix = located(FAR, tilted(pose, 175.0, 0.2, (0.02, 0.02, 0.05, 2.0, 2.0, 0.01)))
    assert fix.verdict is FixVerdict.NOT_LEVEL


@pytest.mark.parametrize("scene", [NEAR, Scene(vehicle_ned_m=(4.0, 2.0, -12.0)), FAR])
def test_level_pad_through_noisy_corners_is_accepted_and_found(scene):
    generator = np.random.default_rng(68)
    fixes = []
    for _ in range(150):
        node = geolocator()
        fly(node, scene, -20, 10)
        fixes.append(show(node, scene.ippe_marker(generator, 0.3)))
    accepted = [fix for fix in fixes if fix.verdict is FixVerdict.ACCEPTED]
    assert len(accepted) >= 148
    errors = np.array([fix.raw.pad_ned_m for fix in accepted]) - scene.pad_from_vehicle_m
    range_m = math.hypot(*scene.pad_from_vehicle_m)
    assert np.abs(errors.mean(axis=0)).max() < 0.02 * range_m
    assert np.abs(errors[:, :2]).max() < 0.05 * range_m
