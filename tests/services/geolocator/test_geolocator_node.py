"""The geolocator from detection to fix."""

import math

import numpy as np
import pytest
from geolocation_scene import (
    HOME,
    MS,
    POSE_SIGMA,
    T0_NS,
    Scene,
    diagonal,
    fly,
    geolocator,
    show,
    tell,
)
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.local import ned_between
from alight.geometry.rotation import quaternion_from_euler, quaternion_multiply
from schemas import topics
from schemas.fix import FixVerdict, PadFix
from schemas.message import Hop
from schemas.settings.geolocator import PAPER_MEAN_CORRECTION, FixUncertainty, Mount, PoseLookup
from schemas.vehicle import UNKNOWN_ROTATION, GimbalState

angles = st.floats(-math.pi, math.pi)
tilts = st.floats(-0.3, 0.3)


@st.composite
def scenes(draw):
    return Scene(
        vehicle_ned_m=(draw(st.floats(-4, 4)), draw(st.floats(-4, 4)), draw(st.floats(-30, -6))),
        q_ned_body=quaternion_from_euler(draw(tilts), draw(tilts), draw(angles)),
        pad_azimuth_rad=draw(angles),
    )


@given(scenes())
def test_perfect_detection_gives_the_true_place_and_azimuth(scene):
    node = geolocator()
    fly(node, scene, -20, 10)
    fix = show(node, scene.marker())
    assert fix.verdict is FixVerdict.ACCEPTED, fix.detail
    assert fix.corrected == fix.raw
    np.testing.assert_allclose(fix.raw.pad_ned_m, scene.pad_from_vehicle_m, atol=1e-6)
    np.testing.assert_allclose(ned_between(HOME, fix.raw.position), 0.0, atol=1e-6)
    assert fix.raw.position.altitude_amsl_m == pytest.approx(HOME.altitude_amsl_m, abs=1e-6)
    assert math.remainder(fix.raw.azimuth_rad - scene.pad_azimuth_rad, math.tau) == pytest.approx(0.0, abs=1e-7)


def test_fix_tells_where_it_comes_from():
    node, scene = geolocator(), Scene()
    fly(node, scene, -20, 10)
    hops = (Hop(service="camera", received_at_ns=T0_NS, handled_at_ns=T0_NS, published_at_ns=T0_NS),)
    fix = show(node, scene.marker(), hops=hops)
    assert (fix.captured_at_ns, fix.hops) == (T0_NS, hops)
    assert fix.latency_s == pytest.approx(0.04)
    assert fix.pose_offset_s == pytest.approx(-0.01)
    np.testing.assert_allclose(ned_between(fix.vehicle_position, scene.vehicle_position), 0.0, atol=1e-6)
    assert "tilt 0.0" in fix.detail


def test_moving_vehicle_is_placed_where_it_was_at_capture():
    scene = Scene(velocity_ned_mps=(5.0, -3.0, 1.0))
    node = geolocator()
    fly(node, scene, -30, 20, 40, 60, 80, 100)
    fix = show(node, scene.marker())
    np.testing.assert_allclose(ned_between(HOME, fix.raw.position), 0.0, atol=1e-4)


def test_latest_pose_instead_of_that_at_capture_misplaces_the_pad_by_what_was_flown_since():
    scene = Scene(velocity_ned_mps=(5.0, -3.0, 1.0))
    node = geolocator(lookup=PoseLookup(pose="latest"))
    fly(node, scene, -30, 20, 40, 60, 80, 100)
    fix = show(node, scene.marker())
    np.testing.assert_allclose(ned_between(HOME, fix.raw.position), (0.5, -0.3, 0.1), atol=1e-4)
    assert fix.pose_offset_s == 0.0


