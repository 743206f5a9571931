"""What the passes of one laser's indirect light have brought so far: all that is needed to go on from there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.threads import map_chunks
from render.laser_indirect.connection_buffer import BLOCK, Take
from render.laser_indirect.guiding import Guide, learn, look_behind, share_samples
from render.laser_indirect.photon_emission import Fan

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
MOST_PASS = 1 << 15
MOST_CAMERA_PASS = 1 << 18
"""Paths a pass: what a wave may take is what is lost where it is cancelled."""
MOST_DOUBLINGS = 2
"""Of the paths from the laser, where camera paths bring nothing."""
LEAST_SHARE = 0.1
"""Of the light, to be looked for from the camera wherever it looks at glass."""
LATER = 1.5
"""Power of their size with which waves weigh: 1 were best, were the first to look where the last do."""
PIXELS_A_CHUNK = 1 << 17
Arrays = dict[str, NDArray[Any]]


@dataclass
class Gathered:
    """Sums over the waves of passes, and where the next ones look; changes as waves are added.

    The second wave is as large as the first, and each after it as all before together, up to a limit. Later ones know
    better where to look, so a wave weighs more than its size; its passes, alike and independent, tell its scatter.
    """

    kinds: int
    """Of light that is gathered (`render.laser_indirect.path_vertex`)."""
    fan: Fan
    size: int
    """Paths from the laser in a pass of the first wave, and half of those from the camera."""
    most: int
    """Limit of the growth of passes (`growth`)."""
    share: float
    """Of the light, what camera paths could help with."""
    clear: NDArray[np.bool_]
    """(pixels,) where the camera looks at a mirror or clear glass; (0,): there is none."""
    samples: Float
    """(pixels,) camera paths to be expected for each pixel, in a pass of the next wave."""
    guide: Guide
    knowledge: Float
    """(rows of the guide, BINS) behind it."""
    total: Float
    """(pixels,) weighted sum of the passes' radiance."""
    helped: Float32
    """(pixels,) of the sum, what camera paths could help with."""
    squares: float = 0.0
    """Sum of `total` squared."""
    waves: int = 0
    passes: int = 0
    """Added so far, in those of the first wave."""
    weight: float = 0.0
    """Of all passes."""
    paths: int = 0
    """From the laser."""
    spread: float = 0.0
    """Variance of `total`, summed over the pixels."""
    error: float = math.inf
    """Relative RMS error of the image so far: sqrt(sum of variances / sum of squares)."""
    dropped: float = 0.0
    """Contributions that were no number, infinite or negative."""
    clamped: float = 0.0
    """Pixels of passes that the clamp has cut."""
    cut: float = 0.0
    """Radiance that it took, weighted sum over pixels and passes."""
    whole: bool = True
    """False within `add`: an interruption there leaves half a wave."""

    @property
    def growth(self) -> int:
        """Size of the next wave's passes, in that of the first's."""
        return min(1 << max(self.waves - 1, 0), self.most)

    @property
    def next_paths(self) -> int:
        """Paths from the laser in a pass of the next wave: more where those from the camera have little to bring."""
        return min(self.size * self.growth, MOST_PASS) << round(MOST_DOUBLINGS * (1.0 - self.share))

    @property
    def wanted(self) -> float:
        """Paths from the camera in a pass of the next wave."""
        return 2 * self.size * self.growth * self.share

    def add(self, takes: list[Take], learnt: Float, clamp: float | None = None, threads: int | None = None) -> None:
        """Fold in a wave of passes (cleared), with what it learnt; clamp: most radiance of one pass in one pixel."""
        self.whole = False
        most, growth, passes = math.inf if clamp is None else clamp, self.growth, len(takes)
        weight = growth**LATER
        found = gather_takes(takes, self.total, self.helped, weight, most, threads)
        light, by_camera, squares, spread, clamped, cut = found
        self.squares += squares
        self.clamped += clamped
        self.cut += weight * cut
        for take in takes:
            self.dropped += float(take.dropped[0])
            take.dropped[0] = 0.0
        self.paths += passes * self.next_paths
        self.waves += 1
        self.passes += passes * growth
        self.weight += passes * weight
        self.spread += weight**2 * spread
        if light > 0.0:
            # the last wave knows it best; but it does not know what it did not look for
            self.share = min(max(by_camera / light, LEAST_SHARE if len(self.clear) else 0.0), 1.0)
        self.error = math.sqrt(self.spread / max(self.squares - self.spread, 1e-300)) if self.squares > 0.0 else 0.0
        self.guide = learn(self.guide, learnt, self.knowledge, threads)
        self.share_out(self.passes / growth)
        self.whole = True

    def share_out(self, drawn: float) -> None:
        """Spread the next wave's camera paths over the pixels, after `drawn` times those of `samples`."""
        share_samples(self.helped, self.guide.width, self.wanted, self.samples, drawn)
        look_behind(self.samples, self.clear, self.wanted)

    def radiance(self, shape: tuple[int, int]) -> Float32:
        """(h, w) the image so far, W/(m^2 sr)."""
        mean = np.empty(len(self.total), np.float32)

        def work(start: int, stop: int) -> None:
            np.divide(self.total[start:stop], self.weight, out=mean[start:stop], casting="same_kind")

        map_chunks(work, len(mean), PIXELS_A_CHUNK)
        return mean.reshape(shape)

    def arrays(self) -> Arrays:
        """As a file holds it."""
        numbers = (self.fan.low, self.fan.high, self.share, self.squares, self.weight, self.spread, self.error)
        return {
            "whole_numbers": np.array(
                (self.kinds, self.size, self.most, self.guide.width, self.waves, self.passes, self.paths)
            ),
            "numbers": np.array((*numbers, self.dropped, self.clamped, self.cut)),
            "fan": self.fan.cumulative,
            "clear": self.clear,
            "samples": self.samples,
            "guide_row": self.guide.row,
            "guide": self.guide.cumulative,
            "knowledge": self.knowledge,
            "total": self.total,
            "helped": self.helped,
        }

    @classmethod
    def of_arrays(cls, arrays: Arrays) -> Gathered:
        """What `arrays` gave. KeyError, ValueError: something else."""
        kinds, size, most, width, waves, passes, paths = (int(number) for number in arrays["whole_numbers"])
        low, high, share, squares, *rest = (float(n) for n in arrays["numbers"])
        weight, spread, error, dropped, clamped, cut = rest
        return cls(
            kinds,
            Fan(low, high, arrays["fan"]),
            size,
            most,
            share,
            arrays["clear"],
            arrays["samples"],
            Guide(width, arrays["guide_row"], arrays["guide"]),
            arrays["knowledge"],
            arrays["total"],
            arrays["helped"],
            squares,
            waves,
            passes,
            weight,
            paths,
            spread,
            error,
            dropped,
            clamped,
            cut,
        )


