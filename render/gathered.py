"""What the passes of one laser's indirect light have brought so far: all that is needed to go on from there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from render.emission import Fan
from render.guide import Guide, learn, share_samples
from render.joints import Take
from render.threads import map_chunks

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
PIXELS_A_CHUNK = 1 << 17
Arrays = dict[str, NDArray[Any]]


@dataclass
class Gathered:
    """Sums over the passes, and where the next ones look; changes as passes are added."""

    kinds: int
    """Of light that is gathered (`render.vertex`)."""
    fan: Fan
    paths: int
    """From the laser, a pass."""
    wanted: float
    """Camera paths a pass."""
    samples: Float
    """(pixels,) camera paths to be expected for each pixel, a pass."""
    guide: Guide
    knowledge: Float
    """(rows of the guide, BINS) behind it."""
    total: Float
    """(pixels,) sum of the passes' radiance."""
    squares: Float
    """(pixels,) sum of its squares."""
    helped: Float32
    """(pixels,) of the sum, what camera paths could help with."""
    passes: int = 0
    error: float = math.inf
    """Relative RMS error of the image so far: sqrt(sum of variances / sum of squares)."""
    dropped: float = 0.0
    """Contributions that were no number, infinite or negative."""
    clamped: float = 0.0
    """Pixels of passes that the clamp has cut."""
    cut: float = 0.0
    """Radiance that it took, summed over pixels and passes."""
    whole: bool = True
    """False within `add`: an interruption there leaves half a wave."""

    def add(self, takes: list[Take], learnt: Float, clamp: float | None = None, threads: int | None = None) -> None:
        """Fold in a wave of passes (cleared), with what it learnt; clamp: most radiance of one pass in one pixel."""
        self.whole = False
        most = math.inf if clamp is None else clamp
        images, helped = tuple(take.image for take in takes), tuple(take.helped for take in takes)
        sums = np.zeros((-(-len(self.total) // PIXELS_A_CHUNK), 4))

        def work(start: int, stop: int) -> None:
            sums[start // PIXELS_A_CHUNK] = gather(
                images, helped, self.total, self.squares, self.helped, most, start, stop
            )

        map_chunks(work, len(self.total), PIXELS_A_CHUNK, threads)
        first, second, clamped, cut = sums.sum(axis=0)
        self.clamped += float(clamped)
        self.cut += float(cut)
        for take in takes:
            self.dropped += float(take.dropped[0])
            take.dropped[0] = 0.0
        self.passes += len(takes)
        n = self.passes
        variance = max(second - first / n, 0.0) / (n - 1) / n
        mean_square = max(first / n**2 - variance, 1e-300)
        self.error = math.sqrt(variance / mean_square) if first > 0.0 else 0.0
        if self.doubled:
            share_samples(self.helped, self.guide.width, self.wanted, self.samples)
        self.guide = learn(self.guide, learnt, self.knowledge)
        self.whole = True

    @property
    def doubled(self) -> bool:
        """The number of passes is a power of two."""
        return self.passes & (self.passes - 1) == 0

    def radiance(self, shape: tuple[int, int]) -> Float32:
        """(h, w) the image so far, W/(m^2 sr)."""
        return (self.total / self.passes).astype(np.float32).reshape(shape)

    def arrays(self) -> Arrays:
        """As a file holds it."""
        numbers = (self.fan.low, self.fan.high, self.wanted, self.error, self.dropped, self.clamped, self.cut)
        return {
            "whole_numbers": np.array((self.kinds, self.paths, self.passes, self.guide.width)),
            "numbers": np.array(numbers),
            "fan": self.fan.cumulative,
            "samples": self.samples,
            "guide_row": self.guide.row,
            "guide": self.guide.cumulative,
            "knowledge": self.knowledge,
            "total": self.total,
            "squares": self.squares,
            "helped": self.helped,
        }

    @classmethod
    def of_arrays(cls, arrays: Arrays) -> Gathered:
        """What `arrays` gave. KeyError, ValueError: something else."""
        kinds, paths, passes, width = (int(number) for number in arrays["whole_numbers"])
        low, high, wanted, error, dropped, clamped, cut = (float(number) for number in arrays["numbers"])
        return cls(
            kinds,
            Fan(low, high, arrays["fan"]),
            paths,
            wanted,
            arrays["samples"],
            Guide(width, arrays["guide_row"], arrays["guide"]),
            arrays["knowledge"],
            arrays["total"],
            arrays["squares"],
            arrays["helped"],
            passes,
            error,
            dropped,
            clamped,
            cut,
        )


@numba.njit(nogil=True, cache=True)
def gather(
    images: tuple[Float, ...],
    helped: tuple[Float32, ...],
    total: Float,
    squares: Float,
    total_helped: Float32,
    most: float,
    start: int,
    stop: int,
) -> tuple[float, float, float, float]:
    """Fold passes into the running sums over pixels [start, stop), and clear them; none counts for more than `most`.

    Returns the sums of total^2 and of squares, the pixels that were cut, and the radiance that this took.
    """
    first = second = cut = clamped = 0.0
    for j in range(start, stop):
        for k in range(len(images)):
            value = images[k][j]
            if value != 0.0:
                if value > most:
                    clamped += 1.0
                    cut += value - most
                    value = most
                total[j] += value
                squares[j] += value * value
                total_helped[j] += helped[k][j]
                images[k][j] = 0.0
                helped[k][j] = 0.0
        first += total[j] * total[j]
        second += squares[j]
    return first, second, clamped, cut