def test_what_fixes_share_and_what_is_new_in_each_make_up_the_covariance():
    scene = Scene(vehicle_ned_m=(3.0, -2.0, -9.0), velocity_ned_mps=(2.0, 1.0, 0.5), rates_body_rps=(0.1, -0.2, 0.3))
    node = geolocator(uncertainty=FixUncertainty(position_m=0.03))
    fly(node, scene, -20, 10)
    fix = show(node, scene.marker())
    vectors = np.array([vector for name, vector in fix.shared if name.endswith("_ned_m")])
    whole = np.reshape(fix.noise_covariance_ned_m2, (3, 3)) + vectors.T @ vectors + 0.03**2 * np.eye(3)
    np.testing.assert_allclose(whole, np.reshape(fix.covariance_ned_m2, (3, 3)), rtol=1e-9)
    assert fix.azimuth_noise_rad2 + fix.shared.heading_rad**2 == pytest.approx(fix.azimuth_variance_rad2)


def test_capture_newer_than_the_newest_pose_is_extrapolated_and_less_certain():
    scene = Scene(velocity_ned_mps=(5.0, -3.0, 1.0))
    fresh, late = geolocator(), geolocator()
    fly(fresh, scene, -20, 0)
    fly(late, scene, -120, -100)
    fix, extrapolated = show(fresh, scene.marker()), show(late, scene.marker())
    assert extrapolated.verdict is FixVerdict.ACCEPTED
    assert extrapolated.pose_offset_s == pytest.approx(0.1)
    np.testing.assert_allclose(ned_between(HOME, extrapolated.raw.position), 0.0, atol=1e-4)
    assert np.trace(np.reshape(extrapolated.covariance_ned_m2, (3, 3))) > np.trace(
        np.reshape(fix.covariance_ned_m2, (3, 3))
    )


def test_gimbal_angles_are_taken_at_capture_time():
    gimbal = quaternion_from_euler(0.0, math.radians(-70.0), math.radians(20.0))
    scene = Scene(vehicle_ned_m=(-3.0, -1.0, -10.0), q_body_gimbal=gimbal)
    node = geolocator()
    fly(node, scene, -20, 10)
    for time_ms, pitch_deg in ((-100, -75.0), (100, -65.0)):
        q = quaternion_from_euler(0.0, math.radians(pitch_deg), math.radians(20.0))
        tell(node, topics.GIMBAL_STATE, GimbalState(at_ns=T0_NS + time_ms * MS, q_body_gimbal=q, measured=True))
    fix = show(node, scene.marker())
    np.testing.assert_allclose(fix.raw.pad_ned_m, scene.pad_from_vehicle_m, atol=1e-6)


def test_unmeasured_gimbal_state_leaves_the_mount_of_the_settings_in_force():
    scene = Scene(q_body_gimbal=quaternion_from_euler(0.0, math.radians(-80.0), 0.0))
    node = geolocator(mount=Mount(pitch_deg=-80.0))
    fly(node, scene, -20, 10)
    tell(node, topics.GIMBAL_STATE, GimbalState(at_ns=T0_NS, q_body_gimbal=(1, 0, 0, 0), measured=False))
    np.testing.assert_allclose(show(node, scene.marker()).raw.pad_ned_m, scene.pad_from_vehicle_m, atol=1e-6)


def test_known_misalignment_is_undone():
    turned = quaternion_from_euler(math.radians(2.0), math.radians(-3.0), math.radians(-4.0))
    down = quaternion_from_euler(0.0, -math.pi / 2, 0.0)
    scene = Scene(q_body_gimbal=quaternion_multiply(turned, down))
    node = geolocator(mount=Mount(misalignment_roll_deg=2.0, misalignment_pitch_deg=-3.0, misalignment_yaw_deg=-4.0))
    fly(node, scene, -20, 10)
    np.testing.assert_allclose(show(node, scene.marker()).raw.pad_ned_m, scene.pad_from_vehicle_m, atol=1e-6)


def test_raw_and_corrected_places_are_both_told():
    scene = Scene()
    node = geolocator(correction=PAPER_MEAN_CORRECTION)
    fly(node, scene, -20, 10)
    fix = show(node, scene.marker())
    np.testing.assert_allclose(fix.raw.pad_ned_m, scene.pad_from_vehicle_m, atol=1e-6)
    assert fix.corrected.pad_ned_m[2] == pytest.approx(fix.raw.pad_ned_m[2] - 0.488412)
    vehicle_to_corrected = ned_between(fix.vehicle_position, fix.corrected.position)
    np.testing.assert_allclose(vehicle_to_corrected, fix.corrected.pad_ned_m, atol=1e-6)


