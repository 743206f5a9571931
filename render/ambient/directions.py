"""Guiding of camera paths at their first surface: the directions from which light comes that moves the measured lines.

A lamp that shining metal throws on the next surface is met by chance alone: of some hundred directions in which a
surface scatters a few lead there, and most of the error comes from these. Where they are is learned from samples
(`line_directions.py`), and later ones go there (Mueller, Gross and Novak, Practical Path Guiding, 2017, with a grid in
place of a tree). With p_b the pdf of the BSDF and p_g that of the guide, a share of the directions is drawn by the
latter, and all have

    p = (1 - share) p_b + share p_g

in every weight: whatever was learned, no image is wrong by it. Of all pixels that a line is measured on the guided
directions are the same, as their random numbers are, and so is what they meet.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float, Float32, Int, Long
from render.base.vectors import Vector

BANDS, SECTORS = 32, 64
"""Cells of the sphere of directions, all of one solid angle: between heights, and around."""
CELLS = BANDS * SECTORS
CELL_ANGLE = 4.0 * math.pi / CELLS
"""Solid angle of a cell, sr."""


class Guide(NamedTuple):
    """Distributions over directions, for some of the pixels of a chunk."""

    cumulative: Float
    """(rows, CELLS + 1) from 0 to 1."""
    row: Int
    """(m,) of each pixel, -1: it is not guided; (0,): none is."""
    share: float
    """Of the directions that are drawn by the guide."""


NO_GUIDE = Guide(np.zeros((0, CELLS + 1)), np.zeros(0, np.int32), 0.0)


class Draws(NamedTuple):
    """Where the random numbers and the first directions of some pixels come from."""

    keys: Int
    """(m,) the numbers that their random numbers follow from."""
    guide: Guide = NO_GUIDE

    def of(self, some: Long | slice) -> Draws:
        """Those of some of the pixels."""
        guide = self.guide
        return Draws(self.keys[some], guide._replace(row=guide.row[some]) if len(guide.row) else guide)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def cell_of(direction: Vector) -> int:
    """The cell that a unit direction is in."""
    x, y, z = direction
    band = min(max(int((0.5 + 0.5 * z) * BANDS), 0), BANDS - 1)
    sector = min(int((math.atan2(y, x) / (2.0 * math.pi) + 0.5) * SECTORS), SECTORS - 1)
    return band * SECTORS + sector


def cells_of(directions: Float | Float32) -> Long:
    """(n,) `cell_of` unit directions (n, 3)."""
    x, y, z = directions.astype(np.float64).T
    band = np.clip((0.5 + 0.5 * z) * BANDS, 0, BANDS - 1).astype(np.int64)
    sector = np.minimum((np.arctan2(y, x) / (2.0 * math.pi) + 0.5) * SECTORS, SECTORS - 1).astype(np.int64)
    return np.asarray(band * SECTORS + sector)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def guided_pdf(cumulative: Float, row: int, direction: Vector) -> float:
    """pdf of `guided_direction`, 1/sr."""
    cell = cell_of(direction)
    return (cumulative[row, cell + 1] - cumulative[row, cell]) / CELL_ANGLE


@numba.njit(nogil=True, cache=True, error_model="numpy")
def guided_direction(cumulative: Float, row: int, r1: float, r2: float) -> Vector:
    """A unit direction: a cell drawn by r1, evenly in it by what that leaves over and by r2."""
    low, high = 0, CELLS
    while high - low > 1:
        middle = (low + high) >> 1
        if cumulative[row, middle] <= r1:
            low = middle
        else:
            high = middle
    width = cumulative[row, low + 1] - cumulative[row, low]
    within = min(max((r1 - cumulative[row, low]) / width, 0.0), 1.0)
    z = 2.0 * (low // SECTORS + within) / BANDS - 1.0
    angle = 2.0 * math.pi * ((low % SECTORS + r2) / SECTORS - 0.5)
    radius = math.sqrt(max(1.0 - z * z, 0.0))
    return (radius * math.cos(angle), radius * math.sin(angle), z)
