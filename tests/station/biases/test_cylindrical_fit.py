"""The paper's error model: what is put into hovers comes out of the fit, with the signs of Eq. 21-26."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.settings.geolocator import Correction
from station.biases.cylindrical_fit import FitError, corrected_record, fit_cylindrical
from station.report.figures.static_records import StaticRecord

RADII_M = [d * math.sqrt(2) for d in (2, 3, 4, 5)]
PLACES = [(0.0, 0.0), *((r * math.cos(a), r * math.sin(a)) for r in RADII_M for a in np.radians((45, 135, 225, 315)))]


def hover(place, biases: Correction, noise_m=0.0, samples=40, seed=1) -> StaticRecord:
    """Measured through an installation with these biases."""
    n, e = place
    radius_m = math.hypot(n, e)
    wrong_m = (radius_m + biases.beta_r_m * (radius_m > 0)) / (1.0 - biases.alpha_r)
    wrong_rad = math.atan2(e, n) + math.radians(biases.theta_deg)
    centre = np.array([wrong_m * math.cos(wrong_rad), wrong_m * math.sin(wrong_rad), -10.0 - biases.beta_d_m])
    noise = np.random.default_rng(seed).normal(0.0, noise_m, (samples, 3)) if noise_m else np.zeros((samples, 3))
    return StaticRecord(np.array([n, e, -10.0]), centre + noise)


@settings(max_examples=25, deadline=None)
@given(st.floats(-20, 20), st.floats(-0.1, 0.1), st.floats(-1, 1))
def test_constant_biases_are_found_and_removed(theta_deg, alpha_r, height_m):
    biases = Correction(method="cylindrical", theta_deg=theta_deg, alpha_r=alpha_r, beta_d_m=height_m)
    records = [hover(place, biases) for place in PLACES]
    fit = fit_cylindrical(records)
    assert fit.azimuth_deg.mean == pytest.approx(theta_deg, abs=1e-9)
    assert fit.height_m.median == pytest.approx(height_m, abs=1e-9)
    # The line is over the true distance (Fig. 12), the correction takes it over the measured one: alpha^2 r is left.
    assert fit.radial_line.slope == pytest.approx(alpha_r / (1.0 - alpha_r), abs=1e-9)
    assert (fit.positions, fit.samples) == (17, 17 * 40)
    for record in records:
        rest = corrected_record(record, fit.correction("mean")).error_ned_m
        assert np.abs(rest).max() < 1e-6 + (alpha_r / (1.0 - alpha_r)) ** 2 * 7.1


def test_mean_and_median_differ_where_samples_are_skew():
    biases = Correction(method="cylindrical", theta_deg=4.0, beta_d_m=0.5)
    records = [hover(place, biases) for place in PLACES]
    for record in records:
        record.measured_ned_m[:8, 2] -= 1.0
    fit = fit_cylindrical(records)
    assert fit.correction("median").beta_d_m == pytest.approx(0.5)
    assert fit.correction("mean").beta_d_m == pytest.approx(0.7)


def test_an_angular_line_is_tested_and_says_how_little_it_explains():
    records = [
        hover(place, Correction(theta_deg=4.0 + jitter), 0.02, seed=number)
        for number, (place, jitter) in enumerate(
            zip(PLACES, np.random.default_rng(3).normal(0, 0.5, len(PLACES)), strict=True)
        )
    ]
    fit = fit_cylindrical(records)
    assert fit.angular_line.r2 < 0.35
    assert fit.azimuth_deg.mean == pytest.approx(4.0, abs=0.4)


def test_records_of_one_position_count_as_one_position():
    records = [hover(place, Correction(alpha_r=0.02)) for place in [*PLACES, PLACES[0], PLACES[0], PLACES[0]]]
    fit = fit_cylindrical(records)
    assert (fit.positions, fit.records) == (17, 20)


def test_too_few_positions_are_refused():
    with pytest.raises(FitError, match="2 positions"):
        fit_cylindrical([hover(place, Correction()) for place in PLACES[:2]])
