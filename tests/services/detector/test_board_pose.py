"""The pad's pose from several markers, with corners made from a known pose and noise of a known size."""

from dataclasses import replace

import numpy as np
import pytest

from alight.geometry.camera import PinholeCamera
from alight.geometry.rotation import (
    R_from_quaternion,
    R_x,
    R_y,
    R_z,
    quaternion_from_R,
    rotation_vector_from_quaternion,
)
from alight.markers.layout import PadLayout, PlacedMarker, read_layout
from schemas.settings import Settings
from services.camera.calibration_file import configured_calibration
from services.detector.board_pose import pad_view, said_once
from services.detector.detector import FoundMarker
from services.detector.square_pose import located

CAMERA = PinholeCamera.from_calibration(configured_calibration(Settings().camera))
NESTED, PAPER = read_layout("nested"), read_layout("paper")
SIGMA_PX = 0.1


class Sky:
    """A camera somewhere above the pad, and what it makes of the pad's markers."""

    def __init__(self, place_m, tilt_rad=(0.05, -0.03), yaw_rad=0.7, seed=0):
        down = np.diag((1.0, -1.0, -1.0))
        self.R_camera_pad = R_x(tilt_rad[0]) @ R_y(tilt_rad[1]) @ R_z(yaw_rad) @ down
        self.pad_in_camera_m = -self.R_camera_pad @ np.array(place_m)
        self.random = np.random.default_rng(seed)

    def corners_px(self, corners_m):
        return CAMERA.project(corners_m @ self.R_camera_pad.T + self.pad_in_camera_m)

    def markers(self, layout: PadLayout, sigma_px=SIGMA_PX):
        """Those of the layout that are whole in view, with noise."""
        found = []
        for placed in layout.markers:
            corners = self.corners_px(placed.corners_m())
            if (corners > 1).all() and (corners < (638, 478)).all():
                noisy = corners + self.random.normal(0.0, sigma_px, (4, 2))
                found.append(
                    located(FoundMarker(placed.family, placed.id, noisy, max(sigma_px, 1e-3)), placed.side_m, CAMERA)
                )
        return [marker for marker in found if marker is not None]

    def error(self, pose):
        """(position, small rotation) of a pose against the truth, (6,)."""
        turn = R_from_quaternion(pose.q_camera_marker) @ self.R_camera_pad.T
        shift = np.array(pose.position_camera_m) - self.pad_in_camera_m
        return np.concatenate((shift, rotation_vector_from_quaternion(quaternion_from_R(turn))))


def names(marker_names):
    return {name.id for name in marker_names}


def test_a_single_marker_in_the_middle_is_the_pad_to_the_last_bit():
    (marker,) = Sky((0.4, -0.3, 6.0)).markers(PAPER)
    pad = pad_view([marker], PAPER, CAMERA)
    assert pad.poses == marker.poses
    assert (pad.ambiguity, pad.corner_sigma_px) == (marker.ambiguity, marker.corner_sigma_px)


def test_what_a_marker_and_the_pad_have_in_common_is_said_once():
    (marker,) = Sky((0.4, -0.3, 6.0)).markers(PAPER)
    (shortened,) = said_once([marker], pad_view([marker], PAPER, CAMERA))
    assert shortened == marker.model_copy(update={"poses": ()})
    several = Sky((0.1, 0.05, 0.5)).markers(NESTED)
    assert said_once(several, pad_view(several, NESTED, CAMERA)) == tuple(several)


@pytest.mark.parametrize("place_m", [(0.02, -0.03, 0.2), (0.1, 0.05, 0.5), (0.0, 0.2, 1.6), (0.5, -0.4, 5.0)])
def test_all_markers_in_view_give_one_exact_pose(place_m):
    sky = Sky(place_m)
    markers = sky.markers(NESTED, sigma_px=0.0)
    pad = pad_view(markers, NESTED, CAMERA)
    assert names(pad.used) == {marker.id for marker in markers}
    assert np.abs(sky.error(pad.poses[0])).max() < 1e-5


