"""The extrinsic correction: a camera that is installed wrongly, with a print of the wrong size, still gives the true place."""

import math

import numpy as np
import pytest
from geolocation_scene import MS, T0_NS, Scene, fly, geolocator, show
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.local import ned_between
from alight.geometry.rotation import quaternion_from_euler, quaternion_multiply
from schemas.settings import Settings
from schemas.settings.geolocator import Correction, Extrinsic, PoseLookup
from services.geolocator.correction_file import CorrectionFileError, read_correction
from services.geolocator.service import build

DOWN = quaternion_from_euler(0.0, -math.pi / 2, 0.0)
degrees = st.floats(-5.0, 5.0)


def corrected_by(**extrinsic):
    return geolocator(correction=Correction(method="extrinsic", extrinsic=Extrinsic(**extrinsic)))


@given(degrees, degrees, degrees)
def test_a_turned_mount_is_undone_in_the_corrected_place_only(roll_deg, pitch_deg, yaw_deg):
    turned = quaternion_from_euler(math.radians(roll_deg), math.radians(pitch_deg), math.radians(yaw_deg))
    scene = Scene(q_body_gimbal=quaternion_multiply(turned, DOWN), pad_azimuth_rad=0.4)
    node = corrected_by(mount_roll_deg=roll_deg, mount_pitch_deg=pitch_deg, mount_yaw_deg=yaw_deg)
    fly(node, scene, -20, 10)
    fix = show(node, scene.marker())
    np.testing.assert_allclose(fix.corrected.pad_ned_m, scene.pad_from_vehicle_m, atol=1e-6)
    assert fix.corrected.azimuth_rad == pytest.approx(0.4, abs=1e-6)
    plain = geolocator()
    fly(plain, scene, -20, 10)
    assert fix.raw == show(plain, scene.marker()).raw


def test_a_print_that_is_smaller_than_believed_is_nearer():
    scene = Scene()
    node = corrected_by(pad_scale=0.975, down_m=0.0)
    fly(node, scene, -20, 10)
    lever = np.array([0.0, 0.0, 0.1])
    expected = 0.975 * (np.array(scene.pad_from_vehicle_m) - lever) + lever
    np.testing.assert_allclose(show(node, scene.marker()).corrected.pad_ned_m, expected, atol=1e-6)


def test_a_longer_focal_length_and_a_lower_camera_change_the_height_only():
    scene = Scene()
    node = corrected_by(focal_scale=1.01, down_m=0.05)
    fly(node, scene, -20, 10)
    north, east, down = scene.pad_from_vehicle_m
    expected = (north, east, (down - 0.1) * 1.01 + 0.15)
    np.testing.assert_allclose(show(node, scene.marker()).corrected.pad_ned_m, expected, atol=1e-6)


def test_late_stamps_are_put_back_to_the_light():
    flying = Scene(velocity_ned_mps=(5.0, -3.0, 1.0))
    node = corrected_by(image_latency_s=0.08)
    fly(node, flying, -100, -60, -20, 10)
    # The picture shows the scene at T0 minus 80 ms, and says T0.
    earlier = Scene(vehicle_ned_m=(1.0 - 0.4, -2.0 + 0.24, -10.0 - 0.08))
    fix = show(node, earlier.marker())
    assert fix.captured_at_ns == T0_NS
    np.testing.assert_allclose(fix.corrected.pad_ned_m, earlier.pad_from_vehicle_m, atol=1e-6)
    assert np.linalg.norm(np.subtract(fix.raw.position.altitude_amsl_m, fix.corrected.position.altitude_amsl_m)) > 0.05


def test_the_delay_that_the_settings_give_counts_without_any_correction_and_the_corrections_own_before_it():
    flying = Scene(velocity_ned_mps=(5.0, -3.0, 1.0))
    earlier = Scene(vehicle_ned_m=(1.0 - 0.4, -2.0 + 0.24, -10.0 - 0.08))
    plain = geolocator(lookup=PoseLookup(image_latency_s=0.08))
    fly(plain, flying, -100, -60, -20, 10)
    fix = show(plain, earlier.marker())
    assert fix.captured_at_ns == T0_NS and fix.raw == fix.corrected
    np.testing.assert_allclose(fix.raw.pad_ned_m, earlier.pad_from_vehicle_m, atol=1e-6)
    assert np.linalg.norm(ned_between(fix.vehicle_position, flying.state(T0_NS - 80 * MS).position)) < 1e-6
    both = geolocator(
        lookup=PoseLookup(image_latency_s=0.05),
        correction=Correction(method="extrinsic", extrinsic=Extrinsic(image_latency_s=0.08)),
    )
    fly(both, flying, -100, -60, -20, 10)
    fix = show(both, earlier.marker())
    assert np.linalg.norm(ned_between(fix.vehicle_position, flying.state(T0_NS - 80 * MS).position)) < 1e-6
    later_m = fix.raw.position.altitude_amsl_m - fix.corrected.position.altitude_amsl_m
    assert later_m == pytest.approx(-0.03, abs=1e-6), "raw by the settings' 50 ms, corrected by its own 80 ms"


def test_a_correction_is_read_from_a_file(tmp_path):
    path = tmp_path / "correction.toml"
    path.write_text('version = 1\n[correction]\nmethod = "extrinsic"\n[correction.extrinsic]\nmount_yaw_deg = -4.0\n')
    assert read_correction(path).extrinsic.mount_yaw_deg == -4.0
    settings = Settings.model_validate({"geolocator": {"correction_file": str(path)}})
    assert build(settings) is not None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('version = 2\n[correction]\nmethod = "none"\n', "version 2"),
        ("version = 1\n", "correction"),
        ('version = 1\n[correction]\nmethod = "guess"\n', "correction.method"),
        ("version = \n", "not valid TOML"),
    ],
)
def test_a_file_that_is_wrong_stops_the_geolocator_with_the_reason(tmp_path, text, said):
    path = tmp_path / "correction.toml"
    path.write_text(text)
    with pytest.raises(CorrectionFileError, match=said) as refused:
        build(Settings.model_validate({"geolocator": {"correction_file": str(path)}}))
    assert str(path) in str(refused.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(CorrectionFileError, match="No such file"):
        read_correction(tmp_path / "none.toml")