def verdict_of(node, *markers, **others):
    fix = show(node, *markers, **others)
    assert fix.detail
    if fix.verdict is not FixVerdict.ACCEPTED:
        assert fix.raw is None
        assert fix.corrected is None
    return fix.verdict


def ready():
    node = geolocator()
    fly(node, Scene(), -20, 10)
    return node


def test_detection_without_the_pads_marker():
    assert verdict_of(ready()) is FixVerdict.NO_MARKER
    assert verdict_of(ready(), Scene().marker(id=69)) is FixVerdict.NO_MARKER
    assert verdict_of(ready(), Scene().marker(family="4x4_50")) is FixVerdict.NO_MARKER


def test_missing_inputs_are_named():
    assert verdict_of(geolocator(), Scene().marker()) is FixVerdict.NO_VEHICLE_STATE
    assert verdict_of(geolocator(calibration=None), Scene().marker()) is FixVerdict.NO_CALIBRATION


def test_pose_too_old():
    node = geolocator()
    fly(node, Scene(), -200, -160)
    assert verdict_of(node, Scene().marker()) is FixVerdict.POSE_TOO_OLD


def test_pose_gap():
    node = geolocator()
    fly(node, Scene(), -150, 100)
    assert verdict_of(node, Scene().marker()) is FixVerdict.POSE_GAP


def test_capture_before_history():
    node = geolocator()
    fly(node, Scene(), 10, 30)
    assert verdict_of(node, Scene().marker()) is FixVerdict.CAPTURE_BEFORE_HISTORY


def test_silent_gimbal_is_not_a_fixed_mount():
    node = ready()
    tell(node, topics.GIMBAL_STATE, GimbalState(at_ns=T0_NS - 600 * MS, q_body_gimbal=(1, 0, 0, 0), measured=True))
    assert verdict_of(node, Scene().marker()) is FixVerdict.POSE_TOO_OLD


def test_a_gimbal_of_which_nobody_knows_how_it_is_turned_is_not_a_fixed_mount():
    node = ready()
    unknown = GimbalState(at_ns=T0_NS - 10 * MS, q_body_gimbal=UNKNOWN_ROTATION, measured=True)
    tell(node, topics.GIMBAL_STATE, unknown)
    tell(node, topics.GIMBAL_STATE, unknown.model_copy(update={"at_ns": T0_NS, "measured": False}))
    fix = show(node, Scene().marker())
    assert fix.verdict is FixVerdict.POSE_TOO_OLD
    assert "gimbal" in fix.detail


def test_pad_behind_the_camera():
    pose = Scene().true_pose().model_copy(update={"position_camera_m": (0.0, 0.0, -5.0)})
    assert verdict_of(ready(), Scene().marker(pose)) is FixVerdict.BEHIND_CAMERA


def test_pad_above_the_vehicle():
    scene = Scene(q_ned_body=quaternion_from_euler(math.pi, 0.0, 0.0))
    node = geolocator()
    fly(node, scene, -20, 10)
    pose = scene.true_pose().model_copy(update={"position_camera_m": (0.0, 0.0, 5.0)})
    assert verdict_of(node, Scene().marker(pose)) is FixVerdict.ABOVE_VEHICLE


@pytest.mark.parametrize(
    "nonsense",
    [
        {"q_camera_marker": (0.0, 0.0, 0.0, 0.0)},
        {"position_camera_m": (1e300, 1e300, 1e300)},
        {"position_camera_m": (0.0, 0.0, 1e7)},
    ],
)
def test_arithmetic_that_leads_nowhere(nonsense):
    pose = Scene().true_pose().model_copy(update=nonsense)
    assert verdict_of(ready(), Scene().marker(pose)) is FixVerdict.NOT_FINITE