def test_many_markers_place_the_pad_better_than_the_best_of_them_alone():
    together, alone = [], []
    for seed in range(40):
        sky = Sky((0.05, -0.05, 0.6), seed=seed)
        markers = sky.markers(NESTED)
        together.append(sky.error(pad_view(markers, NESTED, CAMERA).poses[0]))
        alone.append(sky.error(pad_view(markers[:1], NESTED, CAMERA).poses[0]))
    assert np.std(np.array(together)[:, :3], axis=0).max() < 0.5 * np.std(np.array(alone)[:, :3], axis=0).max()


@pytest.mark.parametrize(
    ("place_m", "least_markers"), [((0.05, -0.05, 0.6), 8), ((0.01, 0.02, 0.16), 1), ((0.2, 0.1, 2.0), 10)]
)
def test_the_covariance_says_how_far_off_the_pose_is(place_m, least_markers):
    squared = []
    for seed in range(80):
        sky = Sky(place_m, tilt_rad=(0.35, -0.3), seed=seed)
        pad = pad_view(sky.markers(NESTED), NESTED, CAMERA)
        assert len(pad.used) >= least_markers
        likelier = min(pad.poses, key=lambda pose: pose.reprojection_error_px)
        error = sky.error(likelier)
        squared.append(error @ np.linalg.solve(np.array(likelier.covariance).reshape(6, 6), error))
    # Six degrees of freedom: the mean of 80 has a standard deviation of 0.39. Where the fit is worse than the noise the covariance
    # grows, so the mean lies a little below.
    assert 4.8 < np.mean(squared) < 7.2


def test_a_marker_at_the_pad_s_edge_alone_still_gives_the_pad_s_centre():
    layout = PadLayout("edge", (PlacedMarker("4x4_50", 3, 0.3, 0.4, -0.3, 1.1),), 2.0)
    errors, sigmas = [], []
    for seed in range(100):
        sky = Sky((0.1, 0.0, 2.0), tilt_rad=(0.4, 0.2), seed=seed)
        pose = pad_view(sky.markers(layout), layout, CAMERA).poses[0]
        errors.append(sky.error(pose))
        sigmas.append(np.sqrt(np.diag(np.array(pose.covariance).reshape(6, 6))))
    ratio = np.sqrt(np.mean((np.array(errors) / np.array(sigmas)) ** 2, axis=0))
    assert (ratio > 0.75).all()
    assert (ratio < 1.25).all()


@pytest.mark.parametrize("seed", range(5))
def test_a_marker_where_it_cannot_be_is_left_out(seed):
    sky = Sky((0.05, -0.05, 0.6), seed=seed)
    markers = sky.markers(NESTED)
    liar = sky.random.integers(len(markers))
    moved = np.array(markers[liar].corners_px) + sky.random.uniform(20, 60, 2)
    false = located(FoundMarker(markers[liar].family, markers[liar].id, moved, SIGMA_PX), markers[liar].side_m, CAMERA)
    pad = pad_view([*markers[:liar], false, *markers[liar + 1 :]], NESTED, CAMERA)
    assert names(pad.left_out) == {markers[liar].id}
    assert np.abs(sky.error(pad.poses[0])[:3]).max() < 5e-3


def test_a_large_false_marker_does_not_outvote_two_small_true_ones():
    sky = Sky((0.01, 0.0, 0.2))
    markers = sky.markers(NESTED)
    assert len(markers) >= 2
    false = replace(FoundMarker("5x5_1000", 68, np.array([[50.0, 60], [450, 40], [470, 430], [30, 450]]), SIGMA_PX))
    pad = pad_view([located(false, 1.0, CAMERA), *markers], NESTED, CAMERA)
    assert names(pad.left_out) == {68}
    assert names(pad.used) == {marker.id for marker in markers}


def test_markers_that_are_not_on_the_pad_make_no_pad():
    (marker,) = Sky((0.4, -0.3, 6.0)).markers(PAPER)
    assert pad_view([marker.model_copy(update={"id": 69})], PAPER, CAMERA) is None
    assert pad_view([], PAPER, CAMERA) is None
