"""What the passes of one laser's indirect light have brought so far: all that is needed to go on from there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.threads import map_chunks
from render.laser_indirect.connection_buffer import BLOCK, PassBuffer
from render.laser_indirect.guiding import Guide, allocate_camera_paths, reserve_for_specular, update_guide
from render.laser_indirect.photon_emission import FanDistribution

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
MOST_PASS = 1 << 15
MOST_CAMERA_PASS = 1 << 18
"""Paths a pass: what a wave may take is what is lost where it is cancelled."""
MOST_DOUBLINGS = 2
"""Of the paths from the laser, where camera paths bring nothing."""
LEAST_SHARE = 0.1
"""Of the light, to be looked for from the camera wherever it looks at glass."""
WAVE_WEIGHT_EXPONENT = 1.5
"""Power of their size with which waves weigh: 1 were best, were the first to look where the last do."""
PIXELS_A_CHUNK = 1 << 17
Arrays = dict[str, NDArray[Any]]


@dataclass
class Accumulator:
    """Sums over the waves of passes, and where the next ones look; changes as waves are added.

    The second wave is as large as the first, and each after it as all before together, up to a limit. Later ones know
    better where to look, so a wave weighs more than its size; its passes, alike and independent, tell its scatter.
    """

    kinds: int
    """Of light that is gathered (`render.laser_indirect.path_vertex`)."""
    fan: FanDistribution
    size: int
    """Paths from the laser in a pass of the first wave, and half of those from the camera."""
    growth_limit: int
    """Limit of the growth of passes (`growth`)."""
    camera_share: float
    """Of the light, what camera paths could help with."""
    specular: NDArray[np.bool_]
    """(pixels,) where the camera looks at a mirror or clear glass; (0,): there is none."""
    camera_paths: Float
    """(pixels,) camera paths to be expected for each pixel, in a pass of the next wave."""
    guide: Guide
    guide_moments: Float
    """(rows of the guide, BINS) behind it."""
    total: Float
    """(pixels,) weighted sum of the passes' radiance."""
    camera_radiance: Float32
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
    variance_sum: float = 0.0
    """Variance of `total`, summed over the pixels."""
    error: float = math.inf
    """Relative RMS error of the image so far: sqrt(sum of variances / sum of squares)."""
    dropped: float = 0.0
    """Contributions that were no number, infinite or negative."""
    clamped: float = 0.0
    """Pixels of passes that the clamp has cut."""
    clamped_radiance: float = 0.0
    """Radiance that it took, weighted sum over pixels and passes."""
    consistent: bool = True
    """False within `add`: an interruption there leaves half a wave."""

    @property
    def growth(self) -> int:
        """Size of the next wave's passes, in that of the first's."""
        return min(1 << max(self.waves - 1, 0), self.growth_limit)

    @property
    def next_paths(self) -> int:
        """Paths from the laser in a pass of the next wave: more where those from the camera have little to bring."""
        return min(self.size * self.growth, MOST_PASS) << round(MOST_DOUBLINGS * (1.0 - self.camera_share))

    @property
    def next_camera_paths(self) -> float:
        """Paths from the camera in a pass of the next wave."""
        return 2 * self.size * self.growth * self.camera_share

    def add(
        self, buffers: list[PassBuffer], wave_moments: Float, clamp: float | None = None, threads: int | None = None
    ) -> None:
        """Fold in a wave of passes (cleared), with what it learnt; clamp: most radiance of one pass in one pixel."""
        self.consistent = False
        growth_limit, growth, passes = math.inf if clamp is None else clamp, self.growth, len(buffers)
        weight = growth**WAVE_WEIGHT_EXPONENT
        found = sum_passes(buffers, self.total, self.camera_radiance, weight, growth_limit, threads)
        light, by_camera, squares, variance_sum, clamped, clamped_radiance = found
        self.squares += squares
        self.clamped += clamped
        self.clamped_radiance += weight * clamped_radiance
        for buffer in buffers:
            self.dropped += float(buffer.dropped[0])
            buffer.dropped[0] = 0.0
        self.paths += passes * self.next_paths
        self.waves += 1
        self.passes += passes * growth
        self.weight += passes * weight
        self.variance_sum += weight**2 * variance_sum
        if light > 0.0:
            # the last wave knows it best; but it does not know what it did not look for
            self.camera_share = min(max(by_camera / light, LEAST_SHARE if len(self.specular) else 0.0), 1.0)
        self.error = (
            math.sqrt(self.variance_sum / max(self.squares - self.variance_sum, 1e-300)) if self.squares > 0.0 else 0.0
        )
        self.guide = update_guide(self.guide, wave_moments, self.guide_moments, threads)
        self.allocate(self.passes / growth)
        self.consistent = True

    def allocate(self, drawn: float) -> None:
        """Spread the next wave's camera paths over the pixels, after `drawn` times those of `camera_paths`."""
        allocate_camera_paths(self.camera_radiance, self.guide.width, self.next_camera_paths, self.camera_paths, drawn)
        reserve_for_specular(self.camera_paths, self.specular, self.next_camera_paths)

    def radiance(self, shape: tuple[int, int]) -> Float32:
        """(h, w) the image so far, W/(m^2 sr)."""
        mean = np.empty(len(self.total), np.float32)

        def work(start: int, stop: int) -> None:
            np.divide(self.total[start:stop], self.weight, out=mean[start:stop], casting="same_kind")

        map_chunks(work, len(mean), PIXELS_A_CHUNK)
        return mean.reshape(shape)

    def arrays(self) -> Arrays:
        """As a file holds it."""
        numbers = (
            self.fan.low,
            self.fan.high,
            self.camera_share,
            self.squares,
            self.weight,
            self.variance_sum,
            self.error,
        )
        return {
            "whole_numbers": np.array(
                (self.kinds, self.size, self.growth_limit, self.guide.width, self.waves, self.passes, self.paths)
            ),
            "numbers": np.array((*numbers, self.dropped, self.clamped, self.clamped_radiance)),
            "fan": self.fan.cumulative,
            "clear": self.specular,
            "samples": self.camera_paths,
            "guide_row": self.guide.row,
            "guide": self.guide.cumulative,
            "knowledge": self.guide_moments,
            "total": self.total,
            "helped": self.camera_radiance,
        }

    @classmethod
    def of_arrays(cls, arrays: Arrays) -> Accumulator:
        """What `arrays` gave. KeyError, ValueError: something else."""
        kinds, size, growth_limit, width, waves, passes, paths = (int(number) for number in arrays["whole_numbers"])
        low, high, camera_share, squares, *rest = (float(n) for n in arrays["numbers"])
        weight, variance_sum, error, dropped, clamped, clamped_radiance = rest
        return cls(
            kinds,
            FanDistribution(low, high, arrays["fan"]),
            size,
            growth_limit,
            camera_share,
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
            variance_sum,
            error,
            dropped,
            clamped,
            clamped_radiance,
        )


