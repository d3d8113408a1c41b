"""The camera model agrees with OpenCV's, and undistortion undoes distortion."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.camera import PinholeCamera
from schemas.calibration import CameraCalibration

PAPER = CameraCalibration(
    at_ns=0, width_px=640, height_px=480, fx_px=293.35, fy_px=293.31, cx_px=319.64, cy_px=239.64,
    distortion=(16.44e-4, 35.89e-4, 6.35e-4, -6.35e-4, 100.7e-4),
)  # fmt: skip
"""The paper's camera (Table 2)."""

WIDE = PinholeCamera(640, 480, 300.0, 305.0, 318.0, 242.0, -0.28, 0.09, 1e-3, -5e-4, -0.012)
"""A lens with strong barrel distortion."""

cameras = st.sampled_from([PinholeCamera.from_calibration(PAPER), WIDE])
directions = st.lists(
    st.tuples(st.floats(-1.0, 1.0), st.floats(-0.8, 0.8), st.floats(0.2, 60.0)), min_size=1, max_size=20
)


@given(cameras, directions)
def test_projection_is_opencvs(camera, rays):
    points = np.array([(x * z, y * z, z) for x, y, z in rays])
    theirs, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, camera.distortion)
    np.testing.assert_allclose(camera.project(points), theirs.reshape(-1, 2), atol=1e-8)


@given(cameras, directions)
def test_undistortion_undoes_distortion(camera, rays):
    normalised = np.array([(x, y) for x, y, _ in rays])
    np.testing.assert_allclose(camera.undistorted(camera.pixels(normalised)), normalised, atol=1e-9)


def test_every_pixel_of_the_papers_camera_has_a_ray():
    camera = PinholeCamera.from_calibration(PAPER)
    u, v = np.meshgrid(np.arange(0.0, 640.0, 7.0), np.arange(0.0, 480.0, 7.0))
    pixels = np.column_stack((u.ravel(), v.ravel()))
    np.testing.assert_allclose(camera.pixels(camera.undistorted(pixels)), pixels, atol=1e-6)


def test_optical_axis_hits_the_principal_point():
    assert PinholeCamera.from_calibration(PAPER).project([(0, 0, 5)])[0] == pytest.approx((319.64, 239.64))


def test_points_not_in_front_of_the_camera_are_not_in_the_picture():
    pixels = PinholeCamera.from_calibration(PAPER).project([(1, 1, -5), (1, 1, 0), (0, 0, 1)])
    assert np.isnan(pixels[:2]).all()
    assert np.isfinite(pixels[2]).all()


def test_pixel_that_the_lens_cannot_make_has_no_ray():
    camera = PinholeCamera(640, 480, 300.0, 300.0, 320.0, 240.0, k1=-0.3)
    rays = camera.undistorted([(320.0 + 300.0 * 5.0, 240.0), (400.0, 240.0)])
    assert np.isnan(rays[0]).all()
    assert np.isfinite(rays[1]).all()


def test_no_points_are_no_trouble():
    assert PinholeCamera.from_calibration(PAPER).undistorted(np.empty((0, 2))).shape == (0, 2)
