"""The delay between stamps and light is found from how the pad moves in the picture; flights that do not show it are refused."""

import dataclasses
import math

import numpy as np
import pytest

from alight.geometry.camera import PinholeCamera
from alight.geometry.frames import CAMERA_IN_BODY_M, Q_BODY_GIMBAL_DOWN
from alight.geometry.rotation import quaternion_from_euler
from station.biases.extrinsic_model import NAMES, PARAMETERS, BelievedCamera, predicted_px
from station.biases.sightings import Sightings, Track, unified
from station.delays.delay_fit import MAX_SIGMA_S, DelayError, Motion, check_agreement, fit_delay
from station.delays.high_pass import high_passed
from station.delays.smoothing import smoothed

CAMERA = BelievedCamera(
    PinholeCamera(640, 480, 293.35, 293.31, 319.64, 239.64, 16.44e-4, 35.89e-4, 6.35e-4, -6.35e-4, 100.7e-4),
    Q_BODY_GIMBAL_DOWN,
    CAMERA_IN_BODY_M,
)
SQUARE = 0.5 * np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])


def coloured(random, count, sigma, time_s, step_s):
    """A Gauss-Markov process."""
    keep = math.exp(-step_s / time_s)
    values = np.empty(count)
    values[0] = sigma * random.standard_normal()
    for index in range(1, count):
        values[index] = keep * values[index - 1] + sigma * math.sqrt(1.0 - keep**2) * random.standard_normal()
    return values


def flight(delay_s, seed=1, rocking_deg=1.5, seconds=30.0, rate_hz=30.0, mount_yaw_deg=-4.0, noise=1.0):
    """A vehicle that rocks in gusts ten metres above the pad, with an autopilot that is honestly wrong, as the camera sees it."""
    random = np.random.default_rng(seed)
    step_s = 0.02
    times_s = np.arange(-1.0, seconds + 1.0, step_s)
    count = len(times_s)
    roll, pitch = (np.radians(rocking_deg) * coloured(random, count, 1.0, 0.6, step_s) for _ in range(2))
    roll, pitch = (np.convolve(one, np.ones(15) / 15, mode="same") for one in (roll, pitch))
    north, east = (np.cumsum(coloured(random, count, 0.2, 1.0, step_s)) * step_s for _ in range(2))
    true_q = np.array([quaternion_from_euler(r, p, 0.3) for r, p in zip(roll, pitch, strict=True)])
    true_place = np.column_stack((1.0 + north, east - 1.0, np.full(count, -10.0)))
    tilt = [noise * np.radians(0.1) * coloured(random, count, 1.0, 5.0, step_s) for _ in range(2)]
    q = np.array([quaternion_from_euler(r + a, p + b, 0.31) for r, p, a, b in zip(roll, pitch, *tilt, strict=True)])
    shaken = np.column_stack([noise * coloured(random, count, 0.004, 0.1, step_s) for _ in range(3)])
    wander = np.column_stack([noise * coloured(random, count, 0.3, 30.0, step_s) for _ in range(3)])
    captured_s = np.arange(0.6, seconds, 1.0 / rate_hz)
    values = np.array([parameter.nominal for parameter in PARAMETERS])
    values[NAMES.index("image_latency_s")] = delay_s
    values[NAMES.index("mount_yaw_deg")] = mount_yaw_deg
    blank = np.zeros((len(captured_s), 4, 2))
    truth = Sightings(captured_s, blank, SQUARE, Track(times_s, true_place), Track(times_s, unified(true_q)))
    seen = predicted_px(values, truth, CAMERA) + random.normal(0.0, 0.05, blank.shape)
    believed = Sightings(
        captured_s, seen, SQUARE, Track(times_s, true_place + shaken + wander), Track(times_s, unified(q))
    )
    return Motion(believed, 0.0)


@pytest.mark.parametrize("delay_s", [0.0, 0.013, 0.08, 0.25, -0.04])
def test_an_injected_delay_is_recovered_within_five_milliseconds(delay_s):
    found = fit_delay([flight(delay_s)], CAMERA)
    assert found.delay_s == pytest.approx(delay_s, abs=0.005)
    assert found.sigma_s < MAX_SIGMA_S


def test_its_uncertainty_covers_what_it_is_off_by():
    errors = []
    for seed in range(12):
        found = fit_delay([flight(0.05, seed=seed, seconds=20.0)], CAMERA)
        errors.append((found.delay_s - 0.05) / found.sigma_s)
    assert np.sqrt(np.mean(np.square(errors))) < 1.5
    assert max(map(abs, errors)) < 4.0


def test_without_errors_of_the_autopilot_it_is_exact():
    found = fit_delay([flight(0.037, noise=0.0)], CAMERA)
    assert found.delay_s == pytest.approx(0.037, abs=0.0005)


def test_gross_outliers_and_lost_frames_hardly_matter():
    one = flight(0.06)
    one.sightings.corners_px[::25] += 45.0
    kept = np.random.default_rng(3).random(len(one.sightings)) > 0.2
    sparse = dataclasses.replace(
        one.sightings, captured_s=one.sightings.captured_s[kept], corners_px=one.sightings.corners_px[kept]
    )
    found = fit_delay([dataclasses.replace(one, sightings=sparse)], CAMERA)
    assert found.delay_s == pytest.approx(0.06, abs=0.005)


def test_a_vehicle_that_stands_still_does_not_show_it_and_is_refused():
    with pytest.raises(DelayError, match=r"not to be seen in these flights|hardly moved"):
        fit_delay([flight(0.06, rocking_deg=0.02)], CAMERA)


def test_a_few_seconds_are_too_few():
    with pytest.raises(DelayError, match="are needed"):
        fit_delay([flight(0.06, seconds=4.0)], CAMERA)


def test_recordings_that_contradict_each_other_are_refused():
    flights = [flight(0.03, seed=1), flight(0.09, seed=2)]
    each = [fit_delay([one], CAMERA) for one in flights]
    with pytest.raises(DelayError, match="not constant"):
        check_agreement(each)
    check_agreement(each[:1])
    unsure = dataclasses.replace(each[1], sigma_s=0.05)
    check_agreement([each[0], unsure])


def test_smoothing_shifts_nothing_and_keeps_straight_lines():
    random = np.random.default_rng(5)
    times_s = np.sort(random.uniform(0.0, 10.0, 400))
    line = np.column_stack((3.0 * times_s - 1.0, -times_s))
    np.testing.assert_allclose(smoothed(Track(times_s, line), 0.05).values, line, atol=1e-9)


def test_the_high_pass_takes_off_what_lasts_and_keeps_what_is_quick():
    times_s = np.arange(0.0, 20.0, 0.05)
    valid = np.ones(len(times_s), bool)
    slow, quick = np.sin(0.1 * times_s), np.sin(2.0 * math.pi * 3.0 * times_s)
    rest = high_passed(times_s, np.column_stack((slow, quick)), valid)[20:-20]
    assert np.abs(rest[:, 0]).max() < 0.01
    assert np.std(rest[:, 1]) == pytest.approx(np.std(quick), rel=0.05)
