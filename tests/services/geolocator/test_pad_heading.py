"""The pad's print as a compass: with a surveyed azimuth the heading's error is taken out of fixes, and said to be."""

import math

import numpy as np
import pytest
from geolocation_scene import MS, T0_NS, Scene, geolocator, show, tell

from alight.geometry.rotation import quaternion_from_euler, quaternion_multiply
from schemas import topics
from schemas.settings.geolocator import FixUncertainty, SurveyedHeading

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
    assert off_m(fixes[-1]) < 0.05 * without_m
    assert fixes[-1].corrected.azimuth_rad == pytest.approx(SCENE.pad_azimuth_rad, abs=1e-3)
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
    heading = np.array(aided[-1].shared.heading_ned_m)
    np.testing.assert_allclose(
        before - after,
        np.outer(plain[-1].shared.heading_ned_m, plain[-1].shared.heading_ned_m) - np.outer(heading, heading),
        atol=1e-6,
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
