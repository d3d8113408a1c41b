"""Detectors that say where the pad is, and detectors that only say where its markers are."""

import math

import numpy as np
import pytest
from geolocation_scene import CALIBRATION, CAMERA, T0_NS, Scene, detection, fly, geolocator, tell

from alight.geometry.frames import camera_from_ned
from alight.geometry.rotation import rotated
from alight.markers.layout import read_layout
from alight.markers.pad_pose import mean_side_px
from schemas import topics
from schemas.detection import MarkerName, PadView
from schemas.fix import FixVerdict
from schemas.settings import Settings
from services.geolocator.service import build

SCENE = Scene()


def pad_view(marker, **changes):
    fields = {
        "poses": marker.poses,
        "ambiguity": marker.ambiguity,
        "used": (MarkerName(family=marker.family, id=marker.id),),
        "extent_px": mean_side_px(marker.corners_px),
        "corner_sigma_px": marker.corner_sigma_px,
    }
    return PadView(**(fields | changes))


def fix_of(node, message):
    fly(node, SCENE, 0, 20)
    (fix,) = tell(node, topics.DETECTION, message)
    return fix


@pytest.mark.parametrize("seed", range(3))
def test_a_single_marker_gives_the_same_fix_to_the_last_bit_whoever_speaks_for_the_pad(seed):
    marker = SCENE.ippe_marker(np.random.default_rng(seed), 0.2)
    silent = detection(marker, at_ns=T0_NS + 1_000_000)
    spoken = silent.model_copy(update={"pad": pad_view(marker)})
    assert fix_of(geolocator(), silent) == fix_of(geolocator(), spoken)


def test_the_pad_is_believed_without_any_marker_of_its_own():
    fix = fix_of(geolocator(), detection().model_copy(update={"pad": pad_view(SCENE.marker())}))
    assert fix.verdict is FixVerdict.ACCEPTED
    assert fix.raw.pad_ned_m == pytest.approx(SCENE.pad_from_vehicle_m, abs=1e-6)


def test_a_marker_that_leaves_its_pose_to_a_pad_that_is_not_there_gives_no_fix():
    fix = fix_of(geolocator(), detection(SCENE.marker().model_copy(update={"poses": ()})))
    assert fix.verdict is FixVerdict.NO_MARKER
    assert fix.detail.endswith("is not among the 1 markers seen (1 without a pose)")


def test_a_detector_that_was_set_up_for_another_pad_does_not_steer():
    other = pad_view(SCENE.marker(), used=(MarkerName(family="5x5_1000", id=68), MarkerName(family="5x5_1000", id=69)))
    fix = fix_of(geolocator(), detection(SCENE.marker()).model_copy(update={"pad": other}))
    assert fix.verdict is FixVerdict.NO_MARKER
    assert "5x5_1000 69" in fix.detail


def test_a_small_marker_beside_the_middle_stands_for_the_middle():
    """From a detector that knows nothing of layouts."""
    placed = read_layout("nested").markers[1]
    corners_ned = [
        np.array(SCENE.pad_from_vehicle_m) + rotated(SCENE.q_ned_marker, c) for c in placed.corners_m().tolist()
    ]
    corners = np.array([camera_from_ned(p, SCENE.q_ned_body, SCENE.q_body_gimbal) for p in corners_ned])
    pose = SCENE.true_pose().model_copy(update={"position_camera_m": tuple(corners.mean(axis=0).tolist())})
    marker = SCENE.marker(
        pose, id=placed.id, side_m=placed.side_m, corners_px=tuple(map(tuple, CAMERA.project(corners).tolist()))
    )
    node = build(Settings.model_validate({"pad": {"layout": "nested"}}))
    tell(node, topics.CALIBRATION, CALIBRATION)
    fix = fix_of(node, detection(marker))
    assert fix.raw.pad_ned_m == pytest.approx(SCENE.pad_from_vehicle_m, abs=1e-6)
    # The farther the marker from the middle, the more its own tilt's uncertainty moves the middle.
    assert math.sqrt(fix.covariance_ned_m2[8]) > math.sqrt(
        fix_of(geolocator(), detection(SCENE.marker())).covariance_ned_m2[8]
    )
