"""Geodesy agrees with an independent library over the globe, and with itself."""

import math

import numpy as np
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.geodesy import (
    R_ecef_ned,
    ecef_from_geodetic,
    ecef_of_point,
    geodetic_from_ecef,
    geodetic_of_point,
    ned_axes_in_ecef,
)
from alight.geometry.rotation import R_z

latitudes = st.floats(-90.0, 90.0)
longitudes = st.floats(-180.0, 180.0)
heights = st.floats(-1e4, 1e5)


def globe(count=20_000):
    generator = np.random.default_rng(1994)
    latitude = np.degrees(np.arcsin(generator.uniform(-1.0, 1.0, count)))
    longitude = generator.uniform(-180.0, 180.0, count)
    height = generator.uniform(-1e4, 1e5, count)
    special = np.array([(a, o, h) for a in (-90, -89.9999999, -1e-9, 0, 45, 89.9999999, 90)
                        for o in (-180, -179.9999999, -90, 0, 90, 180) for h in (-1e4, 0, 1e5)], float)  # fmt: skip
    return tuple(np.concatenate(pair) for pair in zip((latitude, longitude, height), special.T, strict=True))


def test_ecef_agrees_with_pymap3d_to_a_micrometre():
    latitude, longitude, height = globe()
    theirs = np.stack(pymap3d.geodetic2ecef(latitude, longitude, height), axis=-1)
    np.testing.assert_allclose(ecef_from_geodetic(latitude, longitude, height), theirs, rtol=0, atol=1e-6)


def test_zhu_agrees_with_pymap3d_over_the_globe():
    x, y, z = pymap3d.geodetic2ecef(*globe())
    latitude, longitude, height = geodetic_from_ecef(np.stack((x, y, z), axis=-1))
    their_latitude, their_longitude, their_height = pymap3d.ecef2geodetic(x, y, z)
    np.testing.assert_allclose(latitude, their_latitude, rtol=0, atol=1e-9)
    np.testing.assert_allclose(height, their_height, rtol=0, atol=1e-6)
    turn = np.remainder(longitude - their_longitude + 180.0, 360.0) - 180.0
    np.testing.assert_allclose(turn[np.hypot(x, y) > 1e-6], 0.0, rtol=0, atol=1e-9)


def test_zhu_returns_where_it_came_from():
    latitude, longitude, height = globe()
    back = geodetic_from_ecef(ecef_from_geodetic(latitude, longitude, height))
    np.testing.assert_allclose(back[0], latitude, rtol=0, atol=1e-9)
    np.testing.assert_allclose(back[2], height, rtol=0, atol=1e-6)
    turn = np.remainder(back[1] - longitude + 180.0, 360.0) - 180.0
    np.testing.assert_allclose(turn[np.abs(latitude) < 90.0], 0.0, rtol=0, atol=1e-9)


@given(latitudes, longitudes, heights)
def test_one_point_and_arrays_agree(latitude, longitude, height):
    point = ecef_of_point(latitude, longitude, height)
    np.testing.assert_allclose(point, ecef_from_geodetic(latitude, longitude, height), rtol=0, atol=1e-8)
    for one, many in zip(geodetic_of_point(*point), geodetic_from_ecef(point), strict=True):
        assert one == pytest.approx(float(many), abs=1e-8)


@pytest.mark.parametrize("longitude", [-135.0, -45.0, 45.0, 135.0, 180.0])
def test_longitude_keeps_its_quadrant(longitude):
    assert geodetic_of_point(*ecef_of_point(40.0, longitude, 100.0))[1] == pytest.approx(longitude, abs=1e-9)


@pytest.mark.parametrize("latitude", [-90.0, 90.0])
def test_poles(latitude):
    back, _, height = geodetic_of_point(*ecef_of_point(latitude, 12.0, 321.0))
    assert back == pytest.approx(latitude, abs=1e-9)
    assert height == pytest.approx(321.0, abs=1e-6)


def test_shapes_are_kept():
    p = ecef_from_geodetic(np.zeros((2, 5)), 0.0, np.arange(5.0))
    assert p.shape == (2, 5, 3)
    assert all(part.shape == (2, 5) for part in geodetic_from_ecef(p))


@given(latitudes, longitudes)
def test_local_axes_are_the_derivatives_of_position(latitude, longitude):
    R = R_ecef_ned(latitude, longitude)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    up = np.subtract(ecef_of_point(latitude, longitude, 1000.0), ecef_of_point(latitude, longitude, 0.0)) / 1000.0
    np.testing.assert_allclose(R[:, 2], -up, atol=1e-9)
    if abs(latitude) < 89.0:
        east = np.subtract(ecef_of_point(latitude, longitude + 1e-5, 0), ecef_of_point(latitude, longitude - 1e-5, 0))
        np.testing.assert_allclose(R[:, 1], east / np.linalg.norm(east), atol=1e-6)


@given(latitudes, longitudes, st.floats(-180.0, 180.0))
def test_turning_the_earth_about_its_axis_is_adding_to_the_longitude(latitude, longitude, more_deg):
    """The group of rotations about the axis: ECEF coordinates turn, latitude and height stay, over the antimeridian too."""
    turned = R_z(math.radians(more_deg)) @ ecef_of_point(latitude, longitude, 100.0)
    np.testing.assert_allclose(turned, ecef_of_point(latitude, longitude + more_deg, 100.0), rtol=0, atol=1e-6)
    back = geodetic_of_point(*turned)
    assert back[0] == pytest.approx(latitude, abs=1e-9)
    assert back[2] == pytest.approx(100.0, abs=1e-6)


@given(latitudes, longitudes, heights)
def test_north_and_south_are_mirrors(latitude, longitude, height):
    x, y, z = ecef_of_point(latitude, longitude, height)
    np.testing.assert_allclose(ecef_of_point(-latitude, longitude, height), (x, y, -z), rtol=0, atol=1e-9)
    assert geodetic_of_point(x, y, -z)[0] == pytest.approx(-geodetic_of_point(x, y, z)[0], abs=1e-12)


@given(latitudes, longitudes, latitudes, longitudes)
def test_frames_of_two_places_compose(latitude_a, longitude_a, latitude_b, longitude_b):
    """R_a_b = R_ecef_a^T R_ecef_b is a rotation, its inverse leads back, and a way over a third place is the direct one."""
    A, B, C = R_ecef_ned(latitude_a, longitude_a), R_ecef_ned(latitude_b, longitude_b), R_ecef_ned(12.0, 34.0)
    np.testing.assert_allclose((A.T @ B) @ (B.T @ A), np.eye(3), atol=1e-12)
    np.testing.assert_allclose((A.T @ C) @ (C.T @ B), A.T @ B, atol=1e-12)
    np.testing.assert_allclose(np.reshape(ned_axes_in_ecef(latitude_a, longitude_a), (3, 3)), A, atol=0)


@pytest.mark.parametrize("nonsense", [(0.0, 0.0, 0.0), (math.nan, 0.0, 7e6), (math.inf, 0.0, 0.0)])
def test_points_that_have_no_place_are_refused(nonsense):
    with pytest.raises(ValueError, match="centre"):
        geodetic_of_point(*nonsense)
    with pytest.raises(ValueError, match="centre"):
        geodetic_from_ecef([nonsense])
