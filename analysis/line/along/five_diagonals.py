"""Symmetric matrices (n, n) of five diagonals, as arrays (3, n): row d holds the entries (i, i + d), as in SciPy."""

from __future__ import annotations

import numpy as np
from numba import njit

from render.base.arrays import Float

SECOND = np.array([1.0, -2.0, 1.0])
"""Of the rows k, k - 1 and k - 2 in the second difference that ends on row k."""
KNOWN = 4
"""Diagonals of an inverse that are worked out, this one and those to one side."""


def gram(rows: Float) -> Float:
    """(3, n) of B'B; rows (n, 3): entries (k, k), (k, k - 1), (k, k - 2) of B, those before the first row 0."""
    out = np.zeros((3, len(rows)))
    for i in range(3):
        for j in range(i + 1):
            out[i - j, : len(rows) - i] += rows[i:, i] * rows[i:, j]
    return out


@njit(nogil=True, cache=True, error_model="numpy")
def inverse_diagonals(factor: Float) -> Float:
    """Cholesky factor (3, n) of A, lower -> (KNOWN, n) diagonals of its inverse, from the last row up.

    A^-1 = D^-1 L^-1 + (1 - L') A^-1 (Takahashi, Fagan and Chen, Proc. 8th PICA Conference, 63, 1973).
    """
    n = factor.shape[1]
    out = np.zeros((KNOWN, n))
    for i in range(n - 1, -1, -1):
        for d in range(min(KNOWN - 1, n - 1 - i), -1, -1):
            total = 1.0 / factor[0, i] if d == 0 else 0.0
            for k in range(1, min(2, n - 1 - i) + 1):
                total -= factor[k, i] * out[abs(k - d), i + min(k, d)]
            out[d, i] = total / factor[0, i]
    return out


def of_second_differences(inverse: Float, later: int) -> Float:
    """Covariances (KNOWN, n) -> (n,) that of the second difference ending on each row with the one `later` rows on.

    0 on the first two rows, where none ends, and on the last `later`, 0 or 1.
    """
    n = inverse.shape[1]
    out = np.zeros(n)
    k = np.arange(2, n - later)
    for i, left in enumerate(SECOND):
        for j, right in enumerate(SECOND):
            one, other = k - i, k + later - j
            out[k] += left * right * inverse[np.abs(one - other), np.minimum(one, other)]
    return out
