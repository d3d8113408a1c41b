"""The larger axis of the ellipse in which a place lies."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.horizontal_sigma import horizontal_sigma

sigmas = st.floats(1e-3, 1e3)


@given(sigmas, sigmas, st.floats(0.0, math.pi))
def test_it_is_the_larger_sigma_however_the_ellipse_is_turned(one, other, turn_rad):
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    R = np.array([[c, -s], [s, c]])
    (nn, ne), (_, ee) = (R @ np.diag((one**2, other**2)) @ R.T).tolist()
    assert horizontal_sigma(nn, ne, ee) == pytest.approx(max(one, other))


@pytest.mark.parametrize("matrix", [(-1e-9, 0.0, 1.0), (1.0, 0.0, -1e-9), (math.nan, 0.0, 1.0), (1.0, math.nan, 1.0)])
def test_what_is_no_covariance_has_none(matrix):
    assert math.isnan(horizontal_sigma(*matrix))
