"""The covariance of a fix against Monte Carlo, with all errors of the chain at once, for each way to a fix."""

from dataclasses import replace

import numpy as np
import pytest
from geolocation_scene import CAMERA, HOME, MS, T0_NS, Scene, geolocator, show, tell

from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.rotation import quaternion_from_euler, quaternion_from_rotation_vector, quaternion_multiply
from schemas import topics
from schemas.fix import FixVerdict
from schemas.settings.geolocator import FixUncertainty, PadHeight

SAMPLES = 300
UNCERTAINTY = FixUncertainty(
    roll_pitch_deg=0.4, mount_roll_pitch_deg=0.3, yaw_deg=1.0, time_s=0.01, position_m=0.03, focal_fraction=0.004, principal_point_px=0.7,
    pad_size_px=0.2, acceleration_mps2=0.0, angular_acceleration_rps2=0.0,
)  # fmt: skip
ALTITUDE_SIGMA_M = 0.15
CORNER_SIGMA_PX = 0.15
SCENE = Scene(
    vehicle_ned_m=(3.0, -2.0, -8.0),
    q_ned_body=quaternion_from_euler(0.1, -0.15, 2.0),
    velocity_ned_mps=(2.0, -1.0, 0.8),
    rates_body_rps=(0.2, -0.1, 0.3),
)
ABOVE = Scene(vehicle_ned_m=(0.5, 0.5, -12.0))


class World:
    """One draw of all errors."""

    def __init__(self, scene, generator):
        self.scene, self.generator = scene, generator
        turned = quaternion_from_rotation_vector(np.radians(generator.normal(0.0, (0.3, 0.3, 0.0))))
        self.as_built = replace(scene, q_body_gimbal=quaternion_multiply(turned, scene.q_body_gimbal))
        stretch, moved = 1.0 + generator.normal(0.0, 0.004), generator.normal(0.0, 0.7, 2)
        self.camera = replace(
            CAMERA,
            fx_px=stretch * CAMERA.fx_px,
            fy_px=stretch * CAMERA.fy_px,
            cx_px=CAMERA.cx_px + moved[0],
            cy_px=CAMERA.cy_px + moved[1],
        )
        self.grown_px = generator.normal(0.0, 0.2)
        self.turn_rad = np.radians(generator.normal(0.0, (0.4, 0.4, 1.0)))
        self.late_s = generator.normal(0.0, 0.01)
        self.quick_m = generator.normal(0.0, 0.03, 3)
        self.solution_m = np.array((0.0, 0.0, generator.normal(0.0, ALTITUDE_SIGMA_M)))

    def state(self, at_ns):
        """What the vehicle says of itself."""
        scene, ahead_s = self.scene, (at_ns - T0_NS) * 1e-9 + self.late_s
        rates = quaternion_from_rotation_vector(tuple(w * ahead_s for w in scene.rates_body_rps))
        q = quaternion_multiply(
            quaternion_from_rotation_vector(self.turn_rad), quaternion_multiply(scene.q_ned_body, rates)
        )
        moved = np.array(scene.velocity_ned_mps) * ahead_s + self.quick_m + self.solution_m
        return scene.state(at_ns, position=moved_by_ned(scene.vehicle_position, moved), q_ned_body=q)

    def error_m(self, node):
        """Of the fix as a place in the navigation solution, and its covariance."""
        for at_ns in (T0_NS - 20 * MS, T0_NS + 10 * MS):
            tell(node, topics.VEHICLE_STATE, self.state(at_ns))
        fix = show(node, self.as_built.ippe_marker(self.generator, CORNER_SIGMA_PX, self.camera, self.grown_px))
        assert fix.verdict is FixVerdict.ACCEPTED, fix.detail
        called = moved_by_ned(HOME, self.solution_m)
        return ned_between(called, fix.corrected.position), np.reshape(fix.covariance_ned_m2, (3, 3))


@pytest.mark.parametrize("scene", [SCENE, ABOVE])
@pytest.mark.parametrize("method", ["pnp", "bearing", "fused"])
def test_all_errors_together_spread_as_predicted(method, scene):
    generator = np.random.default_rng(41)
    height = PadHeight(pad_altitude_amsl_m=HOME.altitude_amsl_m, sigma_m=ALTITUDE_SIGMA_M, gate_sigma=100.0)
    drawn = [
        World(scene, generator).error_m(geolocator(uncertainty=UNCERTAINTY, method=method, height=height))
        for _ in range(SAMPLES)
    ]
    errors = np.array([error for error, _ in drawn])
    claimed = np.mean([covariance for _, covariance in drawn], axis=0)
    scores = [error @ np.linalg.solve(covariance, error) for error, covariance in drawn]
    # The mean of 300 chi-square numbers of 3 degrees of freedom is 3 +- 0.47 at 99.9 %; a variance is known to 8 %.
    assert 2.53 < np.mean(scores) < 3.47
    seen = errors.T @ errors / len(errors)
    np.testing.assert_allclose(seen, claimed, atol=0.3 * np.diag(claimed).max())
    np.testing.assert_allclose(np.diag(seen), np.diag(claimed), rtol=0.35)
