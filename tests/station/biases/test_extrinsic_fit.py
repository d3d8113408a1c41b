"""The extrinsic fit: what is built wrongly is found from the corners, and what cannot be seen is said."""

import dataclasses
import math

import numpy as np
import pytest

from alight.geometry.camera import PinholeCamera
from alight.geometry.frames import CAMERA_IN_BODY_M, Q_BODY_GIMBAL_DOWN
from alight.geometry.rotation import quaternion_from_euler, quaternion_multiply
from station.biases.cylindrical_fit import FitError
from station.biases.extrinsic_fit import REFERENCE, fit_extrinsic
from station.biases.extrinsic_model import NAMES, PARAMETERS, BelievedCamera, predicted_px
from station.biases.sightings import Sightings, Track, unified

CAMERA = BelievedCamera(
    PinholeCamera(640, 480, 293.35, 293.31, 319.64, 239.64, 16.44e-4, 35.89e-4, 6.35e-4, -6.35e-4, 100.7e-4),
    Q_BODY_GIMBAL_DOWN,
    CAMERA_IN_BODY_M,
)
SQUARE = 0.5 * np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])
HEIGHTS_M = (4.0, 10.0, 18.0)


def installation(**changed):
    values = {parameter.name: parameter.nominal for parameter in PARAMETERS} | changed
    return np.array([values[name] for name in NAMES])


def hovers(truth, heights_m, noise_px=0.1, sway=1.0, frames=40):
    """Flights above and beside the pad, swaying; the corners as the camera that `truth` describes sees them."""
    random = np.random.default_rng(7)
    made = []
    for height_m in heights_m:
        for number, (n, e) in enumerate(((0.0, 0.0), (0.4, 0.4), (-0.4, 0.4), (0.4, -0.4), (-0.4, -0.4))):
            times_s = np.arange(-1.0, 10.0, 0.02)
            a = np.sin(2.0 * times_s + number) * math.radians(2.0) * sway
            b = np.cos(1.7 * times_s + height_m) * math.radians(2.0) * sway
            q = np.array([quaternion_from_euler(x, y, 1.1 * number) for x, y in zip(a, b, strict=True)])
            place = np.column_stack((n * height_m + 10 * a, e * height_m + 10 * b, np.full(len(a), -height_m)))
            captured_s = np.arange(frames) * 0.2
            blank = Sightings(
                captured_s, np.zeros((frames, 4, 2)), SQUARE, Track(times_s, place), Track(times_s, unified(q))
            )
            seen = predicted_px(truth, blank, CAMERA) + random.normal(0.0, noise_px, (frames, 4, 2))
            made.append(Sightings(captured_s, seen, SQUARE, blank.position, blank.attitude))
    return made


WRONG = installation(
    mount_roll_deg=1.0,
    mount_pitch_deg=-1.5,
    mount_yaw_deg=-4.0,
    forward_m=0.03,
    right_m=-0.02,
    focal_scale=1.004,
    pad_scale=0.975,
    pad_down_m=0.23,
    image_latency_s=0.06,
    pad_azimuth_deg=12.0,
)


@pytest.fixture(scope="module")
def fit():
    """To hovers that show everything."""
    return fit_extrinsic(hovers(WRONG, HEIGHTS_M), CAMERA)


def test_all_that_several_heights_show_is_recovered_within_three_sigmas(fit):
    assert fit.warnings() == []
    assert np.abs((fit.values - WRONG) / fit.sigmas).max() < 3.5
    assert fit.value("mount_yaw_deg") == pytest.approx(-4.0, abs=0.1)
    assert fit.value("pad_scale") == pytest.approx(0.975, abs=0.002)
    assert fit.value("image_latency_s") == pytest.approx(0.06, abs=0.005)
    assert fit.rms_px < 0.2 < fit.rms_before_px


def test_level_hovers_at_one_height_do_not_show_the_focal_length():
    fit = fit_extrinsic(hovers(WRONG, (10.0,), sway=0.0), CAMERA)
    said = [warning for warning in fit.warnings() if warning.startswith("focal_scale")]
    assert said
    assert "not told apart from" in said[0]
    assert fit.value("mount_yaw_deg") == pytest.approx(-4.0, abs=0.1)


