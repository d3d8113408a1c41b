"""The pad's print as compass and horizon: where its lie is surveyed, the attitude's error is taken out of fixes, and said to be."""

import math

import numpy as np
import pytest
from geolocation_scene import MS, T0_NS, Scene, geolocator, show, tell

from alight.geometry.rotation import quaternion_from_euler, quaternion_from_rotation_vector, quaternion_multiply
from schemas import topics
from schemas.fix import FixInput
from schemas.settings.geolocator import FixUncertainty, SurveyedHeading, SurveyedTilt

AZIMUTH_DEG = 30.0
SCENE = Scene(pad_azimuth_rad=math.radians(AZIMUTH_DEG))
UNCERTAINTY = FixUncertainty(yaw_deg=1.5)


def looked_at(heading_error_deg, survey, frames=30, scene=SCENE):
    """The node, and its fixes from an autopilot whose heading is off: too far clockwise if positive."""
    node = geolocator(heading=survey, uncertainty=UNCERTAINTY)
    turn = quaternion_from_euler(0.0, 0.0, math.radians(heading_error_deg))
    fixes = []
    for frame in range(frames):
        at_ns = T0_NS + frame * 33 * MS
        for time_ns in (at_ns - 10 * MS, at_ns + 5 * MS):
            state = scene.state(time_ns, q_ned_body=quaternion_multiply(turn, scene.q_ned_body))
            tell(node, topics.VEHICLE_STATE, state)
        fixes.append(show(node, scene.marker(), at_ns=at_ns))
    return node, fixes


def off_m(fix):
    return float(np.linalg.norm(np.subtract(fix.corrected.pad_ned_m, SCENE.pad_from_vehicle_m)))


@pytest.mark.parametrize("error_deg", [-1.2, 0.5, 2.0])
def test_the_compass_error_is_taken_out_of_place_and_azimuth(error_deg):
    _, fixes = looked_at(error_deg, SurveyedHeading(pad_azimuth_deg=AZIMUTH_DEG))
    north, east, _ = SCENE.pad_from_vehicle_m
    without_m = math.radians(abs(error_deg)) * math.hypot(north, east)
    # This picture errs by 0.29 degrees a look, of which a part may last: that much less of the error is believed to be the compass's.
    assert off_m(fixes[-1]) < 0.1 * without_m
    assert abs(fixes[-1].corrected.azimuth_rad - SCENE.pad_azimuth_rad) < fixes[-1].shared.heading_rad
    assert off_m(as_measured(fixes[-1])) == pytest.approx(without_m, rel=0.02), "raw stays as it was measured"


def as_measured(fix):
    """The fix with its raw place as its corrected one."""
    return fix.model_copy(update={"corrected": fix.raw})


def test_the_covariance_says_what_was_gained():
    _, plain = looked_at(0.5, SurveyedHeading())
    _, aided = looked_at(0.5, SurveyedHeading(pad_azimuth_deg=AZIMUTH_DEG))
    assert plain[-1].shared.heading_rad == pytest.approx(math.radians(1.5))
    assert math.radians(0.1) < aided[-1].shared.heading_rad < math.radians(0.5)
    before, after = (np.array(one[-1].covariance_ned_m2).reshape(3, 3) for one in (plain, aided))
    assert np.trace(after) < np.trace(before)
    assert np.linalg.eigvalsh(after).min() > 0.0
    north, east, _ = aided[-1].corrected.pad_ned_m
    heading_rad = aided[-1].shared.heading_rad
    np.testing.assert_allclose(
        aided[-1].shared.heading_ned_m, (-heading_rad * east, heading_rad * north, 0.0), atol=1e-6
    )


def test_without_a_survey_nothing_changes():
    _, fixes = looked_at(0.5, SurveyedHeading())
    assert all(fix.corrected == fix.raw for fix in fixes)


