"""Camera paths for lines that are measured: how many each scan line gets, and which of them are drawn alike.

A line is moved by what the light on one side of it differs from that on the other. The camera paths of all pixels that
a scan line is measured on therefore have the same random numbers, and the same number of paths (common random numbers;
Glasserman, Monte Carlo Methods in Financial Engineering, 2004, section 4.2): neighbouring pixels meet about the same
light vertices, their errors are about the same, and that moves no line. Each pixel by itself is estimated without bias
as before, and what pixels have in common is in the spread of the passes that the error is told by.

The variance of a pass falls as 1 / n, n the camera paths that it is drawn with. Where V_l is found of n_l paths it
takes n_l V_l of them until that of the scan line l is as small as the goal asks, and the fewest with which all lines
are known alike are in proportion to these numbers; likewise for blocks of pixels where peaks could appear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from render.base.arrays import Float, Float32
from render.laser_indirect.connection_buffer import BLOCK
from render.laser_indirect.guiding import MOST_CAMERA_PATHS
from render.laser_indirect.line_goal import Projection, all_but_unmet
from render.laser_indirect.line_pools import POOLED, pooled
from render.laser_indirect.line_sums import block_sums, scale_blocks, weigh_blocks
from render.laser_indirect.sampling import AlikePixels

LEAST_NEED = 0.02
"""Of the camera paths of a scan line that needs most: what every line gets beside it."""
EVERYWHERE = 0.2
"""Of the paths for peaks goes to wherever one could appear, in proportion to light and weight."""


@dataclass(frozen=True)
class PathDemand:
    """Camera paths that would make a single pass known well enough, means over the passes so far."""

    lines: Float
    """(lines,) on each of a line's pixels."""
    blocks: Float
    """(blocks,) of pixels where peaks could appear; (0,): nowhere."""
    size: float = 0.0
    """Of the passes that it was learned from, summed."""

    @classmethod
    def none(cls, projection: Projection) -> PathDemand:
        """Before anything is known."""
        return cls(np.zeros(len(projection.lit)), np.zeros(len(projection.peaks)))

    def learned(
        self, projection: Projection, variance: tuple[Float, Float32], camera_paths: Float32, size: float
    ) -> PathDemand:
        """With what passes of some size tell.

        variance: of a pass, how far it moves lines (lines,) and what it adds to runs of pixels (blocks, runs);
        camera_paths (pixels,): that it was drawn with.
        """
        moves, rises = variance
        drawn, lit = projection.line_means(camera_paths), projection.lit
        least = LEAST_NEED * float(drawn[lit].mean()) if lit.any() else 0.0
        lines, blocks = moves * np.maximum(drawn, least), self.blocks
        share = size / (self.size + size)
        if len(rises):
            found = rises.max(axis=1) * block_sums(camera_paths, len(rises))
            blocks = blocks + share * (found - blocks)
        return PathDemand(self.lines + share * (lines - self.lines), blocks, self.size + size)

    def aim(self, camera_paths: Float32, projection: Projection, width: int, count: float) -> None:
        """Radiance that is expected of each pixel (pixels,) -> its camera paths, `count` in all, where errors matter.

        Where none does light tracing alone remains.
        """
        lines = self._of_lines(projection)[projection.line]
        camera_paths[projection.pixel] = 0.0
        if not len(projection.peaks):
            camera_paths[:] = 0.0
            total = float(lines.sum())
        else:
            of_blocks = self._of_blocks(projection, width)
            total = float(lines.sum() + of_blocks.sum())
            sums = weigh_blocks(camera_paths, projection.peaks)
            scale_blocks(camera_paths, _factors(sums, of_blocks) * (count / max(total, 1e-300)), MOST_CAMERA_PATHS)
        camera_paths[projection.pixel] = np.minimum(lines * (count / max(total, 1e-300)), MOST_CAMERA_PATHS)

    def _of_lines(self, projection: Projection) -> Float:
        """(lines,) by a line's own demand and that of its neighbours; those that need most may miss the goal."""
        lit = projection.lit
        needed = 0.5 * (self.lines + pooled(self.lines, lit)) * lit
        most = all_but_unmet(needed[lit])
        return np.clip(needed, LEAST_NEED * most, most) * lit if most > 0.0 else lit.astype(np.float64)

    def _of_blocks(self, projection: Projection, width: int) -> Float:
        """(blocks,) likewise, by those above and below as well."""
        down, across = int(projection.block_row.max()) + 1, -(-width // BLOCK)
        column = np.arange(len(self.blocks)) * BLOCK % width // BLOCK
        image = np.zeros((down, across))
        np.maximum.at(image, (projection.block_row, column), self.blocks)
        near = uniform_filter1d(image, POOLED, axis=0, mode="constant")[projection.block_row, column]
        needed = 0.5 * (self.blocks + near)
        largest = np.zeros(down)
        np.maximum.at(largest, projection.block_row, needed)
        return np.asarray(np.minimum(needed, all_but_unmet(largest)))


def alike_on_a_line(projection: Projection) -> AlikePixels:
    """All pixels that a scan line is measured on have its random numbers."""
    return AlikePixels(projection.pixel, projection.line, len(projection.lit))


def _factors(sums: Float, of_blocks: Float) -> Float:
    """Radiance times weight in each block (blocks,) -> by what it becomes as many camera paths as the block needs, but
    for EVERYWHERE."""
    total, whole = float(of_blocks.sum()), float(sums.sum())
    factors = (1.0 - EVERYWHERE) * of_blocks / np.where(sums > 0.0, sums, np.inf)
    return np.asarray(factors + (EVERYWHERE * total / whole if whole > 0.0 else 0.0))
