"""Matrix products in pieces so small that OpenBLAS stays on one thread: to wake another takes longer than they do."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Real = TypeVar("Real", np.float32, np.float64)

_MOST_MULTIPLICATIONS = 250_000
"""OpenBLAS goes on with more threads beyond 262144."""


def product(a: NDArray[Real], b: NDArray[Real]) -> NDArray[Real]:
    """The matrix product a b, (n, k), of (n, m) and (m, k)."""
    rows = max(_MOST_MULTIPLICATIONS // max(b.shape[0] * b.shape[1], 1), 1)
    if len(a) <= rows:
        return a @ b
    return np.concatenate([a[first : first + rows] @ b for first in range(0, len(a), rows)])


def gram(a: NDArray[np.float64]) -> NDArray[np.float64]:
    """The product of the transposed matrix with itself, (m, m), of (n, m)."""
    rows = max(_MOST_MULTIPLICATIONS // max(a.shape[1] ** 2, 1), 1)
    total = a[:rows].T @ a[:rows]
    for first in range(rows, len(a), rows):
        total += a[first : first + rows].T @ a[first : first + rows]
    return total
