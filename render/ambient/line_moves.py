"""How far ambient light moves the measured lines, sample by sample, and how well that is known.

Samples come in batches, each of random numbers of its own, in two halves. With n_r samples a pixel in half batch r,
which moves a line by M_r, and R of these so far, N samples and the mean M in all, the variance of M is about

    sum over r of n_r (M_r - M)^2 / ((R - 1) N)

where the variance of M_r falls as 1 / n_r. A batch spreads its samples evenly, so that it falls sooner: the estimate is
rather too high.

A pixel of little weight is soon known as well as its line needs it, whatever the others do: it is settled, and stands
with the mean that it has in what later batches do to the line.
"""

from __future__ import annotations

import numpy as np

from render.base.arrays import Bool, Float, Float32, Int, Long

NEIGHBOURS = 5
"""Scan lines whose variances are taken together: a few batches say little of a single one."""


SETTLED = 0.2
"""Of what a line may be off, for all its settled pixels. Chosen, not tuned."""


class LineMoves:
    """The moments of what batches of samples do to the lines; grows by batches."""

    def __init__(self, moves: tuple[Float, ...], line: Int, lines: int) -> None:
        """moves: for each laser (m,) how far light in a pixel moves its line; line: (m,) of each pixel, of so many."""
        self.measured: Bool = (
            np.any([move != 0.0 for move in moves], axis=0) if moves else np.zeros(len(line), np.bool_)
        )
        """(m,) a line is measured on the pixel. Of one line all that are not settled have as many samples."""
        self.on: Long = np.flatnonzero(self.measured)
        self.line, self.lines = line[self.on], lines
        self.weights = [move[self.on] for move in moves]
        self.weight: Float = np.max(np.abs(self.weights), axis=0) if moves else np.zeros(0)
        """The largest of each pixel, without its sign."""
        self.first_pixel = np.zeros(lines, np.int64)
        """Of each line that with the largest weight, which is never settled; 0 of lines that are not measured."""
        order = np.lexsort((self.weight, self.line))
        self.first_pixel[self.line[order]] = self.on[order]
        self.open: Bool = np.ones(len(self.on), np.bool_)
        """The pixels that are not settled."""
        self.settled: Float = np.zeros(lines)
        """How far those that are move the lines, all the same way as their random numbers are the same."""
        self.pixels = np.bincount(self.line, minlength=lines)
        self.lit = np.array([np.bincount(self.line, np.abs(weight), lines) > 0.0 for weight in self.weights])
        shape = len(moves), 3, lines
        self.batches, self.samples = np.zeros(lines), np.zeros(lines)
        self.first, self.second = np.zeros(shape), np.zeros(shape)

    def settle(self, some: Long, variance: Float) -> None:
        """Settle those of some pixels, places (n,) in `on`, whose weight leaves their line as well known.

        variance: (n,) of their means. Of a line the largest counts for all: chance makes single ones far too small.
        """
        line, largest = self.line[some], np.zeros(self.lines)
        np.maximum.at(largest, line, variance)
        moved = self.weight[some] * np.sqrt(largest[line])
        known = (moved * self.pixels[line] <= SETTLED) & (self.on[some] != self.first_pixel[line])
        self.open[some[known]] = False
        np.add.at(self.settled, line[known], moved[known])

    def add(self, sums: Float32, count: Int, means: Float32) -> None:
        """A batch: radiance (m, 2, 3) of both halves, summed over count (m, 2) samples of each pixel.

        means: (n, 3) of all samples so far of the settled pixels, in the order of `on`.
        """
        new, shut = np.flatnonzero(self.open & count[self.on].any(axis=1)), np.flatnonzero(~self.open)
        on, line = self.on[new], self.line[new]
        for half in range(2):
            n = np.where(self.pixels > 0, count[self.first_pixel, half], 0).astype(np.float64)
            each = np.maximum(n, 1.0)
            for band in range(3):
                light = sums[on, half, band].astype(np.float64)
                for i, weight in enumerate(self.weights):
                    moved = np.bincount(line, weight[new] * light, self.lines) / each
                    if len(shut):
                        moved += np.bincount(self.line[shut], weight[shut] * means[:, band], self.lines)
                    self.first[i, band] += n * moved
                    self.second[i, band] += n * moved**2
            self.samples += n
            self.batches += n > 0.0

    def forget(self, lines: Bool) -> None:
        """Leave out all batches so far of some lines (lines,)."""
        self.samples[lines] = self.batches[lines] = 0.0
        self.first[..., lines] = self.second[..., lines] = 0.0

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
        return np.asarray(found.max(axis=(0, 1)) + self.settled**2)


def _neighbours(values: Float) -> Float:
    """(n,) sums over the NEIGHBOURS about each."""
    return np.convolve(values, np.ones(NEIGHBOURS), mode="same")
