"""Rotations obey the laws of the rotation group, and the conventions of the frames."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from alight.geometry.rotation import (
    IDENTITY,
    R_from_quaternion,
    R_x,
    R_y,
    R_z,
    euler_from_quaternion,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_from_R,
    quaternion_from_rotation_vector,
    quaternion_multiply,
    quaternion_normalised,
    rotated,
    rotation_vector_from_quaternion,
    slerp,
    wrap_pi,
)

angles = st.floats(-10.0, 10.0)
components = st.floats(-1.0, 1.0)
vectors = st.tuples(*[st.floats(-100.0, 100.0)] * 3)


@st.composite
def unit_quaternions(draw):
    q = draw(st.tuples(components, components, components, components))
    assume(sum(x * x for x in q) > 1e-3)
    return quaternion_normalised(q)


def same_rotation(a, b):
    return abs(sum(x * y for x, y in zip(a, b, strict=True))) == pytest.approx(1.0, abs=1e-12)


@given(unit_quaternions(), unit_quaternions(), unit_quaternions())
def test_composition_is_associative_and_has_identity_and_inverse(a, b, c):
    left = quaternion_multiply(quaternion_multiply(a, b), c)
    assert left == pytest.approx(quaternion_multiply(a, quaternion_multiply(b, c)), abs=1e-12)
    assert quaternion_multiply(a, IDENTITY) == pytest.approx(a)
    assert quaternion_multiply(a, quaternion_conjugate(a)) == pytest.approx(IDENTITY, abs=1e-12)


@given(unit_quaternions(), unit_quaternions())
def test_quaternion_product_is_matrix_product(a, b):
    product = R_from_quaternion(a) @ R_from_quaternion(b)
    np.testing.assert_allclose(R_from_quaternion(quaternion_multiply(a, b)), product, atol=1e-12)


@given(unit_quaternions())
def test_matrices_are_proper_rotations(q):
    R = R_from_quaternion(q)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)


@given(unit_quaternions(), vectors)
def test_rotating_by_quaternion_and_by_matrix_agree(q, v):
    np.testing.assert_allclose(rotated(q, v), R_from_quaternion(q) @ np.array(v), atol=1e-10)


@given(unit_quaternions())
def test_matrix_round_trip(q):
    back = quaternion_from_R(R_from_quaternion(q))
    assert same_rotation(q, back)
    assert back[0] >= 0.0


@pytest.mark.parametrize("q", [(0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1), (0, 0.6, 0.8, 0), (0, 0, -0.6, 0.8)])
def test_matrix_round_trip_of_half_turns(q):
    assert same_rotation(q, quaternion_from_R(R_from_quaternion(q)))


@given(unit_quaternions())
def test_rotation_vector_round_trip(q):
    v = rotation_vector_from_quaternion(q)
    assert math.hypot(*v) <= math.pi + 1e-12
    assert same_rotation(q, quaternion_from_rotation_vector(v))


@given(st.tuples(*[st.floats(-1e-5, 1e-5)] * 3))
def test_tiny_rotation_vectors_survive(v):
    back = rotation_vector_from_quaternion(quaternion_from_rotation_vector(v))
    assert back == pytest.approx(v, abs=1e-16, rel=1e-9)


@given(angles, st.floats(-1.5, 1.5), angles)
def test_euler_angles_are_yaw_then_pitch_then_roll(roll, pitch, yaw):
    q = quaternion_from_euler(roll, pitch, yaw)
    np.testing.assert_allclose(R_from_quaternion(q), R_z(yaw) @ R_y(pitch) @ R_x(roll), atol=1e-12)
    back = euler_from_quaternion(q)
    for got, want in zip(back, (roll, pitch, yaw), strict=True):
        assert math.remainder(got - want, math.tau) == pytest.approx(0.0, abs=1e-8)


@given(angles, st.sampled_from([-math.pi / 2, math.pi / 2]), angles)
def test_euler_angles_straight_up_and_down_still_give_the_rotation(roll, pitch, yaw):
    q = quaternion_from_euler(roll, pitch, yaw)
    again = quaternion_from_euler(*euler_from_quaternion(q))
    np.testing.assert_allclose(R_from_quaternion(again), R_from_quaternion(q), atol=1e-6)


@given(unit_quaternions(), unit_quaternions(), st.floats(0.0, 1.0))
def test_slerp_turns_at_constant_rate_along_the_shorter_arc(q0, q1, fraction):
    def angle(a, b):
        return math.hypot(*rotation_vector_from_quaternion(quaternion_multiply(quaternion_conjugate(a), b)))

    middle = slerp(q0, q1, fraction)
    assert angle(q0, middle) == pytest.approx(fraction * angle(q0, q1), abs=1e-7)
    assert same_rotation(slerp(q0, q1, 0.0), q0)
    assert same_rotation(slerp(q0, q1, 1.0), q1)
    assert same_rotation(slerp(q0, [-x for x in q1], fraction), middle) or angle(q0, q1) > math.pi - 1e-6


@given(st.floats(-1e6, 1e6))
def test_wrapped_angles_point_the_same_way(angle):
    wrapped = wrap_pi(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@pytest.mark.parametrize("nonsense", [(0, 0, 0, 0), (math.nan, 0, 0, 1), (math.inf, 0, 0, 0)])
def test_what_is_no_rotation_is_refused(nonsense):
    with pytest.raises(ValueError, match="no rotation"):
        quaternion_normalised(nonsense)
