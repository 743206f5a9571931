"""Which cells of a scan lie on the one surface that most of them are of; others are of one behind it, or of no surface.

Wherever a cell is off the others by metres, a fit to all of them is of nothing, and their own spread hides it. A plane
through three of them, drawn by chance, that most are near (Rousseeuw, J. Am. Stat. Assoc. 79, 1984), tells where to
begin, and the form of second degree of the nearer half, again and again, what most of them are of (Rousseeuw & Van
Driessen, Technometrics 41, 1999).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.gauges.fit import OUTLIER_SIGMAS
from analysis.measures import MAD_TO_SIGMA
from render.base.arrays import Float

DRAWN, DRAWN_SEED, MOST_ASKED = 200, 11, 4000
"""Planes, and cells that each of them is tried on: with two fifths of the cells off, 40 of them are of none that is."""
ROUNDS = 12
GRAZING = 1e-3
"""Cosine between a surface's normal and the direction of noise, below which it is taken as that."""
STEEPER = 3.0
"""Times the misses before it, of one at which another surface begins: those of one that is bent grow bit by bit."""


def on_one_surface(position: Float, direction: Float, sigma: Float) -> NDArray[np.bool_]:
    """(n,) of (n, 3) cells, m, which move by noise of (n,) m along (n, 3): those of the surface that most are of."""
    height, powers = _over_plane(position, direction, sigma)
    miss = np.abs(height)
    for _ in range(ROUNDS):
        nearer = np.argsort(miss, kind="stable")[: (len(miss) + 1) // 2]
        theta = np.linalg.lstsq(powers[nearer], height[nearer], rcond=None)[0]
        before, miss = miss, np.abs(height - powers @ theta)
        if np.allclose(before, miss):
            break
    return together(miss)


def together(miss: Float) -> NDArray[np.bool_]:
    """(n,) of misses of a surface (n,), in sigmas: those before the leap at which another one begins, or no surface."""
    ordered = np.sort(np.abs(miss))
    limit = OUTLIER_SIGMAS * max(1.0, MAD_TO_SIGMA * float(np.median(ordered)))
    leaps = np.flatnonzero((ordered[1:] > limit) & (ordered[1:] > STEEPER * ordered[:-1]))
    leaps = leaps[leaps >= (len(ordered) - 1) // 2]
    return np.asarray(np.abs(miss) <= (ordered[leaps[0]] if len(leaps) else np.inf))


def _over_plane(position: Float, direction: Float, sigma: Float) -> tuple[Float, Float]:
    """(n,) heights over the plane that most cells are near, in their sigmas, and (n, 6) powers of their places in it,
    over the same."""
    random = np.random.default_rng(DRAWN_SEED)
    asked = random.permutation(len(position))[:MOST_ASKED]
    p, q, r = (position[some] for some in random.integers(0, len(position), (3, DRAWN)))
    normal = np.cross(q - p, r - p)
    length = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(length, np.finfo(np.float64).tiny)[:, None]
    off = np.abs((position[asked] @ normal.T) - np.einsum("ij,ij->i", normal, p))
    off /= np.maximum(np.abs(direction[asked] @ normal.T), GRAZING) * sigma[asked, None]
    middle = np.where(length > 0.0, np.median(off, axis=0), np.inf)
    best = int(np.argmin(middle))
    up, along, across = np.linalg.svd(normal[[best]])[2]
    local = (position - p[best]) @ np.stack([along, across, up]).T
    unit = np.maximum(np.abs(direction @ up), GRAZING) * sigma
    x, y = (one / max(float(np.median(np.abs(one))), 1e-12) for one in local[:, :2].T)
    powers = np.column_stack([np.ones(len(x)), x, y, x * x, x * y, y * y])
    return local[:, 2] / unit, powers / unit[:, None]