def sum_passes(
    buffers: list[PassBuffer],
    total: Float,
    camera_radiance: Float32,
    weight: float = 1.0,
    most: float = math.inf,
    threads: int | None = None,
) -> tuple[float, ...]:
    """Fold passes into running sums (pixels,), as `sum_pixels` does."""
    images, parts = tuple(buffer.image for buffer in buffers), tuple(buffer.camera_radiance for buffer in buffers)
    touched = tuple(buffer.touched for buffer in buffers)
    sums = np.zeros((-(-len(total) // PIXELS_A_CHUNK), 6))

    def work(start: int, stop: int) -> None:
        sums[start // PIXELS_A_CHUNK] = sum_pixels(
            images, parts, touched, total, camera_radiance, weight, most, start, stop
        )

    map_chunks(work, len(total), PIXELS_A_CHUNK, threads)
    return tuple(float(found) for found in sums.sum(axis=0))


@numba.njit(nogil=True, cache=True)
def sum_pixels(
    images: tuple[Float, ...],
    camera_radiance: tuple[Float32, ...],
    touched: tuple[NDArray[np.bool_], ...],
    total: Float,
    total_camera_radiance: Float32,
    weight: float,
    most: float,
    start: int,
    stop: int,
) -> tuple[float, float, float, float, float, float]:
    """Fold passes into the running sums over pixels [start, stop), and clear them; none counts for more than `most`.

    Returns the sums of the passes, of what the camera could reach of them, by how much the sum of total^2 grew, the
    variance of the passes' sum, summed over the pixels, how many pixels were clamped, and the radiance that this took.
    """
    light = by_camera = squares = variance_sum = clamped = clamped_radiance = 0.0
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
                        clamped_radiance += value - most
                        value = most
                    first += value
                    second += value * value
                    images[k][j] = 0.0
                if camera_radiance[k][j] != 0.0:
                    by_camera += camera_radiance[k][j]
                    total_camera_radiance[j] += weight * camera_radiance[k][j]
                    camera_radiance[k][j] = 0.0
            if first > 0.0:
                before = total[j]
                light += first
                total[j] += weight * first
                squares += total[j] * total[j] - before * before
                if passes > 1:
                    variance_sum += max(passes * second - first * first, 0.0) / (passes - 1)
    return light, by_camera, squares, variance_sum, clamped, clamped_radiance
