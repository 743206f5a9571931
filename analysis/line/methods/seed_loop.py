"""The loop over scan lines and seeds, written once: a method is a kernel that measures the peak at one seed.

    measure(pixels, y, seed, flag, options, out) -> flag

pixels holds the scan line y and those around it, seed where `detect` saw a peak and how wide and high it is, flag
what it said of it (OK or SATURATED). The kernel writes out (COLUMNS,): u, sigma_u, width, amplitude, background,
chi2, correlation length, of a narrow line how its place and width vary together, how far the line leans to one side and
how much it leaves over (`leaning`), and what its pixels say of its width (`shared_width`), NaN where it has none, and
returns the flag that the peak keeps. An out without a position stays NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from analysis.line.detection.detect import PRIOR_WIDTHS
from analysis.line.result import Flag
from render.base.arrays import Float32

Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

WIDTH, CHI2, CORRELATION_LENGTH, SHARED, LEAN, FIT, TOLD = 2, 5, 6, 7, 8, 9, 10
"""Columns of out: px; reduced; scan lines; covariance of place and width, px^2, of a narrow line; a normal deviate
where the line is as one Gaussian, +-infinity where it is measured as something else; that of what the single line
leaves over; from TOLD on the logarithm of the likelihood of each of PRIOR_WIDTHS at the likeliest place, and then that
over all places; by methods that fit a width alone, and the first NaN where there is nothing to tell."""
COLUMNS = TOLD + 2 * len(PRIOR_WIDTHS)
"""Of out."""
ROOM = 11
"""Scan lines of scratch that a method may use."""


class Pixels(NamedTuple):
    """Scan lines as the kernels read them, and scratch that they may write to."""

    signal: Float32
    """(m, w) electrons; without gaps for methods that look at neighbouring scan lines."""
    mask: Mask
    """(m, w) bits SATURATED and MISSING of `detection.channel`."""
    floor: Float32
    """(m, w) or (m, 1) variance that does not come from the signal itself, e-^2."""
    correlation: Array
    """(c,) of the noise of pixels that are 0, 1, .. apart; [1] where they are independent."""
    first: int
    """The scan line of the first row of seeds."""
    room: Array
    """(ROOM, w)."""
    covariances: Array = np.zeros((2, 0))
    """(2, c) of the light of pixels that are 0, 1, .. apart, as in `NoiseModel`."""
    scintillation: Array = np.zeros((0, 0))
    """(k, c) of pixels 0, 1, .. scan lines and 0, 1, .. pixels apart."""
    fineness: float = 0.0
    """As in `NoiseModel`."""
    alike: float = 1.0
    """Scan lines that noise without scintillation has in common, by smoothing."""


class Options(NamedTuple):
    """What a method may be told."""

    variant: int
    """Which of the methods that share a kernel."""
    integrated: bool
    """Whether the profile is that of a Gaussian integrated over each pixel, else taken at its centre."""
    known_width: bool
    """Whether the seeds' width is given and not measured."""
    max_width: float
    """px; wider is no line."""
    filter_scale: float
    """Sigma of a filter over that of the line."""
    judge: float = math.inf
    """Standard normal deviates from which what a fit leaves over is taken for another thing than a line; 0: it is one
    by its neighbours."""


peak_kernel = register_jitable(error_model="numpy", inline="always")
"""Of a kernel that measures one peak: known by its name, so that the loop around it is found in the kernel cache.

It becomes part of the loop before either is optimised: optimised by itself as well, the largest one takes 10 s more of
the first start.
"""


@cache
def seed_kernel(measure: Callable[..., int]) -> Callable[[Pixels, Array, Mask, Options, Array], None]:
    """The kernel of one peak -> that of all seeds (n, k, SEED_COLUMNS): flags (n, k) are updated, out (n, k, COLUMNS)
    is written."""

    @njit(nogil=True, cache=True, error_model="numpy")
    def run(pixels: Pixels, seeds: Array, flags: Mask, options: Options, out: Array) -> None:
        for row in range(seeds.shape[0]):
            for k in range(seeds.shape[1]):
                for j in range(min(TOLD + 1, out.shape[2])):  # without its first, nothing is told
                    out[row, k, j] = np.nan
                if flags[row, k] <= Flag.SATURATED.value:
                    y = pixels.first + row
                    flags[row, k] = measure(pixels, y, seeds[row, k], flags[row, k], options, out[row, k])

    return run
