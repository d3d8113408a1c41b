"""The chain of frames: which way the camera looks, and where a seen point is."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.azimuth import azimuth_from_body, azimuth_of, pad_azimuth, yaw_of
from alight.geometry.frames import (
    CAMERA_IN_BODY_M,
    Q_BODY_GIMBAL_DOWN,
    R_SOCKET_CAMERA,
    R_body_camera,
    body_from_camera,
    camera_from_ned,
    ned_from_camera,
    q_body_camera,
)
from alight.geometry.rotation import (
    R_from_quaternion,
    R_x,
    R_z,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_multiply,
    rotated,
)

angles = st.floats(-math.pi, math.pi)
points = st.tuples(*[st.floats(-50.0, 50.0)] * 3)
attitudes = st.builds(quaternion_from_euler, angles, st.floats(-1.5, 1.5), angles)


def test_socket_axes():
    np.testing.assert_allclose(R_SOCKET_CAMERA @ (0, 0, 1), (1, 0, 0))
    np.testing.assert_allclose(R_SOCKET_CAMERA @ (1, 0, 0), (0, 1, 0))
    np.testing.assert_allclose(R_SOCKET_CAMERA @ (0, 1, 0), (0, 0, 1))
    np.testing.assert_allclose(R_SOCKET_CAMERA, R_z(math.pi / 2) @ R_x(math.pi / 2), atol=1e-15)


def test_camera_that_looks_down_sees_forward_at_the_top_and_right_at_the_right():
    assert rotated(q_body_camera(), (0, 0, 1)) == pytest.approx((0, 0, 1), abs=1e-15)
    assert rotated(q_body_camera(), (0, -1, 0)) == pytest.approx((1, 0, 0), abs=1e-15)
    assert rotated(q_body_camera(), (1, 0, 0)) == pytest.approx((0, 1, 0), abs=1e-15)
    np.testing.assert_allclose(R_from_quaternion(q_body_camera()), R_body_camera(), atol=1e-15)


def test_pad_ahead_of_a_vehicle_that_heads_east_lies_east():
    east = quaternion_from_euler(0.0, 0.0, math.pi / 2)
    assert ned_from_camera((0.0, -2.0, 10.0), east) == pytest.approx((0.0, 2.0, 10.1), abs=1e-12)


def test_pad_in_the_middle_of_the_picture_while_pitching_up_lies_ahead():
    nose_up = quaternion_from_euler(0.0, math.radians(10), 0.0)
    north, east, down = ned_from_camera((0.0, 0.0, 10.0), nose_up)
    assert (north, east) == pytest.approx((10.1 * math.sin(math.radians(10)), 0.0))
    assert down == pytest.approx(10.1 * math.cos(math.radians(10)))


@given(points, attitudes, attitudes, points)
def test_chain_is_equation_1_and_has_an_inverse(p_camera, q_ned_body, q_body_gimbal, offset):
    p_ned = ned_from_camera(p_camera, q_ned_body, q_body_gimbal, offset)
    body = np.array(offset) + R_from_quaternion(q_body_gimbal) @ (R_SOCKET_CAMERA @ np.array(p_camera))
    np.testing.assert_allclose(p_ned, R_from_quaternion(q_ned_body) @ body, atol=1e-10)
    np.testing.assert_allclose(camera_from_ned(p_ned, q_ned_body, q_body_gimbal, offset), p_camera, atol=1e-10)


@given(points)
def test_lever_arm_is_the_cameras_place(p_camera):
    np.testing.assert_allclose(body_from_camera((0, 0, 0)), CAMERA_IN_BODY_M)
    np.testing.assert_allclose(
        body_from_camera(p_camera, Q_BODY_GIMBAL_DOWN, (0, 0, 0)), rotated(q_body_camera(), p_camera)
    )


@pytest.mark.parametrize(
    ("ned", "azimuth"), [((1, 0, 5), 0.0), ((0, 1, 0), math.pi / 2), ((-1, 0, 0), math.pi), ((0, -1, 0), -math.pi / 2)]
)
def test_azimuths_are_counted_from_north_clockwise(ned, azimuth):
    assert azimuth_of(ned) == pytest.approx(azimuth)


@given(angles, angles)
def test_pad_azimuth_is_heading_plus_orientation_in_the_body_frame(yaw, pad_in_body):
    # A print on the ground whose upward direction points to body azimuth `pad_in_body`: x right, y up, z to the sky.
    q_body_marker = quaternion_multiply(
        quaternion_from_euler(0.0, 0.0, pad_in_body), quaternion_from_euler(math.pi, 0.0, math.pi / 2)
    )
    q_ned_body = quaternion_from_euler(0.0, 0.0, yaw)
    got = pad_azimuth(quaternion_multiply(q_ned_body, q_body_marker))
    assert math.remainder(got - azimuth_from_body(yaw, pad_in_body), math.tau) == pytest.approx(0.0, abs=1e-9)
    assert math.remainder(yaw_of(q_ned_body) - yaw, math.tau) == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(rotated(q_body_marker, (0, 0, 1)), (0, 0, -1), atol=1e-12)


@given(attitudes, attitudes)
def test_camera_turns_with_the_body(q_ned_body, turn):
    q_turned = quaternion_multiply(turn, q_ned_body)
    axis = rotated(quaternion_multiply(q_turned, q_body_camera()), (0, 0, 1))
    back = rotated(quaternion_conjugate(turn), axis)
    np.testing.assert_allclose(back, rotated(quaternion_multiply(q_ned_body, q_body_camera()), (0, 0, 1)), atol=1e-12)
