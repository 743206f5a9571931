"""The accumulator of one laser's indirect light: sums over passes, their variance, and the guiding of the next ones."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Float32, Int
from render.base.nonzero import nonzero_places
from render.base.threads import map_chunks
from render.importance import Importance
from render.laser_indirect.connection_buffer import BLOCK, PassBuffer
from render.laser_indirect.guiding import (
    Guide,
    allocate_camera_paths,
    reserve_for_specular,
    update_guide,
)
from render.laser_indirect.line_goal import LineErrors
from render.laser_indirect.line_paths import PathDemand
from render.laser_indirect.lone_light import keep_largest, lone_light
from render.laser_indirect.photon_emission import FanDistribution

PASSES_A_WAVE = 8
"""Whatever the number of threads. With fewer, a wave says so little of its own variance that a goal which is to be
reached with confidence takes several times the paths."""
MOST_PASS = 1 << 14
MOST_CAMERA_PASS = 1 << 17
"""Most paths of a pass: a cancelled render loses at most one wave."""
MOST_DOUBLINGS = 2
"""Times that light paths are doubled where camera paths can reach nothing, and would be idle."""
LEAST_SHARE = 0.1
"""Least share of the effort that camera paths get where the camera sees glass, behind which light tracing is blind.
Chosen, not tuned."""
WAVE_WEIGHT_EXPONENT = 1.5
"""A wave weighs as its size to this power. 1 is the least variance of waves that sample alike; later ones are better
guided, so more. Chosen, not tuned."""
LEAST_STEP = 0.125
"""Of the passes so far, at least, are in the next wave."""
PIXELS_A_CHUNK = 1 << 17
Arrays = dict[str, NDArray[Any]]
IMAGES = ("specular", "camera_paths", "guide_moments", "total", "camera_radiance", "largest")
NO_DEMAND = PathDemand(np.zeros(0), np.zeros(0))
NUMBERS = (
    *("kinds", "size", "growth_limit", "enough", "camera_share", "squares", "waves", "passes", "weight", "shares"),
    *("paths", "variance_sum", "error", "invalid", "clamped", "clamped_radiance"),
)
"""Fields of an accumulator that a checkpoint keeps, beside its fan and its guide."""


@dataclass
class Accumulator:
    """Weighted sums over waves of passes, and the guiding of the next wave; changes as waves are added.

    The second wave is as large as the first, and each after it as all before together, up to a limit and to what image
    or measured line should take. The passes of a wave are independent and alike, so that their spread is an unbiased
    estimate of its variance.
    """

    kinds: int
    """Kinds of light that are traced (`render.laser_indirect.path_vertex`)."""
    fan: FanDistribution
    size: int
    """Light paths in a pass of the first wave, and half of its camera paths."""
    growth_limit: int
    """Most times that a pass may be larger than those of the first wave."""
    camera_share: float
    """Share of the light that techniques which start at the camera can make as well."""
    specular: NDArray[np.bool_]
    """(pixels,) where the camera sees a mirror or clear glass; (0,): there is none."""
    camera_paths: Float32
    """(pixels,) expected camera paths of each pixel in a pass of the next wave."""
    guide: Guide
    guide_moments: Float
    """(rows of the guide, BINS) second moments that the guide follows from."""
    total: Float
    """(pixels,) weighted sum of the passes' radiance."""
    camera_radiance: Float32
    """(pixels,) of the sum, what techniques that start at the camera can make as well."""
    squares: float = 0.0
    """Sum of `total` squared."""
    waves: int = 0
    passes: int = 0
    """Passes added so far, counted in those of the first wave."""
    weight: float = 0.0
    """Sum of the weights of all passes."""
    shares: float = 0.0
    """Sum over the passes of weight^2 / size: the variance of `total`, in that of a pass of the first wave."""
    target: float = 0.0
    """Error of the image at which it is known well enough; 0: never."""
    enough: int = 0
    """Size of the next wave's passes with which image or line should be known; 0: that is not known, or one is."""
    paths: int = 0
    """Light paths so far."""
    variance_sum: float = 0.0
    """Variance of `total`, summed over the pixels."""
    error: float = math.inf
    """Relative RMS error of the image so far: sqrt(sum of variances / sum of squares)."""
    invalid: float = 0.0
    """Contributions that were NaN, infinite or negative, and were left out."""
    clamped: float = 0.0
    """Pixels of passes that the clamp has lowered."""
    clamped_radiance: float = 0.0
    """Radiance that the clamp took, weighted sum over pixels and passes."""
    largest: Float32 = field(default_factory=lambda: np.zeros(0, np.float32))
    """(pixels,) of the sum, the most that a single pass has in it; (0,): no line is the goal."""
    line: LineErrors | None = None
    """Where errors matter, and what they come to there; None: everywhere alike."""
    demand: PathDemand = NO_DEMAND
    """Camera paths that the measured lines need."""
    aimed: str = ""
    """Digest of the weights that it was aimed by at first."""
    consistent: bool = True
    """False within `add`: an interruption there leaves half a wave in the sums."""

    @property
    def line_error(self) -> float:
        """Deviation of the measured line over the allowed one; infinite: not known."""
        return math.inf if self.line is None else self.line.error(self.weight)

    @property
    def line_deviation(self) -> float:
        """The estimate of it, of which `line_error` is an upper bound."""
        return math.inf if self.line is None else self.line.deviation(self.weight)

    @property
    def next_weight(self) -> float:
        """Weight of each pass of the next wave."""
        return float(self.growth**WAVE_WEIGHT_EXPONENT)

    @property
    def growth(self) -> int:
        """Size of the next wave's passes, in that of the first wave's."""
        most = min(1 << max(self.waves - 1, 0), self.growth_limit)
        return min(most, self.enough) if self.enough else most

    @property
    def next_paths(self) -> int:
        """Light paths in a pass of the next wave: more where camera paths can reach little."""
        return min(self.size * self.growth, MOST_PASS) << round(MOST_DOUBLINGS * (1.0 - self.camera_share))

    @property
    def next_camera_paths(self) -> float:
        """Camera paths in a pass of the next wave."""
        return 2 * self.size * self.growth * self.camera_share

    def add(
        self, buffers: list[PassBuffer], wave_moments: Float, clamp: float | None = None, threads: int | None = None
    ) -> None:
        """Add a wave of passes, whose buffers are zeroed; clamp: most radiance of one pass in one pixel."""
        self.consistent = False
        most, growth, passes = math.inf if clamp is None else clamp, self.growth, len(buffers)
        weight = self.next_weight
        if self.line is not None:
            self.learn(self.line.add(buffers, weight, growth), growth)
            if len(self.line.projection.peaks):
                self.largest = self.largest if len(self.largest) else np.zeros(len(self.total), np.float32)
                keep_largest(buffers, self.largest, weight, most)
        found = sum_passes(buffers, self.total, self.camera_radiance, weight, most, threads)
        light, by_camera, squares, variance_sum, clamped, clamped_radiance = found
        self.squares += squares
        self.clamped += clamped
        self.clamped_radiance += weight * clamped_radiance
        for buffer in buffers:
            self.invalid += float(buffer.invalid[0])
            buffer.invalid[0] = 0.0
        self.paths += passes * self.next_paths
        self.waves += 1
        self.passes += passes * growth
        self.weight += passes * weight
        self.shares += passes * weight**2 / growth
        self.variance_sum += weight**2 * variance_sum
        if light > 0.0:
            # the last wave knows the share best, but nothing of specular pixels that it did not look at
            self.camera_share = min(max(by_camera / light, LEAST_SHARE if len(self.specular) else 0.0), 1.0)
        self.error = (
            math.sqrt(self.variance_sum / max(self.squares - self.variance_sum, 1e-300)) if self.squares > 0.0 else 0.0
        )
        self.guide = update_guide(self.guide, wave_moments, self.guide_moments, threads)
        self.enough = self._enough(self.passes / passes)
        self.guide_camera(self.camera_radiance, self.passes / growth)
        self.consistent = True

    def _enough(self, done: float) -> int:
        """As `enough`, once the waves' sizes add up to `done`: the variance falls as one over their sum."""
        beyond = self.error / self.target if self.target > 0.0 else math.inf
        if self.line is not None and not self.line.out_of_reach:
            beyond = min(beyond, self.line_error)
        if not 1.0 < beyond < math.inf:
            return 0
        return math.ceil(done * max(beyond**2 - 1.0, LEAST_STEP))

    def learn(self, variance: tuple[Float, Float32], size: float) -> None:
        """What passes of some size, whose camera paths are still known, tell of the paths that lines need; variance:
        as for `PathDemand.learned`."""
        if self.line is not None:
            self.demand = self.demand.learned(self.line.projection, variance, self.camera_paths, size)

    def aim_at(self, importance: Importance | None, laser: int) -> None:
        """Know where errors matter from now on, if it was not known or is another; None: everywhere alike."""
        aimed = "" if importance is None else _digest(importance.laser[laser])
        if importance is None:
            self.line = None
        elif self.line is None or self.aimed not in ("", aimed):
            self.line = LineErrors.of(importance, laser)
            self.demand = PathDemand.none(self.line.projection)
            self.line.all_waves = self.shares
        self.aimed = aimed

    def guide_camera(self, radiance: Float32, drawn: float) -> None:
        """Allocate the next wave's camera paths by radiance (pixels,) that techniques which start at the camera can
        make, where each pixel has had `drawn` times its `camera_paths` so far."""
        line = None if self.line is None or self.line.out_of_reach else self.line
        width, count = self.guide.width, self.next_camera_paths
        allocate_camera_paths(radiance, width, count if line is None else None, self.camera_paths, drawn)
        if line is not None:
            self.demand.aim(self.camera_paths, line.projection, width, count)
        reserve_for_specular(self.camera_paths, self.specular, self.next_camera_paths)

    def radiance(self, shape: tuple[int, int]) -> Float32:
        """(h, w) radiance so far, W/(m^2 sr)."""
        mean = np.empty(len(self.total), np.float32)

        def work(start: int, stop: int) -> None:
            np.divide(self.total[start:stop], self.weight, out=mean[start:stop], casting="same_kind")

        map_chunks(work, len(mean), PIXELS_A_CHUNK)
        return mean.reshape(shape)

    def lone(self) -> tuple[Int, Float32] | None:
        """(n,) pixels, and what of `radiance` is a peak beside the line there by one pass alone; None: no line is the
        goal."""
        if self.line is None or not len(self.largest):
            return None
        return lone_light(self.total, self.largest, self.weight, self.line.projection)

    def arrays(self) -> Arrays:
        """What a checkpoint keeps."""
        return {
            **{name: np.array(getattr(self, name)) for name in NUMBERS},
            **{name: getattr(self, name) for name in IMAGES},
            "fan": np.array([self.fan.low, self.fan.high, *self.fan.cumulative]),
            "aimed": np.array(self.aimed),
            "guide_width": np.array(self.guide.width),
            "guide_row": self.guide.row,
            "guide": self.guide.cumulative,
            "demand_lines": self.demand.lines,
            "demand_blocks": self.demand.blocks,
            "demand_size": np.array(self.demand.size),
            **({} if self.line is None else self.line.arrays()),
        }

    @classmethod
    def of_arrays(cls, arrays: Arrays) -> Accumulator:
        """The accumulator that gave `arrays`, of copies of them. KeyError, ValueError: they are of something else."""
        numbers: dict[str, Any] = {name: arrays[name].item() for name in NUMBERS}
        images: dict[str, Any] = {name: arrays[name].copy() for name in IMAGES}
        images["camera_paths"] = images["camera_paths"].astype(np.float32, copy=False)
        low, high, *cumulative = arrays["fan"]
        fan = FanDistribution(float(low), float(high), np.array(cumulative))
        guide = Guide(int(arrays["guide_width"].item()), arrays["guide_row"], arrays["guide"])
        line = LineErrors.of_arrays(arrays) if "line_weight" in arrays else None
        demand = PathDemand(arrays["demand_lines"], arrays["demand_blocks"], float(arrays["demand_size"].item()))
        aimed = str(arrays["aimed"].item())
        return cls(**numbers, **images, fan=fan, guide=guide, line=line, demand=demand, aimed=aimed)


