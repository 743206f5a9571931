"""How far ambient light moves the measured lines, sample by sample, and how well that is known.

Samples come in batches, each of random numbers of its own, in two halves. With n_r samples a pixel in half batch r,
which moves a line by M_r, and R of these so far, N samples and the mean M in all, the variance of M is about

    sum over r of n_r (M_r - M)^2 / ((R - 1) N)

where the variance of M_r falls as 1 / n_r. A batch spreads its samples evenly, so that it falls sooner: the estimate is
rather too high.
"""

from __future__ import annotations

import numpy as np

from render.base.arrays import Bool, Float, Float32, Int, Long

NEIGHBOURS = 5
"""Scan lines whose variances are taken together: a few batches say little of a single one."""


class LineMoves:
    """The moments of what batches of samples do to the lines; grows by batches."""

    def __init__(self, moves: tuple[Float, ...], line: Int, lines: int) -> None:
        """moves: for each laser (m,) how far light in a pixel moves its line; line: (m,) of each pixel, of so many."""
        self.measured: Bool = (
            np.any([move != 0.0 for move in moves], axis=0) if moves else np.zeros(len(line), np.bool_)
        )
        """(m,) a line is measured on the pixel. All these pixels of a line have as many samples."""
        self.on: Long = np.flatnonzero(self.measured)
        """Those pixels; `first_pixel` is one of each line, 0 of lines that are not measured."""
        self.line, self.lines = line[self.on], lines
        self.first_pixel = np.zeros(lines, np.int64)
        self.first_pixel[self.line] = self.on
        self.weights = [move[self.on] for move in moves]
        self.pixels = np.bincount(self.line, minlength=lines)
        self.lit = np.array([np.bincount(self.line, np.abs(weight), lines) > 0.0 for weight in self.weights])
        shape = len(moves), 3, lines
        self.batches, self.samples = np.zeros(lines), np.zeros(lines)
        self.first, self.second = np.zeros(shape), np.zeros(shape)

    def add(self, sums: Float32, count: Int) -> None:
        """A batch: radiance (m, 2, 3) of both halves, summed over count (m, 2) samples of each pixel."""
        new = np.flatnonzero(count[self.on].any(axis=1))
        on, line = self.on[new], self.line[new]
        for half in range(2):
            n = np.where(self.pixels > 0, count[self.first_pixel, half], 0).astype(np.float64)
            each = np.maximum(n, 1.0)
            for band in range(3):
                light = sums[on, half, band].astype(np.float64)
                for i, weight in enumerate(self.weights):
                    moved = np.bincount(line, weight[new] * light, self.lines) / each
                    self.first[i, band] += n * moved
                    self.second[i, band] += n * moved**2
            self.samples += n
            self.batches += n > 0.0

    @property
    def variance(self) -> Float:
        """(lines,) of how far the mean of all samples moves a line, for the laser and colour that it is largest for."""
        if not len(self.weights):
            return np.zeros(self.lines)
        count = np.maximum(self.samples, 1.0)
        squares = np.maximum(self.second - self.first**2 / count, 0.0) / count
        freedom = np.where(self.lit, np.maximum(self.batches - 1.0, 0.0), 0.0)
        together = np.array([_neighbours(one) for one in freedom])[:, None]
        summed = np.array(
            [
                [_neighbours(np.where(lit, one, 0.0)) for one in of_laser]
                for of_laser, lit in zip(squares, self.lit, strict=True)
            ]
        )
        found = np.where(self.lit[:, None], summed / np.maximum(together, 1.0), 0.0)
        return np.asarray(found.max(axis=(0, 1)))


def _neighbours(values: Float) -> Float:
    """(n,) sums over the NEIGHBOURS about each."""
    return np.convolve(values, np.ones(NEIGHBOURS), mode="same")