def test_a_pad_that_was_turned_since_is_not_believed_and_complained_of():
    node, fixes = looked_at(0.0, SurveyedHeading(pad_azimuth_deg=AZIMUTH_DEG + 25.0))
    assert all(fix.corrected == fix.raw for fix in fixes)
    (complaint,) = node.complaints(T0_NS)
    assert "turned by -25.0 deg" in complaint and "pad_azimuth_deg" in complaint
    assert node.counters()["heading_refused"] == len(fixes)


def test_a_heading_that_wanders_is_followed():
    node = geolocator(heading=SurveyedHeading(pad_azimuth_deg=AZIMUTH_DEG), uncertainty=UNCERTAINTY)
    worst_m = 0.0
    for frame in range(300):
        at_ns = T0_NS + frame * 33 * MS
        turn = quaternion_from_euler(0.0, 0.0, math.radians(0.5 + 0.5 * math.sin(frame / 60.0)))
        q = quaternion_multiply(turn, SCENE.q_ned_body)
        tell(node, topics.VEHICLE_STATE, SCENE.state(at_ns - 10 * MS, q_ned_body=q))
        tell(node, topics.VEHICLE_STATE, SCENE.state(at_ns + 5 * MS, q_ned_body=q))
        fix = show(node, SCENE.marker(), at_ns=at_ns)
        worst_m = max(worst_m, off_m(fix)) if frame > 30 else worst_m
    north, east, _ = SCENE.pad_from_vehicle_m
    assert worst_m < math.radians(0.25) * math.hypot(north, east)


# Seen from aside, so that the picture shows a tilt; an autopilot whose roll and pitch are good to 0.3 degrees.
ASIDE = Scene(vehicle_ned_m=(4.0, -6.0, -10.0), pad_azimuth_rad=math.radians(AZIMUTH_DEG))
BY_PRINT = {
    "heading": SurveyedHeading(pad_azimuth_deg=AZIMUTH_DEG),
    "tilt": SurveyedTilt(pad_tilt_deg=(0.0, 0.0)),
    "uncertainty": FixUncertainty(yaw_deg=1.5, roll_pitch_deg=0.3),
}


def seen_with(turn_deg, frames=90, corner_px=0.01, seed=3, **settings):
    """The node, and the fixes from corners with noise, of an autopilot whose attitude is turned too far about north, east and down."""
    node, random = geolocator(**settings), np.random.default_rng(seed)
    turn = quaternion_from_rotation_vector(np.radians(turn_deg))
    q = quaternion_multiply(turn, ASIDE.q_ned_body)
    fixes = []
    for frame in range(frames):
        at_ns = T0_NS + frame * 33 * MS
        for time_ns in (at_ns - 10 * MS, at_ns + 5 * MS):
            tell(node, topics.VEHICLE_STATE, ASIDE.state(time_ns, q_ned_body=q))
        fixes.append(show(node, ASIDE.ippe_marker(random, corner_px), at_ns=at_ns))
    return node, fixes


def error_m(fix):
    return np.subtract(fix.corrected.pad_ned_m, ASIDE.pad_from_vehicle_m)


@pytest.mark.parametrize("turn_deg", [(0.3, 0.0, 0.0), (0.0, -0.4, 0.5), (-0.2, 0.3, -1.0)])
def test_roll_and_pitch_are_taken_from_a_pad_that_lies_as_surveyed(turn_deg):
    _, plain = seen_with(turn_deg, uncertainty=BY_PRINT["uncertainty"])
    _, aided = seen_with(turn_deg, **BY_PRINT)
    assert np.linalg.norm(error_m(aided[-1])) < 0.3 * np.linalg.norm(error_m(plain[-1]))
    assert {FixInput.PAD_AZIMUTH, FixInput.PAD_TILT} <= set(aided[-1].inputs)
    assert not {FixInput.PAD_AZIMUTH, FixInput.PAD_TILT} & set(plain[-1].inputs)