def gather_takes(
    takes: list[Take],
    total: Float,
    helped: Float32,
    weight: float = 1.0,
    most: float = math.inf,
    threads: int | None = None,
) -> tuple[float, ...]:
    """Fold passes into running sums (pixels,), as `gather` does."""
    images, parts = tuple(take.image for take in takes), tuple(take.helped for take in takes)
    touched = tuple(take.touched for take in takes)
    sums = np.zeros((-(-len(total) // PIXELS_A_CHUNK), 6))

    def work(start: int, stop: int) -> None:
        sums[start // PIXELS_A_CHUNK] = gather(images, parts, touched, total, helped, weight, most, start, stop)

    map_chunks(work, len(total), PIXELS_A_CHUNK, threads)
    return tuple(float(found) for found in sums.sum(axis=0))


@numba.njit(nogil=True, cache=True)
def gather(
    images: tuple[Float, ...],
    helped: tuple[Float32, ...],
    touched: tuple[NDArray[np.bool_], ...],
    total: Float,
    total_helped: Float32,
    weight: float,
    most: float,
    start: int,
    stop: int,
) -> tuple[float, float, float, float, float, float]:
    """Fold passes into the running sums over pixels [start, stop), and clear them; none counts for more than `most`.

    Returns the sums of the passes, of what was helped of them, by how much the sum of total^2 grew, the variance of the
    passes' sum, summed over the pixels, how many pixels were cut, and the radiance that this took.
    """
    light = by_camera = squares = spread = clamped = cut = 0.0
    passes = len(images)
    for block in range(start // BLOCK, (stop + BLOCK - 1) // BLOCK):
        found = False
        for k in range(passes):
            found |= touched[k][block]
            touched[k][block] = False
        if not found:
            continue
        for j in range(block * BLOCK, min((block + 1) * BLOCK, stop)):
            first = second = 0.0
            for k in range(passes):
                value = images[k][j]
                if value != 0.0:
                    if value > most:
                        clamped += 1.0
                        cut += value - most
                        value = most
                    first += value
                    second += value * value
                    images[k][j] = 0.0
                if helped[k][j] != 0.0:
                    by_camera += helped[k][j]
                    total_helped[j] += weight * helped[k][j]
                    helped[k][j] = 0.0
            if first > 0.0:
                before = total[j]
                light += first
                total[j] += weight * first
                squares += total[j] * total[j] - before * before
                if passes > 1:
                    spread += max(passes * second - first * first, 0.0) / (passes - 1)
    return light, by_camera, squares, spread, clamped, cut
