"""Matrices as plain tuples do what arrays do."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.flat_matrix import congruent, flat_rotation, is_positive_definite, times, transposed_times
from alight.geometry.rotation import R_from_quaternion

numbers = st.floats(-100.0, 100.0)
matrices = st.tuples(*[numbers] * 9)
vectors = st.tuples(*[numbers] * 3)
seeds = st.integers(0, 2**32 - 1)


@given(matrices, vectors)
def test_products_with_vectors(M, v):
    array = np.reshape(M, (3, 3))
    np.testing.assert_allclose(times(M, v), array @ v, atol=1e-9)
    np.testing.assert_allclose(transposed_times(M, v), array.T @ v, atol=1e-9)


@given(matrices, matrices)
def test_congruence_carries_a_covariance(M, half):
    half, array = np.reshape(half, (3, 3)), np.reshape(M, (3, 3))
    C = half @ half.T
    result = np.reshape(congruent(M, tuple(C.ravel().tolist())), (3, 3))
    np.testing.assert_allclose(result, array @ C @ array.T, rtol=1e-9, atol=1e-6)
    assert (result == result.T).all()


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1))
def test_rotation_of_a_quaternion(q):
    np.testing.assert_allclose(np.reshape(flat_rotation(q), (3, 3)), R_from_quaternion(q), atol=1e-12)


@given(seeds, st.integers(1, 6), st.floats(-2.0, 2.0))
def test_positive_definite_is_what_has_only_positive_eigenvalues(seed, size, shift):
    half = np.random.default_rng(seed).normal(size=(size, size))
    C = half @ half.T + shift * np.eye(size)
    least = np.linalg.eigvalsh(C).min()
    if abs(least) > 1e-9:
        assert is_positive_definite(C.ravel().tolist(), size) == (least > 0.0)


@pytest.mark.parametrize("place", [0, 7, 21, 35])
def test_nan_is_not_positive_definite(place):
    C = np.eye(6).ravel().tolist()
    C[place] = math.nan
    assert not is_positive_definite(C, 6)