@pytest.mark.parametrize(
    "covariance",
    [diagonal((0.0,) * 6), tuple(-x for x in diagonal(POSE_SIGMA)), diagonal((1e9,) * 6), (*diagonal(POSE_SIGMA)[:-2], 7.0, 1e-4)],
)  # fmt: skip
def test_covariance_that_is_none(covariance):
    pose = Scene().true_pose().model_copy(update={"covariance": covariance})
    assert verdict_of(ready(), Scene().marker(pose)) is FixVerdict.BAD_COVARIANCE


def test_time_that_runs_backwards():
    node = ready()
    assert verdict_of(node, Scene().marker()) is FixVerdict.ACCEPTED
    assert verdict_of(node, Scene().marker()) is FixVerdict.OUT_OF_ORDER
    assert verdict_of(node, Scene().marker(), at_ns=T0_NS - 5 * MS) is FixVerdict.OUT_OF_ORDER
    tell(node, topics.VEHICLE_STATE, Scene().state(T0_NS - 500 * MS))
    assert verdict_of(node, Scene().marker(), at_ns=T0_NS + MS) is FixVerdict.ACCEPTED
    assert node.counters()["vehicle_state_refused"] == 1


def test_attitude_that_is_no_rotation_is_not_used():
    node = geolocator()
    tell(node, topics.VEHICLE_STATE, Scene().state(T0_NS, q_ned_body=(0.0, 0.0, 0.0, 0.0)))
    assert verdict_of(node, Scene().marker()) is FixVerdict.NO_VEHICLE_STATE


@pytest.mark.parametrize("changes", [{"velocity_ned_mps": (1e300, 0, 0)}, {"angular_velocity_body_rps": (1e200, 0, 0)}])
def test_absurd_motion_does_not_become_a_fix(changes):
    node = geolocator()
    tell(node, topics.VEHICLE_STATE, Scene().state(T0_NS - 50 * MS, **changes))
    assert verdict_of(node, Scene().marker()) is FixVerdict.NOT_FINITE


numbers = st.one_of(st.floats(allow_nan=False, allow_infinity=False), st.floats(-10, 10), st.just(0.0))


@given(
    position=st.tuples(numbers, numbers, numbers),
    q=st.tuples(numbers, numbers, numbers, numbers),
    variance=numbers,
    q_body=st.tuples(numbers, numbers, numbers, numbers),
    velocity=st.tuples(numbers, numbers, numbers),
)
def test_whatever_comes_in_an_accepted_fix_is_whole(position, q, variance, q_body, velocity):
    node = geolocator()
    tell(node, topics.VEHICLE_STATE, Scene().state(T0_NS - 30 * MS, q_ned_body=q_body, velocity_ned_mps=velocity))
    tell(node, topics.VEHICLE_STATE, Scene().state(T0_NS - 10 * MS))
    pose = Scene().true_pose()
    covariance = (variance, *pose.covariance[1:])
    fix = show(node, Scene().marker(pose.model_copy(update={"position_camera_m": position, "q_camera_marker": q, "covariance": covariance})))  # fmt: skip
    PadFix.model_validate_json(fix.model_dump_json())
    if fix.verdict is FixVerdict.ACCEPTED:
        assert fix.corrected.pad_ned_m[2] > 0.0
        assert np.linalg.eigvalsh(np.reshape(fix.covariance_ned_m2, (3, 3))).min() > 0.0


def test_counters_tell_fixes_by_verdict_and_complaints_the_last_reason():
    node = geolocator()
    for i in range(12):
        show(node, Scene().marker(), at_ns=T0_NS + i * MS)
    show(node, at_ns=T0_NS + 20 * MS)
    assert node.counters() == {"fix_no_vehicle_state": 12, "fix_no_marker": 1}
    (complaint,) = node.complaints(T0_NS)
    assert "no_vehicle_state" in complaint
    fly(node, Scene(), 10, 30)
    show(node, Scene().marker(), at_ns=T0_NS + 25 * MS)
    assert node.complaints(T0_NS) == ()