def test_a_pad_that_is_tilted_as_surveyed_is_no_error_of_the_attitude():
    """A level pad, an attitude that is off, and a survey that says the same of the pad: nothing is left to be put right."""
    survey = BY_PRINT | {"tilt": SurveyedTilt(pad_tilt_deg=(0.4, -0.2))}
    _, told = seen_with((0.4, -0.2, 0.0), **survey)
    _, plain = seen_with((0.4, -0.2, 0.0), uncertainty=BY_PRINT["uncertainty"])
    np.testing.assert_allclose(error_m(told[-1]), error_m(plain[-1]), atol=0.02)


def test_what_is_left_of_the_attitudes_error_is_what_the_covariance_says():
    """Over many flights, each with errors of the size that the settings name: the mean squared error in units of its covariance is 3."""
    random = np.random.default_rng(5)
    squares = []
    for flight in range(60):
        turn_deg = random.normal(0.0, (0.3, 0.3, 1.5))
        _, fixes = seen_with(turn_deg, frames=8, corner_px=0.02, seed=flight, **_exact())
        error, covariance = error_m(fixes[-1]), np.reshape(fixes[-1].covariance_ned_m2, (3, 3))
        squares.append(error @ np.linalg.solve(covariance, error))
    # 99.9 % of the means of 60 honest ones; below it the claim is cautious, as the part of the picture's errors that lasts is here none.
    assert 0.8 < np.mean(squares) < 4.3


def _exact():
    nothing = {"position_m": 0.0, "focal_fraction": 0.0, "principal_point_px": 0.0, "pad_size_px": 0.0, "time_s": 0.0}
    survey = {"sigma_deg": 0.0}
    return {
        "heading": SurveyedHeading(pad_azimuth_deg=AZIMUTH_DEG, **survey),
        "tilt": SurveyedTilt(pad_tilt_deg=(0.0, 0.0), **survey),
        "uncertainty": FixUncertainty(yaw_deg=1.5, roll_pitch_deg=0.3, **nothing),
    }


def test_what_is_shared_and_what_is_new_make_the_whole_covariance():
    _, fixes = seen_with((0.3, 0.0, 0.5), frames=10, **_exact())
    shared = fixes[-1].shared
    vectors = [value for name, value in shared if name.endswith("_ned_m")]
    whole = np.reshape(fixes[-1].noise_covariance_ned_m2, (3, 3)) + sum(np.outer(one, one) for one in vectors)
    np.testing.assert_allclose(np.reshape(fixes[-1].covariance_ned_m2, (3, 3)), whole, atol=1e-6)


def test_a_pad_that_is_tilted_otherwise_than_surveyed_is_not_believed_and_complained_of():
    survey = BY_PRINT | {"tilt": SurveyedTilt(pad_tilt_deg=(8.0, 0.0))}
    node, fixes = seen_with((0.0, 0.0, 0.0), frames=30, **survey)
    assert all(fix.corrected == fix.raw for fix in fixes)
    (complaint,) = node.complaints(T0_NS)
    assert "tilted by -8." in complaint and "pad_tilt_deg" in complaint
    assert node.counters()["tilt_refused"] == len(fixes)


def test_pictures_that_scatter_more_than_they_claim_count_as_less():
    """The same pictures, of which one detector says how good they are and another boasts."""
    claims = {}
    for boast in (1.0, 4.0):
        node, random = geolocator(**BY_PRINT), np.random.default_rng(9)
        for frame in range(120):
            at_ns = T0_NS + frame * 33 * MS
            for time_ns in (at_ns - 10 * MS, at_ns + 5 * MS):
                tell(node, topics.VEHICLE_STATE, ASIDE.state(time_ns))
            marker = ASIDE.ippe_marker(random, 0.1)
            poses = [
                pose.model_copy(update={"covariance": tuple(value / boast**2 for value in pose.covariance)})
                for pose in marker.poses
            ]
            fix = show(node, marker.model_copy(update={"poses": tuple(poses)}), at_ns=at_ns)
        claims[boast] = np.linalg.norm(fix.shared.tilt_north_ned_m)
    assert claims[4.0] > 0.7 * claims[1.0]
