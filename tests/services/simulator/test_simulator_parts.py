"""The parts of the simulator by themselves: the map, the body, the mixer, the smoothing, the noise."""

import math
import statistics

import numpy as np
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from schemas.settings.simulator import SimulatorSettings
from services.simulator.autopilot.attitude_control import attitude_for, mix
from services.simulator.autopilot.position_control import bounded_sum
from services.simulator.autopilot.trajectory import Axis, Limits, SmoothPath
from services.simulator.body import GRAVITY_MPS2, HOVER_COMMAND, Body
from services.simulator.noise import GaussMarkov, Normals
from services.simulator.world import World

ORDINARY = st.floats(-20.0, 20.0)
LIMITS = Limits(3.0, 4.0, 2.0)


@pytest.mark.parametrize(("away_m", "tolerance_m"), [(50.0, 1e-3), (500.0, 0.05)])
def test_the_map_agrees_with_an_independent_geodesy(away_m, tolerance_m):
    world = World.from_settings(SimulatorSettings())
    for angle in np.linspace(0.0, 2.0 * math.pi, 12):
        north_m, east_m = away_m * math.cos(angle), away_m * math.sin(angle)
        latitude_deg, longitude_deg = world.degrees(north_m, east_m)
        n, e, d = pymap3d.geodetic2ned(
            latitude_deg,
            longitude_deg,
            world.altitude_amsl_m,
            world.latitude_deg,
            world.longitude_deg,
            world.altitude_amsl_m,
        )
        assert (n, e, d) == pytest.approx((north_m, east_m, 0.0), abs=tolerance_m)
        assert world.metres(latitude_deg, longitude_deg) == pytest.approx((north_m, east_m), abs=1e-6)


def test_the_geoid_separation_goes_into_the_ellipsoidal_height():
    world = World.from_settings(SimulatorSettings(home={"geoid_separation_m": 47.0}))
    place = world.global_position(0.0, 0.0, -10.0)
    assert place.ellipsoidal_height_m - place.altitude_amsl_m == pytest.approx(47.0)


def hovering(wind_drag: float = 1.0) -> Body:
    body = Body((0.0, 0.0, -10.0), 0.0, wind_drag, 0.2)
    body.hover()
    return body


def test_hover_thrust_hovers_and_wind_carries_the_body_along():
    body = hovering()
    for _ in range(2500):
        body.step((HOVER_COMMAND,) * 4, (2.0, -1.0, 0.0), 0.0, 0.004)
    assert body.down_m == pytest.approx(-10.0, abs=0.01)
    assert (body.vn, body.ve) == pytest.approx((2.0, -1.0), abs=1e-3)


def test_without_thrust_it_falls_as_drag_allows():
    body = Body((0.0, 0.0, -10.0), 0.0, 1.0, 0.2)
    for _ in range(125):
        body.step((0.0,) * 4, (0.0, 0.0, 0.0), 0.0, 0.004)
    assert body.vd == pytest.approx(GRAVITY_MPS2 * (1.0 - math.exp(-0.5)), rel=0.01)


@pytest.mark.parametrize(
    ("motors", "sign_p", "sign_q", "sign_r"),
    [((0.4, 0.6, 0.6, 0.4), 1, 0, 0), ((0.6, 0.4, 0.6, 0.4), 0, 1, 0), ((0.6, 0.6, 0.4, 0.4), 0, 0, 1)],
)
def test_rotors_turn_the_body_the_way_the_mixer_thinks(motors, sign_p, sign_q, sign_r):
    body = hovering()
    for _ in range(10):
        body.step(motors, (0.0, 0.0, 0.0), 0.0, 0.004)
    assert [round(math.copysign(1, v)) if abs(v) > 1e-6 else 0 for v in (body.p, body.q, body.r)] == [
        sign_p,
        sign_q,
        sign_r,
    ]
    assert mix(0.5, 0.1, 0.0, 0.0)[1] > 0.5 > mix(0.5, 0.1, 0.0, 0.0)[0]
    assert mix(0.5, 0.0, 0.1, 0.0)[0] > 0.5 > mix(0.5, 0.0, 0.1, 0.0)[1]
    assert mix(0.5, 0.0, 0.0, 0.1)[0] > 0.5 > mix(0.5, 0.0, 0.0, 0.1)[2]


@given(st.floats(0.0, 1.0), ORDINARY, ORDINARY, ORDINARY)
def test_the_mixer_never_asks_a_rotor_for_what_it_cannot_give(thrust, roll, pitch, yaw):
    assert all(0.0 <= command <= 1.0 + 1e-9 for command in mix(thrust, roll, pitch, yaw))


@given(ORDINARY, ORDINARY, st.floats(-20.0, -0.5), st.floats(-3.1, 3.1))
def test_the_attitude_for_a_thrust_has_its_up_axis_along_it(north, east, down, yaw):
    (w, x, y, z), length = attitude_for((north, east, down), yaw)
    up = (-2 * (x * z + w * y) * length, -2 * (y * z - w * x) * length, -(1 - 2 * (x * x + y * y)) * length)
    assert up == pytest.approx((north, east, down), abs=1e-6 * length + 1e-9)
    assert w * w + x * x + y * y + z * z == pytest.approx(1.0)


@given(ORDINARY, ORDINARY, ORDINARY, ORDINARY, st.floats(0.5, 15.0))
def test_a_bounded_sum_stays_within_its_bound(first_n, first_e, second_n, second_e, bound):
    total = math.hypot(*bounded_sum(first_n, first_e, second_n, second_e, bound))
    assert total <= bound * (1.0 + 1e-6)
    assert total == pytest.approx(min(total, math.hypot(first_n + second_n, first_e + second_e)))


@given(st.lists(st.floats(-12.0, 12.0), min_size=1, max_size=6))
def test_a_smooth_axis_keeps_its_jerk_and_acceleration(targets):
    axis = Axis()
    for target in targets:
        for _ in range(100):
            before = axis.a
            axis.advance(target, LIMITS, 0.02)
            assert abs(axis.a) <= LIMITS.acceleration_mps2 + 1e-9
            assert abs(axis.a - before) <= LIMITS.jerk_mps3 * 0.02 + 1e-9


@given(st.floats(-60.0, 60.0), st.floats(-60.0, 60.0))
def test_a_smooth_path_arrives_without_overshoot(north, east):
    path = SmoothPath()
    distance = math.hypot(north, east)
    for _ in range(3000):
        at = (path.north.x, path.east.x)
        path.advance_horizontally((north, east), at, 5.0, LIMITS, 0.02)
        assert math.hypot(path.north.v, path.east.v) < 5.3
        assert math.hypot(path.north.x, path.east.x) < distance + 0.25
    assert (path.north.x, path.east.x) == pytest.approx((north, east), abs=0.1)


def test_a_path_waits_for_a_vehicle_that_does_not_follow():
    path = SmoothPath()
    for _ in range(3000):
        path.advance_horizontally((50.0, 0.0), (0.0, 0.0), 5.0, LIMITS, 0.02)
    assert path.north.x <= LIMITS.lag_m + 0.01


def test_gauss_markov_noise_has_its_spread_and_its_memory():
    process = GaussMarkov(Normals(np.random.default_rng(7)), 0.5, 2.0, 0.1)
    samples = []
    for _ in range(40_000):
        process.advance()
        samples.append(process.value)
    assert statistics.pstdev(samples) == pytest.approx(0.5, rel=0.1)
    later = np.corrcoef(samples[:-20], samples[20:])[0, 1]
    assert later == pytest.approx(math.exp(-1.0), abs=0.08)
