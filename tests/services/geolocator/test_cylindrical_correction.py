"""The cylindrical correction: what goes in as a bias comes out as none."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from schemas.settings.geolocator import PAPER_MEAN_CORRECTION, PAPER_MEDIAN_CORRECTION, Correction
from services.geolocator.correction import corrected_azimuth, corrected_vector, correction_jacobian

PAPER_THETA_FROM_EAST_DEG = {"mean": -4.007078, "median": -4.056872}
"""Table 3, as published: atan(N / E), an angle from east, counted against the azimuth."""
PAPER_D_M = {"mean": 0.488412, "median": 0.545400}
"""Table 3."""
PAPER_SLOPE, PAPER_INTERCEPT_M = 2.4923e-2, 2.778497e-2
"""Fig. 12."""
PAPER_MEAN_RADIAL_ERROR_M = 0.153636
"""Table 3. The line of Fig. 12 yields it (to 1 %) over the 16 places off the centre; with the centre's records it yields 0.130."""

positions = st.tuples(st.floats(-20, 20), st.floats(-20, 20), st.floats(1, 30))
biases = st.builds(
    Correction,
    method=st.just("cylindrical"),
    theta_deg=st.floats(-20, 20),
    alpha_r=st.floats(-0.1, 0.1),
    beta_r_m=st.floats(-0.2, 0.2),
    beta_d_m=st.floats(-1, 1),
)


def measured(true_ned_m, bias):
    """What a camera with this bias measures; the radial line is one over the measured distance, as in Eq. 24."""
    north, east, down = true_ned_m
    theta = math.atan2(east, north) + math.radians(bias.theta_deg)
    radius = (math.hypot(north, east) + bias.beta_r_m) / (1.0 - bias.alpha_r)
    return (radius * math.cos(theta), radius * math.sin(theta), down + bias.beta_d_m)


@given(positions, biases)
def test_bias_in_is_removed(true_ned_m, bias):
    if math.hypot(*true_ned_m[:2]) > 0.3:
        assert corrected_vector(measured(true_ned_m, bias), bias) == pytest.approx(true_ned_m, abs=1e-9)


@given(positions, biases)
def test_jacobian_is_the_derivative_away_from_the_axis(vector, bias):
    assume(math.hypot(*vector[:2]) > 1.0)
    J = np.reshape(correction_jacobian(vector, bias), (3, 3))
    for axis, step in enumerate(np.eye(3) * 1e-5):
        change = np.subtract(corrected_vector(vector + step, bias), corrected_vector(vector - step, bias))
        np.testing.assert_allclose(J[:, axis], change / 2e-5, atol=1e-5)


@given(st.floats(0.0, 0.02), st.floats(-math.pi, math.pi))
def test_next_to_the_axis_the_jacobian_claims_neither_certainty_nor_doubt_that_is_not_there(radius, theta):
    vector = (radius * math.cos(theta), radius * math.sin(theta), 3.0)
    stretched = np.linalg.svd(np.reshape(correction_jacobian(vector, PAPER_MEAN_CORRECTION), (3, 3)))[1]
    assert stretched.min() > 0.4
    assert stretched.max() < 2.1


@pytest.mark.parametrize("name", ["mean", "median"])
def test_papers_numbers_keep_their_size_and_get_the_sign_of_an_azimuth(name):
    bias = {"mean": PAPER_MEAN_CORRECTION, "median": PAPER_MEDIAN_CORRECTION}[name]
    assert bias.theta_deg == pytest.approx(-PAPER_THETA_FROM_EAST_DEG[name])
    assert (bias.alpha_r, bias.beta_r_m, bias.beta_d_m) == (PAPER_SLOPE, PAPER_INTERCEPT_M, PAPER_D_M[name])


def test_papers_table_from_its_seventeen_positions():
    """The vehicle hovers at 10 m; the measurement carries the paper's bias; Eq. 21-22 give back the paper's Table 3."""
    places = [(0.0, 0.0)] * 4 + [(a * n, a * e) for a in (2, 3, 4, 5) for n, e in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    angles_deg, radii_m, heights_m = [], [], []
    for north, east in places:
        pad_from_vehicle = (-north, -east, 10.0)
        seen = measured(pad_from_vehicle, PAPER_MEAN_CORRECTION)
        heights_m.append(seen[2] - 10.0)
        if north:
            radii_m.append(math.hypot(*seen[:2]) - math.hypot(north, east))
            from_east = [math.atan(n / e) for n, e in (seen[:2], pad_from_vehicle[:2])]
            angles_deg.append(math.degrees(from_east[0] - from_east[1]))
        # The paper's samples are the vehicle's place in the pad's frame, where D is about -10: too high there.
        assert -seen[2] == pytest.approx(-10.0 - PAPER_D_M["mean"])
        assert corrected_vector(seen, PAPER_MEAN_CORRECTION) == pytest.approx(pad_from_vehicle, abs=1e-9)
    assert angles_deg == pytest.approx([PAPER_THETA_FROM_EAST_DEG["mean"]] * 16)
    assert heights_m == pytest.approx([PAPER_D_M["mean"]] * 20)
    assert sum(radii_m) / 16 == pytest.approx(PAPER_MEAN_RADIAL_ERROR_M, rel=0.02)


@given(st.floats(0.0, 0.02), st.floats(-math.pi, math.pi))
def test_close_to_the_axis_the_vector_shrinks_to_nothing_and_never_flips(radius, theta):
    north, east, _ = corrected_vector((radius * math.cos(theta), radius * math.sin(theta), 3.0), PAPER_MEAN_CORRECTION)
    assert (north, east) == pytest.approx((0.0, 0.0))


def test_a_mount_that_is_turned_turns_the_azimuth_too():
    bias = Correction(method="cylindrical", theta_deg=4.0)
    assert corrected_azimuth(math.radians(-178.0), bias) == pytest.approx(math.radians(178.0))
    assert corrected_azimuth(1.0, bias.model_copy(update={"turn_azimuth": False})) == 1.0


@given(positions)
def test_without_a_method_nothing_is_touched(vector):
    none = Correction(method="none", theta_deg=4.0, beta_d_m=1.0)
    assert corrected_vector(vector, none) == vector
    assert corrected_azimuth(0.5, none) == 0.5