def _digest(weight: Float32) -> str:
    """Of weights (h, w), most of which are zero."""
    pixel = nonzero_places(weight)
    return hashlib.sha256(pixel.tobytes() + weight.ravel()[pixel].tobytes()).hexdigest()


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
def sum_pixels(  # noqa: PLR0913
    images: tuple[Float32, ...],
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


def sum_looks(buffers: list[PassBuffer], camera_radiance: Float32) -> tuple[float, float]:
    """Radiance of passes, and what of it techniques that start at the camera can make, which is also added to
    `camera_radiance` (pixels,); the passes' images are zeroed."""
    images, parts = tuple(buffer.image for buffer in buffers), tuple(buffer.camera_radiance for buffer in buffers)
    touched = tuple(buffer.touched for buffer in buffers)
    sums = np.zeros((-(-len(camera_radiance) // PIXELS_A_CHUNK), 2))

    def work(start: int, stop: int) -> None:
        sums[start // PIXELS_A_CHUNK] = sum_look_pixels(images, parts, touched, camera_radiance, start, stop)

    map_chunks(work, len(camera_radiance), PIXELS_A_CHUNK)
    light, by_camera = sums.sum(axis=0).tolist()
    return light, by_camera


@numba.njit(nogil=True, cache=True)
def sum_look_pixels(
    images: tuple[Float32, ...],
    camera_radiance: tuple[Float32, ...],
    touched: tuple[NDArray[np.bool_], ...],
    total_camera_radiance: Float32,
    start: int,
    stop: int,
) -> tuple[float, float]:
    """Pixels [start, stop) of `sum_looks`."""
    light = by_camera = 0.0
    for k in range(len(images)):
        for block in range(start // BLOCK, (stop + BLOCK - 1) // BLOCK):
            if not touched[k][block]:
                continue
            touched[k][block] = False
            for j in range(block * BLOCK, min((block + 1) * BLOCK, stop)):
                if images[k][j] != 0.0:
                    light += images[k][j]
                    images[k][j] = 0.0
                if camera_radiance[k][j] != 0.0:
                    by_camera += camera_radiance[k][j]
                    total_camera_radiance[j] += camera_radiance[k][j]
                    camera_radiance[k][j] = 0.0
    return light, by_camera
