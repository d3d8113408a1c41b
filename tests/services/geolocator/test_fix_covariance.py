"""The covariance of a fix has the size of the errors that it stands for."""

import math

import numpy as np
import pytest
from geolocation_scene import MS, T0_NS, Scene, fly, geolocator, show, tell

from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.rotation import quaternion_from_euler, quaternion_from_rotation_vector, quaternion_multiply
from schemas import topics
from schemas.fix import FixVerdict
from schemas.settings.geolocator import FixUncertainty

NONE = FixUncertainty(
    roll_pitch_deg=0.0, yaw_deg=0.0, time_s=0.0, position_m=0.0, focal_fraction=0.0, principal_point_px=0.0, pad_size_px=0.0,
    acceleration_mps2=0.0, angular_acceleration_rps2=0.0,
)  # fmt: skip
SCENE = Scene(
    vehicle_ned_m=(4.0, -3.0, -12.0),
    q_ned_body=quaternion_from_euler(0.1, -0.15, 2.0),
    velocity_ned_mps=(3.0, 2.0, 1.0),
    rates_body_rps=(0.2, -0.1, 0.3),
)


def believed(scene=SCENE, error=None, **uncertainty):
    """The fix where the vehicle state is wrong by `error`: (rotation vector NED, time shift s, position shift NED)."""
    turn, shift_s, moved_m = error or ((0, 0, 0), 0.0, (0, 0, 0))
    node = geolocator(uncertainty=NONE.model_copy(update=uncertainty))
    for at_ns in (T0_NS - 20 * MS, T0_NS + 10 * MS):
        true = scene.state(at_ns)
        ahead_s = (at_ns - T0_NS) * 1e-9 + shift_s
        rates = quaternion_from_rotation_vector(tuple(w * ahead_s for w in scene.rates_body_rps))
        q = quaternion_multiply(quaternion_from_rotation_vector(turn), quaternion_multiply(scene.q_ned_body, rates))
        moved = np.array(moved_m) + np.array(scene.velocity_ned_mps) * shift_s
        position = moved_by_ned(true.position, moved)
        tell(node, topics.VEHICLE_STATE, true.model_copy(update={"position": position, "q_ned_body": q}))
    fix = show(node, scene.marker(scene.true_pose((1e-4,) * 6)))
    assert fix.verdict is FixVerdict.ACCEPTED
    return fix


def place_error(fix):
    return ned_between(believed().corrected.position, fix.corrected.position)


@pytest.mark.parametrize(
    ("uncertainty", "draw"),
    [
        ({"roll_pitch_deg": 1.0, "yaw_deg": 3.0}, lambda g: ((*g.normal(0, math.radians(1), 2), g.normal(0, math.radians(3))), 0.0, (0, 0, 0))),
        ({"time_s": 0.02}, lambda g: ((0, 0, 0), g.normal(0, 0.02), (0, 0, 0))),
        ({"position_m": 0.3}, lambda g: ((0, 0, 0), 0.0, g.normal(0, 0.3, 3))),
    ],
)  # fmt: skip
def test_errors_of_the_vehicle_state_spread_as_predicted(uncertainty, draw):
    generator = np.random.default_rng(16)
    errors = np.array([place_error(believed(error=draw(generator), **uncertainty)) for _ in range(300)])
    predicted = np.reshape(believed(**uncertainty).covariance_ned_m2, (3, 3))
    seen = errors.T @ errors / len(errors)
    # 300 samples know a variance to 8 %: 0.3 is almost four of these.
    np.testing.assert_allclose(seen, predicted, atol=0.3 * np.diag(predicted).max())
    assert np.trace(seen) == pytest.approx(np.trace(predicted), rel=0.3)


@pytest.mark.parametrize("scene", [SCENE, Scene(vehicle_ned_m=(1.0, 1.0, -5.0))])
def test_corner_noise_spreads_as_predicted(scene):
    generator = np.random.default_rng(4)
    scores = []
    for _ in range(200):
        node = geolocator(uncertainty=NONE)
        fly(node, scene, -20, 10)
        fix = show(node, scene.ippe_marker(generator, 0.2))
        assert fix.verdict is FixVerdict.ACCEPTED
        error = np.subtract(fix.raw.pad_ned_m, scene.pad_from_vehicle_m)
        scores.append(error @ np.linalg.solve(np.reshape(fix.covariance_ned_m2, (3, 3)), error))
    # The mean of 200 chi-square numbers of 3 degrees of freedom is 3 +- 0.57 at 99.9 %.
    assert 2.43 < np.mean(scores) < 3.57


def test_focal_length_acts_along_the_line_of_sight_and_the_principal_point_across():
    scene = Scene(vehicle_ned_m=(0.0, 0.0, -10.0))

    def spread(**uncertainty):
        node = geolocator(uncertainty=NONE.model_copy(update=uncertainty))
        fly(node, scene, -20, 10)
        return np.sqrt(
            np.diag(np.reshape(show(node, scene.marker(scene.true_pose((1e-5,) * 6))).covariance_ned_m2, (3, 3)))
        )

    assert spread(focal_fraction=0.01) == pytest.approx((0.0, 0.0, 0.099), abs=1e-4)
    assert spread(principal_point_px=2.0) == pytest.approx((2 * 9.9 / 293.3, 2 * 9.9 / 293.3, 0.0), abs=1e-4)


def test_clock_uncertainty_of_the_link_counts():
    def trace(clock_s):
        node = geolocator(uncertainty=NONE)
        for at_ns in (T0_NS - 20 * MS, T0_NS + 10 * MS):
            tell(node, topics.VEHICLE_STATE, SCENE.state(at_ns, clock_uncertainty_s=clock_s))
        return np.trace(np.reshape(show(node, SCENE.marker(SCENE.true_pose((1e-4,) * 6))).covariance_ned_m2, (3, 3)))

    assert trace(0.05) > trace(0.0) + (0.05 * 3.0) ** 2