def test_a_vehicle_that_stands_still_does_not_show_the_latency():
    fit = fit_extrinsic(hovers(WRONG, HEIGHTS_M, sway=0.0), CAMERA)
    assert any(warning.startswith("image_latency_s is not excited") for warning in fit.warnings())
    assert abs(fit.value("image_latency_s")) < 0.01


def test_gross_outliers_hardly_matter():
    flights = hovers(WRONG, HEIGHTS_M)
    for flight in flights:
        flight.corners_px[::20] += 40.0
    fit = fit_extrinsic(flights, CAMERA)
    assert fit.value("mount_yaw_deg") == pytest.approx(-4.0, abs=0.1)
    assert fit.value("pad_scale") == pytest.approx(0.975, abs=0.003)


def test_the_pads_own_height_and_azimuth_are_not_corrected(fit):
    extrinsic = fit.correction().extrinsic
    assert extrinsic.mount_yaw_deg == pytest.approx(-4.0, abs=0.1)
    assert "pad_down_m" not in type(extrinsic).model_fields


def with_compass_errors(flights, errors_deg):
    """The same flights by an autopilot whose heading is off, in each by an angle of its own."""
    made = []
    for flight, error_deg in zip(flights, errors_deg, strict=True):
        turn = quaternion_from_euler(0.0, 0.0, math.radians(error_deg))
        q = np.array([quaternion_multiply(turn, tuple(one)) for one in flight.attitude.values.tolist()])
        made.append(dataclasses.replace(flight, attitude=Track(flight.attitude.times_s, unified(q))))
    return made


COMPASS_DEG = np.random.default_rng(11).normal(0.0, 0.5, 15)


def test_of_compass_and_mount_level_hovers_show_the_sum_only_and_the_fit_says_how_unsure_that_leaves_the_mount():
    flights = with_compass_errors(hovers(WRONG, HEIGHTS_M, sway=0.0), COMPASS_DEG)
    found = fit_extrinsic(flights, CAMERA)
    apart_deg = found.heading_error_deg - found.heading_error_deg.mean()
    # Forty pictures of a marker of 16 pixels with 0.1 pixel of noise show how it is turned to 0.04 degrees: four sigmas.
    np.testing.assert_allclose(apart_deg, COMPASS_DEG - COMPASS_DEG.mean(), atol=0.16)
    sigma_deg = found.sigmas[NAMES.index("mount_yaw_deg")]
    assert 0.5 * 0.5 / math.sqrt(15) < sigma_deg < 2.0 * 0.5 / math.sqrt(15)
    assert abs(found.value("mount_yaw_deg") + 4.0) < 3.5 * sigma_deg


def test_the_pads_azimuth_does_not_depend_on_the_compass():
    """Where the pad is and how it is turned in the same picture are turned by the same compass."""
    found = fit_extrinsic(with_compass_errors(hovers(WRONG, HEIGHTS_M), COMPASS_DEG), CAMERA)
    assert found.value("pad_azimuth_deg") == pytest.approx(12.0, abs=0.05)


def test_few_recordings_leave_the_mount_as_unsure_as_a_compass_is():
    found = fit_extrinsic(with_compass_errors(hovers(WRONG, (10.0,), sway=0.0), COMPASS_DEG[:5]), CAMERA)
    assert found.sigmas[NAMES.index("mount_yaw_deg")] > 0.3


def test_with_the_references_attitude_hovers_at_one_height_show_the_mount():
    found = fit_extrinsic(hovers(WRONG, (10.0,), sway=0.2), CAMERA, attitude_errors=REFERENCE)
    assert found.value("mount_yaw_deg") == pytest.approx(-4.0, abs=0.02)
    assert found.value("pad_scale") == pytest.approx(0.975, abs=0.002)
    assert not found.heading_error_deg.any()


def test_too_few_frames_are_refused():
    with pytest.raises(FitError, match="frames show the pad"):
        fit_extrinsic(hovers(WRONG, (10.0,), frames=2)[:1], CAMERA)
