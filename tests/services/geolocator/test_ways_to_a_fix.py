"""Three ways to a fix: by the pad's pose, by the line of sight and the height, and by both."""

import math

import numpy as np
import pytest
from geolocation_scene import HOME, Scene, diagonal, fly, geolocator, show
from hypothesis import assume, given
from hypothesis import strategies as st

from alight.geometry.rotation import quaternion_from_euler
from schemas.fix import FixInput, FixVerdict
from schemas.settings.geolocator import PAPER_MEAN_CORRECTION, FixUncertainty, Mount, PadHeight

KNOWN = PadHeight(pad_altitude_amsl_m=HOME.altitude_amsl_m, sigma_m=0.1)
SCENE = Scene(vehicle_ned_m=(2.0, -3.0, -9.0), q_ned_body=quaternion_from_euler(0.1, -0.1, 1.0))


def located(scene=SCENE, poses=(), **settings):
    node = geolocator(**settings)
    fly(node, scene, -20, 10)
    return show(node, scene.marker(*poses))


def farther(scene, factor, sigma=(0.02, 0.02, 0.05, 0.02, 0.02, 0.005)):
    """The pad's pose as a detector has it that believes the print to be larger by a factor."""
    pose = scene.true_pose(sigma)
    x, y, z = pose.position_camera_m
    return pose.model_copy(update={"position_camera_m": (factor * x, factor * y, factor * z)})


def covariance(fix):
    return np.reshape(fix.covariance_ned_m2, (3, 3))


@pytest.mark.parametrize("method", ["pnp", "bearing", "fused"])
@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-30, -2), st.floats(-0.3, 0.3), st.floats(-math.pi, math.pi))
def test_without_errors_all_ways_lead_to_the_pad(method, north, east, down, tilt, yaw):
    scene = Scene(vehicle_ned_m=(north, east, down), q_ned_body=quaternion_from_euler(tilt, -tilt, yaw))
    assume(scene.corners_camera_m()[:, 2].min() > 0.1)  # else the print is partly behind the camera
    fix = located(scene, method=method, height=KNOWN)
    assert fix.verdict is FixVerdict.ACCEPTED, fix.detail
    assert fix.method == method
    np.testing.assert_allclose(fix.corrected.pad_ned_m, scene.pad_from_vehicle_m, atol=1e-5)


def test_bearing_does_not_care_how_large_the_print_is():
    poses = (farther(SCENE, 1.1),)
    np.testing.assert_allclose(
        located(poses=poses, method="bearing", height=KNOWN).corrected.pad_ned_m, SCENE.pad_from_vehicle_m, atol=1e-5
    )
    assert located(poses=poses, method="pnp").corrected.pad_ned_m[2] > 9.8


def test_bearing_refuses_without_a_height_and_towards_the_horizon():
    assert located(method="bearing").verdict is FixVerdict.NO_HEIGHT
    far = Scene(vehicle_ned_m=(-200.0, 0.0, -9.0), q_body_gimbal=quaternion_from_euler(0.0, math.radians(-10), 0.0))
    mount = Mount(pitch_deg=-10.0)
    assert located(far, method="bearing", height=KNOWN, mount=mount).verdict is FixVerdict.TOO_FLAT
    below = KNOWN.model_copy(update={"pad_altitude_amsl_m": HOME.altitude_amsl_m + 10.0})
    assert located(method="bearing", height=below).verdict is FixVerdict.ABOVE_VEHICLE


def test_fused_lies_between_and_is_surer_than_either():
    poses = (farther(SCENE, 1.02),)
    ways = {method: located(poses=poses, method=method, height=KNOWN) for method in ("bearing", "fused", "pnp")}
    downs = [fix.corrected.pad_ned_m[2] for fix in ways.values()]
    assert downs == sorted(downs)
    for other in ("bearing", "pnp"):
        more = covariance(ways[other]) - covariance(ways["fused"])
        assert np.linalg.eigvalsh(more).min() > -1e-9
        assert np.trace(more) > 1e-4


@pytest.mark.parametrize(("sigma_m", "like"), [(1e-3, "bearing"), (100.0, "pnp")])
def test_fused_follows_the_one_that_is_sure(sigma_m, like):
    height = KNOWN.model_copy(update={"sigma_m": sigma_m})
    uncertainty = FixUncertainty(position_m=0.001, roll_pitch_deg=0.05)
    pose = farther(SCENE, 1.05)
    ray = np.array(pose.position_camera_m)
    unsure = np.diag([1e-6] * 3 + [1e-4] * 3)
    unsure[:3, :3] += 0.05**2 * np.outer(ray, ray)
    poses = (pose.model_copy(update={"covariance": tuple(unsure.ravel().tolist())}),)
    fused, other = (
        located(poses=poses, method=method, height=height, uncertainty=uncertainty) for method in ("fused", like)
    )
    np.testing.assert_allclose(fused.corrected.pad_ned_m, other.corrected.pad_ned_m, atol=0.01)


def test_a_height_that_contradicts_the_picture_is_left_out_and_told():
    wrong = KNOWN.model_copy(update={"pad_altitude_amsl_m": HOME.altitude_amsl_m - 5.0})
    fix, plain = located(method="fused", height=wrong), located(method="pnp")
    assert fix.corrected == plain.corrected
    assert FixInput.HEIGHT not in fix.inputs
    assert "height 14.00 m against 9.00 m left out" in fix.detail


def test_without_a_known_height_fused_is_pnp():
    fused, plain = located(method="fused"), located(method="pnp")
    assert fused.model_copy(update={"method": "pnp"}) == plain


def test_the_height_is_set_against_what_the_correction_leaves():
    bias_m = PAPER_MEAN_CORRECTION.beta_d_m
    n, e, d = SCENE.pad_from_vehicle_m
    high = Scene(vehicle_ned_m=(-n, -e, -d - bias_m), q_ned_body=SCENE.q_ned_body)
    node = geolocator(method="fused", height=KNOWN, correction=PAPER_MEAN_CORRECTION)
    fly(node, SCENE, -20, 10)
    fix = show(node, high.marker())
    assert FixInput.HEIGHT in fix.inputs
    assert fix.corrected.pad_ned_m[2] == pytest.approx(d, abs=1e-5)


def test_a_fix_names_what_it_was_made_of():
    pose = SCENE.true_pose()
    mounted = (FixInput.POSE_INTERPOLATED, FixInput.FIXED_MOUNT)
    assert located(method="pnp").inputs == (FixInput.PICTURE_POSE, *mounted)
    assert located(method="fused", height=KNOWN).inputs == (FixInput.PICTURE_POSE, FixInput.HEIGHT, *mounted)
    assert located(method="bearing", height=KNOWN).inputs == (FixInput.LINE_OF_SIGHT, FixInput.HEIGHT, *mounted)
    upright = pose.model_copy(update={"q_camera_marker": (0.0, 0.8, 0.6, 0.0), "covariance": diagonal((0.01,) * 6)})
    chosen = located(poses=(upright, pose.model_copy(update={"reprojection_error_px": 0.2})), method="pnp")
    assert FixInput.LEVEL_PRIOR in chosen.inputs
    assert FixInput.CORRECTION in located(correction=PAPER_MEAN_CORRECTION).inputs
