"""Variances of single scan lines, which few numbers tell, taken together over lines that are alike."""

from __future__ import annotations

import numpy as np

from render.base.arrays import Bool, Float
from render.importance import LINES_KNOWN

POOLED = 25
"""Scan lines that are taken together."""
UNMET = 1.0 - LINES_KNOWN
"""Share of the lit scan lines that may miss the goal."""


def pooled(values: Float, lit: Bool) -> Float:
    """(lines,) mean over the POOLED lines about each, of those that are lit."""
    return np.asarray(_windows(np.where(lit, values, 0.0)) / np.maximum(_windows(lit.astype(np.float64)), 1.0))


def pooled_alike(values: Float, before: Float, lit: Bool) -> Float:
    """(lines,) mean over the POOLED lit lines whose variance was next to each one's before, by numbers that those to be
    pooled do not depend on. Those that were known worst, which may miss the goal, speak for themselves alone."""
    lines = np.flatnonzero(lit)
    ranked = lines[np.argsort(before[lines], kind="stable")]
    others, out = ranked[: len(ranked) - int(UNMET * len(ranked))], np.where(lit, values, 0.0)
    if len(others):
        out[others] = _windows(values[others]) / _windows(np.ones(len(others)))
    return out


def _windows(values: Float) -> Float:
    """(n,) sums over the POOLED values about each; a running sum would leave the rounding of the largest."""
    return np.asarray(np.convolve(values, np.ones(POOLED))[POOLED // 2 : POOLED // 2 + len(values)])
