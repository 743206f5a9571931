"""What all random walks through a medium share: the limit of their length, and the phase function."""

from __future__ import annotations

import numba

from render.base.arrays import Float

MOST_STEPS = 4096
"""Largest number of scatterings between two hits of the boundary. A longer walk is ended: at an albedo of 0.99 its
throughput is e^-41.
"""


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def henyey_greenstein(g: float, u: float) -> float:
    """Cosine of a scattering angle for uniform u in [0, 1) (Henyey and Greenstein 1941; PBRT 4th ed., eq. 11.24)."""
    if abs(g) < 1e-3:
        return 1.0 - 2.0 * u
    part = (1.0 - g * g) / (1.0 - g + 2.0 * g * u)
    return (1.0 + g * g - part * part) / (2.0 * g)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def turn(d: Float, x: float, y: float, z: float) -> None:
    """Replace the unit vector d (3,) by the direction (x, y, z) of the local frame about d (Duff et al. 2017)."""
    n0, n1, n2 = d[0], d[1], d[2]
    sign = 1.0 if n2 >= 0.0 else -1.0
    a = -1.0 / (sign + n2)
    b = n0 * n1 * a
    d[0] = x * (1.0 + sign * n0 * n0 * a) + y * b + z * n0
    d[1] = x * sign * b + y * (sign + n1 * n1 * a) + z * n1
    d[2] = -x * sign * n0 - y * n1 + z * n2
