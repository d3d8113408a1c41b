"""The setpoint's way down: straight, smooth, inside the funnel."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alight.geometry.local import moved_by_ned, ned_between
from alight.runtime.clock import nanoseconds
from schemas.message import GlobalPosition
from schemas.settings.commander import GlideSettings
from schemas.vehicle import VehicleState
from services.commander.glide import (
    LATE_S,
    MAX_STIFFENING_MPS,
    MAX_TRIM_MPS,
    Aim,
    Glide,
    Target,
    descent_speed_mps,
    freshness_of,
    funnel_radius_m,
)

ORIGIN = GlobalPosition(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=500.0, ellipsoidal_height_m=547.0)
SETTINGS = GlideSettings()
STEP_S = 0.02


def vehicle_at(place: GlobalPosition) -> VehicleState:
    return VehicleState(
        at_ns=0,
        position=place,
        velocity_ned_mps=(0.0, 0.0, 0.0),
        q_ned_body=(1.0, 0.0, 0.0, 0.0),
        angular_velocity_body_rps=(0.0, 0.0, 0.0),
    )


def flown(
    pads: list[tuple[float, float, float]], each_s: float, freshness: float = 1.0, sigma_m: float = 0.01
) -> list[Target]:
    """A vehicle that is always where the setpoint was, and a pad that is believed at one place after another."""
    glide = Glide(SETTINGS, ORIGIN, 0.0, 0)
    targets: list[Target] = []
    place, now_s = ORIGIN, 0.0
    for pad in pads:
        glide.aim(Aim(moved_by_ned(ORIGIN, pad), 1.0, sigma_m))
        for _ in range(round(each_s / STEP_S)):
            now_s += STEP_S
            targets.append(glide.advance(vehicle_at(place), freshness, True, nanoseconds(now_s)))
            place = targets[-1].position
    return targets


def path(targets: list[Target]) -> np.ndarray:
    return np.array([ned_between(ORIGIN, target.position) for target in targets])


def test_it_follows_the_straight_line_and_ends_above_the_pad() -> None:
    pad = np.array((-6.0, -6.0, 20.0))
    way = path(flown([tuple(pad)], 40.0))
    to_line_end = pad - (0.0, 0.0, SETTINGS.vertical_below_m)
    on_line = way[(way[:, 2] > 0.5) & (way[:, 2] < 0.8 * to_line_end[2])]
    beside = np.linalg.norm(np.cross(on_line, to_line_end / np.linalg.norm(to_line_end)), axis=1)
    assert beside.max() < 0.1
    assert way[-1][:2] == pytest.approx(pad[:2], abs=0.02)


places = st.tuples(st.floats(-15.0, 15.0), st.floats(-15.0, 15.0), st.floats(3.0, 25.0))


@settings(max_examples=25)
@given(st.lists(places, min_size=1, max_size=5), st.floats(0.0, 1.0))
def test_whatever_the_estimates_the_setpoint_never_jumps(
    pads: list[tuple[float, float, float]], freshness: float
) -> None:
    way = path(flown(pads, 1.0, freshness))
    velocity = np.diff(way, axis=0) / STEP_S
    assert np.linalg.norm(velocity, axis=1).max() < 4.0
    assert velocity[:, 2].min() > -0.02  # Never up.
    kink_mps = np.linalg.norm(np.diff(velocity, axis=0), axis=1).max()
    assert kink_mps < SETTINGS.acceleration_mps2 * STEP_S + 2 * MAX_TRIM_MPS


offsets = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-5.0, 5.0))


@given(offsets, st.floats(0.0, 5.0))
def test_wherever_the_vehicle_says_it_is_it_is_not_told_to_dash(
    offset: tuple[float, float, float], age_s: float
) -> None:
    """A position that jumps, as after a reset of the navigation filter, or one that is old."""
    glide = Glide(SETTINGS, ORIGIN, 0.0, nanoseconds(10.0))
    glide.aim(Aim(moved_by_ned(ORIGIN, (0.0, 0.0, 20.0)), None, 0.01))
    state = vehicle_at(moved_by_ned(ORIGIN, offset)).model_copy(update={"at_ns": nanoseconds(10.0 + STEP_S - age_s)})
    target = glide.advance(state, 1.0, True, nanoseconds(10.0 + STEP_S))
    added_mps = math.hypot(*target.velocity_ned_mps[:2])
    assert added_mps <= MAX_STIFFENING_MPS + 1e-9
    assert age_s < LATE_S or added_mps < 1e-9  # rounding of the setpoint's own place


def test_too_uncertain_it_does_not_go_down_and_counts_the_time() -> None:
    assert path(flown([(5.0, 0.0, 10.0)], 5.0, sigma_m=0.8))[-1][2] == pytest.approx(0.0, abs=1e-3)
    glide = Glide(SETTINGS, ORIGIN, 0.0, 0)
    glide.aim(Aim(moved_by_ned(ORIGIN, (5.0, 0.0, 10.0)), None, 0.8))
    for i in range(1, 101):
        glide.advance(vehicle_at(ORIGIN), 1.0, True, nanoseconds(i * STEP_S))
    assert glide.closed_for_s(nanoseconds(2.0)) == pytest.approx(2.0, abs=0.1)


def test_a_vehicle_that_cannot_follow_is_waited_for() -> None:
    glide = Glide(SETTINGS, ORIGIN, 0.0, 0)
    glide.aim(Aim(moved_by_ned(ORIGIN, (0.0, 0.0, 20.0)), None, 0.01))
    targets = [glide.advance(vehicle_at(ORIGIN), 1.0, True, nanoseconds(i * STEP_S)) for i in range(1, 500)]
    assert path(targets)[-1][2] < SETTINGS.leash_m + SETTINGS.descent_mps**2 / (2 * SETTINGS.acceleration_mps2) + 0.1


def test_until_the_autopilot_flies_it_the_setpoint_stays() -> None:
    glide = Glide(SETTINGS, ORIGIN, 0.7, 0)
    glide.aim(Aim(moved_by_ned(ORIGIN, (5.0, 0.0, 10.0)), 0.0, 0.01))
    target = [glide.advance(vehicle_at(ORIGIN), 1.0, False, nanoseconds(i * STEP_S)) for i in range(1, 100)][-1]
    assert ned_between(ORIGIN, target.position) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert target.velocity_ned_mps == (0.0, 0.0, 0.0)
    assert target.yaw_ned_rad == pytest.approx(0.7)


def test_touching_down_it_goes_down_whatever_comes_but_not_far_into_the_ground() -> None:
    glide = Glide(SETTINGS, ORIGIN, 0.0, 0)
    glide.aim(Aim(moved_by_ned(ORIGIN, (0.1, 0.0, 0.9)), None, 5.0))
    glide.touch_down()
    targets = [glide.advance(vehicle_at(ORIGIN), 0.0, True, nanoseconds(i * STEP_S)) for i in range(1, 400)]
    assert targets[-1].velocity_ned_mps[2] == pytest.approx(SETTINGS.touchdown_mps)
    assert path(targets)[-1][2] == pytest.approx(0.5, abs=0.02)


def test_a_pad_that_drifts_is_kept_up_with_but_not_on_the_ground() -> None:
    drift, now_s, place = (0.05, 0.0, 0.0), 0.0, ORIGIN
    glide = Glide(SETTINGS, ORIGIN, 0.0, 0)
    for _ in range(500):
        now_s += STEP_S
        pad = moved_by_ned(ORIGIN, (drift[0] * now_s, 0.0, 5.0))
        glide.aim(Aim(pad, None, 0.01, drift))
        place = glide.advance(vehicle_at(place), 1.0, True, nanoseconds(now_s)).position
    assert ned_between(place, pad)[0] == pytest.approx(0.0, abs=0.01)
    glide.touch_down()
    standing = vehicle_at(place)
    for _ in range(100):
        now_s += STEP_S
        target = glide.advance(standing, 1.0, True, nanoseconds(now_s))
    before = target.position
    for _ in range(100):
        now_s += STEP_S
        target = glide.advance(standing, 1.0, True, nanoseconds(now_s))
    assert ned_between(before, target.position)[0] == pytest.approx(0.0, abs=1e-3)


def test_the_heading_turns_the_short_way_at_its_rate() -> None:
    glide = Glide(SETTINGS, ORIGIN, math.radians(170), 0)
    glide.aim(Aim(moved_by_ned(ORIGIN, (0.0, 0.0, 10.0)), math.radians(-170), 0.01))
    yaws = [glide.advance(vehicle_at(ORIGIN), 1.0, True, nanoseconds(i * STEP_S)).yaw_ned_rad for i in range(1, 60)]
    assert yaws[-1] == pytest.approx(math.radians(-170), abs=1e-6)
    turns = [abs(math.remainder(b - a, math.tau)) for a, b in pairwise(yaws)]
    assert max(turns) <= math.radians(SETTINGS.yaw_rate_dps) * STEP_S + 1e-9


@given(st.floats(0.0, 100.0), st.floats(0.0, 20.0))
def test_lower_is_never_faster_and_the_funnel_never_wider(height: float, more: float) -> None:
    assert descent_speed_mps(SETTINGS, height) <= descent_speed_mps(SETTINGS, height + more)
    assert funnel_radius_m(SETTINGS, height) <= funnel_radius_m(SETTINGS, height + more)


def test_freshness_falls_to_nothing_at_the_limit() -> None:
    assert [freshness_of(age, 1.0) for age in (0.0, 0.4, 0.7, 1.0, 5.0)] == pytest.approx([1.0, 1.0, 0.5, 0.0, 0.0])


def test_a_pad_at_the_edge_of_the_view_is_brought_into_it_before_it_goes_down() -> None:
    """From (30, 20, -40) m a camera that looks down sees the pad in the corner of its picture, and no more once the vehicle leans."""
    pad = np.array((-30.0, -20.0, 40.0))
    way = path(flown([tuple(pad)], 60.0))
    above_line_end = way[way[:, 2] < pad[2] - SETTINGS.vertical_below_m]
    off_nadir_deg = np.degrees(np.arctan2(np.hypot(*(pad - above_line_end)[:, :2].T), pad[2] - above_line_end[:, 2]))
    assert above_line_end[off_nadir_deg > SETTINGS.view_edge_deg][:, 2].max() < 0.1
    assert (np.diff(off_nadir_deg) < 1e-3).all()
    assert way[-1][:2] == pytest.approx(pad[:2], abs=0.02)
