"""What the wings of a saturated line cannot tell of its centre: a term of its sigma."""

from __future__ import annotations

import math

from numba import njit

from analysis.line.methods.narrow_line import COARSE
from analysis.line.methods.seed_loop import Array

GLOW, GLOW_BESIDE, GLOW_WIDTH = 0.005, 3.0, 4.0
"""What a lens may put beside a saturated line, where nobody sees it: height of the peak, in sigmas its place and width.
Taken as given, since the wings cannot tell it."""


@njit(nogil=True, cache=True, error_model="numpy")
def widen_saturated(x: Array, n: int, p: Array, weight: Array, chi2: float, plateau: float, out: Array) -> None:
    """What the wings of a saturated line cannot know -> sigma in out: the glow beside its hidden peak, and a misfit.

    weight (n,): how far the centre moves for one electron more in the pixels x (n,). plateau: half its width, px, which
    the line is within. That of a line that hardly reaches its neighbours is anywhere within a pixel.
    """
    moved = 0.0
    for side in (-1.0, 1.0):
        shift = 0.0
        for i in range(n):
            z = (x[i] - p[1] - side * GLOW_BESIDE * p[2]) / (GLOW_WIDTH * p[2])
            shift += weight[i] * GLOW * p[0] * math.exp(-0.5 * z * z)
        moved = max(moved, abs(shift))
    coarse = 1.0 / 12.0 if p[2] < COARSE else 0.0
    moved = min(moved, plateau / math.sqrt(3.0))
    out[1] = math.sqrt(out[1] * out[1] * max(chi2, 1.0) + moved * moved + coarse)
