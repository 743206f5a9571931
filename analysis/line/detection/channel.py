"""The laser's light in an image: mono, one colour less the others, or one colour of a Bayer mosaic, in electrons."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.detection.filled_in import Seen
from analysis.line.detection.noise import NoiseModel
from analysis.line.settings import ExtractionSettings
from render.base.arrays import Float32
from render.base.errors import InputError

Mask = NDArray[np.uint8]

COLOURS = ("red", "green", "blue")
BETWEEN_SEEN = 8.0 / 3.0
"""Scan lines that err alike where every other one is the mean of its neighbours: of variances v and v / 2, whose sum
over two is that of v twice."""
SATURATED, MISSING = 1, 2
"""Bits of a mask: the pixel only says "at least this much"; the pixel is of another colour or not a number."""
DTYPES = ("uint8", "uint16", "float32", "float64")


@dataclass(frozen=True)
class Lines:
    """Scan lines of one image, read in chunks: (n, w) with the scan axis last, whatever it was in the image.

    `channel` is resolved (never "auto"); `smoothing` the sigma of a Gaussian over both directions, px.
    """

    image: NDArray[Any]
    channel: Literal["mono", "red", "green", "blue"]
    pattern: str | None
    noise: NoiseModel
    smoothing: float = 0.0
    variance: NDArray[Any] | None = None
    """(h, w) e-^2, scan axis last, in place of the noise model's: for images combined from several."""
    seen: Seen | None = None
    """(2, 2) as `seen_pixels` says: of a mosaic that is filled in, other pixels count as missing."""

    @property
    def count(self) -> int:
        return self.image.shape[0]

    def read(self, start: int, stop: int) -> tuple[Float32, Mask, Float32]:
        """(n, w) electrons, (n, w) mask, (n, w) or (n, 1) variance that does not come from the signal itself, e-^2.

        The colour difference is I_c - (I_a + I_b) / 2 (Taubin et al. 2014; the founding paper prints a slip).
        """
        if self.smoothing <= 0.0:
            return self._read(start, stop)
        from scipy.ndimage import gaussian_filter

        halo = kernel_radius(self.smoothing)
        low, high = max(0, start - halo), min(self.count, stop + halo)
        signal, mask, floor = self._read(low, high)
        signal[(mask & MISSING) > 0] = 0.0
        smooth = gaussian_filter(signal, self.smoothing, mode="nearest", radius=halo)
        # Cov(i, j) = exp(-(i - j)^2 / 4 s^2) / (4 pi s^2) times the raw variance, smoothed by s / sqrt2, half-way: the
        # floor is what that variance is above the smoothed signal, the factor is `smoothing_correlation`
        variance = gaussian_filter(signal + floor, self.smoothing * math.sqrt(0.5), mode="nearest", radius=halo)
        keep = slice(start - low, stop - low)
        return smooth[keep].copy(), mask[keep].copy(), variance[keep] - smooth[keep]

    def _read(self, start: int, stop: int) -> tuple[Float32, Mask, Float32]:
        signal, mask, floor = self._read_all(start, stop)
        if self.seen is not None:
            rows, columns = np.arange(start, stop) % 2, np.arange(signal.shape[1]) % 2
            between = ~self.seen.any(axis=1, keepdims=True)
            told = self.seen | (between & self.seen.any(axis=0))
            mask[~told[rows[:, None], columns]] |= MISSING
            times = self.summed(start, stop)[:, None]
            signal, floor = signal * times, floor * times
        return signal, mask, floor

    @property
    def alike(self) -> float:
        """Scan lines that err alike, as they are filled in from one another."""
        return 1.0 if self.seen is None or self.seen.any(axis=1).all() else BETWEEN_SEEN

    def summed(self, start: int, stop: int) -> Float32:
        """(n,) scan lines that each stands for: 2 where it is filled in as the mean of those above and below, whose
        sum is a count."""
        if self.seen is None:
            return np.ones(stop - start, np.float32)
        return np.where(self.seen.any(axis=1), np.float32(1), np.float32(2))[np.arange(start, stop) % 2]

    def _read_all(self, start: int, stop: int) -> tuple[Float32, Mask, Float32]:
        chunk = self.image[start:stop]
        if chunk.ndim == 2:
            signal, mask = self._electrons(chunk)
            if self.pattern is not None:
                mask |= self._other_colours(start, stop, chunk.shape[1])
            if self.variance is not None:
                return signal, mask, np.ascontiguousarray(self.variance[start:stop] - signal, dtype=np.float32)
            return signal, mask, np.full((len(signal), 1), self.noise.floor, np.float32)
        if self.channel == "mono":
            signal, mask = self._electrons(chunk.mean(axis=2, dtype=np.float32))
            return signal, mask, np.full((len(signal), 1), self.noise.floor, np.float32)
        laser = COLOURS.index(self.channel)
        first, second = (self._electrons(chunk[..., c])[0] for c in range(3) if c != laser)
        others = first + second
        signal, mask = self._electrons(chunk[..., laser])
        # where the laser saturates its own colour it often fills the others too: keep the plateau
        signal = np.where(mask & SATURATED, signal, signal - np.float32(0.5) * others)
        # var = I_c + (I_a + I_b) / 4 + 1.5 floor, and I_c = difference + (I_a + I_b) / 2
        floor = np.float32(0.75) * np.maximum(others, np.float32(0)) + np.float32(1.5 * self.noise.floor)
        return signal, mask, floor

    def _electrons(self, numbers: NDArray[Any]) -> tuple[Float32, Mask]:
        noise = self.noise
        if numbers.dtype.kind == "u":
            signal, mask = np.empty(numbers.shape, np.float32), np.empty(numbers.shape, np.uint8)
            full = math.inf if noise.saturation is None else noise.saturation
            _count(numbers, full, np.float32(noise.black_level), np.float32(1.0 / noise.gain), signal, mask)
            return signal, mask
        if noise.saturation is None:
            mask = np.zeros(numbers.shape, np.uint8)
        else:
            mask = np.ascontiguousarray(numbers >= noise.saturation).view(np.uint8)
        # in order of its rows, whatever that of the image: kernels would be compiled anew for another
        signal = np.subtract(numbers, noise.black_level, order="C").astype(np.float32, copy=False)
        signal *= np.float32(1.0 / noise.gain)
        bad = ~np.isfinite(signal)
        if bad.any():
            mask[bad] = MISSING
            signal[bad] = 0.0
        return signal, mask

    def _other_colours(self, start: int, stop: int, width: int) -> Mask:
        assert self.pattern is not None
        wanted = self.channel[0].upper()
        tile = np.array([[0 if c == wanted else MISSING for c in self.pattern[k : k + 2]] for k in (0, 2)], np.uint8)
        return np.asarray(np.tile(tile, ((stop - start) // 2 + 2, width // 2 + 1))[start % 2 :][: stop - start, :width])


@njit(nogil=True, cache=True, error_model="numpy")
def _count(numbers: NDArray[Any], full: float, black: float, scale: float, signal: Float32, mask: Mask) -> None:
    """Whole numbers (n, w) -> electrons and mask (n, w)."""
    for y in range(numbers.shape[0]):
        row, out, above = numbers[y], signal[y], mask[y]
        for x in range(row.shape[0]):
            out[x] = (np.float32(row[x]) - black) * scale
        for x in range(row.shape[0]):
            above[x] = np.uint8(np.float32(row[x]) >= full)


def kernel_radius(smoothing: float) -> int:
    """Half length in px of the smoothing kernel."""
    return int(np.ceil(4.0 * smoothing))


def smoothing_correlation(smoothing: float) -> NDArray[np.float64]:
    """(m,) covariance at distance d along the scan line of white unit noise after the 2-D smoothing; [1] without."""
    if smoothing <= 0.0:
        return np.ones(1)
    radius = kernel_radius(smoothing)
    kernel = np.exp(-0.5 * (np.arange(-radius, radius + 1) / smoothing) ** 2)
    kernel /= kernel.sum()
    along = np.correlate(kernel, kernel, "full")[2 * radius :]
    return np.asarray(along * along[0])


def smoothed_covariances(noise: NoiseModel, smoothing: float) -> NDArray[np.float64]:
    """(2, m) as `NoiseModel.covariances`, of an image after the 2-D smoothing."""
    if smoothing <= 0.0 or not noise.scintillation:
        return noise.covariances
    table = noise.table
    radius = kernel_radius(smoothing)
    kernel = np.exp(-0.5 * (np.arange(-radius, radius + 1) / smoothing) ** 2)
    kernel /= kernel.sum()
    pairs = np.correlate(kernel, kernel, "full")
    near = np.zeros(len(table))
    near[: 2 * radius + 1] = pairs[2 * radius :][: len(table)]
    both = np.where(np.arange(len(table)) > 0, 2.0, 1.0)
    spread = [np.convolve(np.append(row[:0:-1], row), pairs) for row in (both * near @ table, both @ table)]
    return np.stack([row[len(row) // 2 :] for row in spread])


def scan_lines(
    image: NDArray[Any], settings: ExtractionSettings, noise: NoiseModel, variance: NDArray[Any] | None = None
) -> Lines:
    """Check an image (h, w) or (h, w, 3) of uint8, uint16, float32 or float64 and choose the laser's channel.

    "auto" takes the colour that stands out most over the other two; mono where no colour does.
    Raises InputError: wrong shape, type or size, no finite pixel, or a channel that the image does not have.
    """
    image = check_image(image)
    channel, smoothing = settings.channel, settings.smoothing
    pattern: str | None = settings.pattern
    if variance is not None:
        if image.ndim != 2 or variance.shape != image.shape:
            found = f"{variance.shape} for an image {image.shape}"
            raise InputError(
                "the variance is not of the image's shape", where="variance", found=found, allowed="(h, w)"
            )
        variance = variance.swapaxes(0, 1) if settings.axis == "columns" else variance
    if settings.axis == "columns":
        image = image.swapaxes(0, 1)
        pattern = None if pattern is None else "".join(pattern[k] for k in (0, 2, 1, 3))
    if pattern is not None and image.ndim == 3:
        raise InputError("a Bayer pattern is given for a colour image", where="pattern", allowed="none, or a raw image")
    if image.ndim == 2 and pattern is None:
        if channel not in ("auto", "mono"):
            raise InputError(
                "the image has no such channel", where="channel", found=channel, allowed="auto or mono on a mono image"
            )
        return Lines(image, "mono", None, noise, smoothing, variance)
    if channel == "auto":
        channel = _strongest_bayer(image, pattern) if pattern is not None else _strongest_colour(image)
    return Lines(image, channel, pattern, noise, smoothing, variance)


def check_image(image: object) -> NDArray[Any]:
    """The image as an array, or InputError naming what is wrong with it."""
    array = np.asarray(image)
    if array.dtype.name not in DTYPES:
        raise InputError("image type is not supported", where="image", found=array.dtype, allowed=", ".join(DTYPES))
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] != 3):
        raise InputError("image shape is wrong", where="image", found=array.shape, allowed="(h, w) or (h, w, 3)")
    if min(array.shape[:2]) < 1 or max(array.shape[:2]) > 65536:
        raise InputError("image size is out of range", where="image", found=array.shape, allowed="1..65536 px a side")
    if array.dtype.kind == "f" and not any(np.isfinite(line).any() for line in array):
        raise InputError("image has no pixel that is a finite number", where="image", found="NaN or infinity only")
    return array


def _strongest_colour(image: NDArray[Any]) -> Literal["mono", "red", "green", "blue"]:
    sample = image[:: max(1, len(image) // 256)].astype(np.float32)
    sample = np.where(np.isfinite(sample), sample, np.float32(0))
    total = sample.sum(axis=2)
    heights = [float(np.max(1.5 * sample[..., c] - 0.5 * total, axis=1).mean()) for c in range(3)]
    best = int(np.argmax(heights))
    names: tuple[Literal["red", "green", "blue"], ...] = ("red", "green", "blue")
    return names[best] if heights[best] > 0 else "mono"


def _strongest_bayer(image: NDArray[Any], pattern: str) -> Literal["red", "green", "blue"]:
    def height(colour: str) -> float:
        tops = []
        for k, letter in enumerate(pattern):
            plane = image[k // 2 :: 2, k % 2 :: 2]
            if letter == colour[0].upper() and plane.size:
                finite = np.where(np.isfinite(plane), plane, 0).astype(np.float32)
                tops.append(float((finite.max(axis=1) - np.median(finite, axis=1)).mean()))
        return max(tops, default=0.0)

    names: tuple[Literal["red", "green", "blue"], ...] = ("red", "green", "blue")
    return max(names, key=height)
