"""One peak a scan line, or none: the chain of candidates that is cheapest over the whole image, by dynamic programming.

    cost = sum over peaks   STRENGTH ln(strongest / this)
         + sum over links   STRAIGHTNESS |du - slope * distance|, up to GAP scan lines apart
         + EMPTY for each scan line without a peak + JUMP for each new chain

Viterbi over scan lines with a "no line here" state (Schnee and Futterlieb, 2011; Usamentiaga et al., 2012). The slope
is that of the chain so far. Brightness counts little: reflections are often brighter than the line, but seldom as long.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.result import Flag, Line
from render.base.arrays import Float

Int = NDArray[np.int64]
Mask = NDArray[np.bool_]

STRENGTH = 0.01
STRAIGHTNESS = 0.5
"""Per px off the straight continuation."""
EMPTY = 1.0
JUMP = 10.0
"""So that a chain of fewer than JUMP / EMPTY peaks is not a line."""
GAP = 12
"""Scan lines that a chain may skip."""
MEMORY = 0.2
"""Weight of the newest link in a chain's slope."""


def select_chain(candidates: Line, allowed: Mask | None = None) -> Line:
    """Peaks (n, k) -> Line (n, 1) of the cheapest chains; `allowed` (n, k) leaves candidates out.

    Scan lines without a peak on a chain are flagged NO_PEAK, or REJECTED where there were candidates.
    """
    usable = candidates.valid if allowed is None else candidates.valid & allowed
    u = np.where(usable, candidates.u, np.nan)
    return pick(candidates, cheapest_chain(u, np.where(usable, candidates.amplitude, np.nan)))


def pick(candidates: Line, choice: Int) -> Line:
    """Peaks (n, k) and the rank (n,) chosen on each scan line, -1 for none -> Line (n, 1)."""
    rank = np.maximum(choice, 0)[:, None]
    found = (choice >= 0)[:, None]

    def taken(values: Float) -> Float:
        return np.where(found, np.take_along_axis(values, rank, axis=1), np.nan)

    reason = np.where(candidates.valid.any(axis=1), np.uint8(Flag.REJECTED), candidates.flag[:, 0])[:, None]
    flag = np.where(found, np.take_along_axis(candidates.flag, rank, axis=1), reason).astype(np.uint8)
    return replace(
        candidates,
        u=taken(candidates.u),
        sigma_u=taken(candidates.sigma_u),
        width=taken(candidates.width),
        amplitude=taken(candidates.amplitude),
        background=taken(candidates.background),
        chi2=taken(candidates.chi2),
        length_apart=None if candidates.length_apart is None else taken(candidates.length_apart),
        shared_u=None if candidates.shared_u is None else taken(candidates.shared_u),
        flag=flag,
        candidates=candidates,
    )


@njit(nogil=True, cache=True, error_model="numpy")
def cheapest_chain(u: Float, strength: Float) -> Int:
    """Positions (n, k), NaN for none, and strengths (n, k) -> (n,) rank on the cheapest chains, -1 for none."""
    n, k = u.shape
    cost = np.full((n, k), np.inf)
    slope = np.zeros((n, k))
    known = np.zeros((n, k), np.int64)
    back = np.full((n, k, 2), -1, np.int64)
    best = np.empty(n + 1)  # cheapest way to have settled the first i scan lines
    last = np.full((n + 1, 2), -1, np.int64)
    best[0] = 0.0
    for i in range(n):
        strongest = 0.0
        for a in range(k):
            if not np.isnan(u[i, a]):
                strongest = max(strongest, strength[i, a])
        best[i + 1] = best[i] + EMPTY
        last[i + 1, 0] = last[i, 0]
        last[i + 1, 1] = last[i, 1]
        for a in range(k):
            if np.isnan(u[i, a]):
                continue
            lowest = best[i] + JUMP
            back[i, a, 0], back[i, a, 1] = last[i, 0], last[i, 1]
            for j in range(max(0, i - GAP), i):
                distance = i - j
                for b in range(k):
                    if np.isnan(u[j, b]):
                        continue
                    du = u[i, a] - u[j, b]
                    # a chain of one peak has no slope yet: any steepness is cheap, but not free
                    ease = 1.0 if known[j, b] > 0 else 0.2
                    off = abs(du - slope[j, b] * distance) * ease
                    total = cost[j, b] + EMPTY * (distance - 1) + STRAIGHTNESS * off
                    if total < lowest:
                        lowest = total
                        back[i, a, 0], back[i, a, 1] = j, b
                        rate = du / distance
                        weight = max(MEMORY, 1.0 / (known[j, b] + 1.0))
                        slope[i, a] = slope[j, b] + weight * (rate - slope[j, b])
                        known[i, a] = known[j, b] + 1
            cost[i, a] = lowest + STRENGTH * np.log(strongest / max(strength[i, a], 1e-3 * strongest))
            if cost[i, a] < best[i + 1]:
                best[i + 1] = cost[i, a]
                last[i + 1, 0], last[i + 1, 1] = i, a
    choice = np.full(n, -1, np.int64)
    i, a = last[n, 0], last[n, 1]
    while i >= 0:
        choice[i] = a
        i, a = back[i, a, 0], back[i, a, 1]
    return choice
