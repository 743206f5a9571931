"""What a lens does to the sharp image: a point spread with a halo, and defocus by depth.

    disc of confusion   c = (v^2 / N') |1/z_focus - 1/z| with v the image distance, N' = v / aperture   (thin lens)

Kernels act on images of pixels that already integrate their area, so that their variance on the grid must be that of
the optics alone, s^2 or c^2 / 16: a Gaussian becomes Lindeberg's discrete one, whose variance is exact at any width.
Light that falls beyond the image is lost.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Float32, Int
from render.base.threads import map_chunks
from render.camera.camera import Camera

STEP = 0.1
"""Step, px, to which diameters of defocus are rounded."""
LARGEST = 100.0
"""Largest diameter of defocus, px, to which larger ones are clipped."""
FINEST = 0.15
"""Variance, px^2, up to which the kernel is 3 x 3."""
SAMPLES = 16
"""Points along a pixel's side by which its coverage by a disc is integrated."""
ROWS = 64
"""Rows a chunk of work."""


def disc_diameter(camera: Camera, depth_z: Float32) -> Float:
    """(h, w) diameter in px of the disc of confusion at depths (h, w) m; 0 where there is none."""
    image_distance = camera.image_distance
    focus = camera.lens.focus_distance
    focal = image_distance if focus is None else 1.0 / (1.0 / image_distance + 1.0 / focus)
    vergence = 0.0 if focus is None else 1.0 / focus
    with np.errstate(divide="ignore", invalid="ignore"):
        diameter = focal / camera.lens.f_number * camera.fx * np.abs(vergence - 1.0 / depth_z.astype(np.float64))
    return np.asarray(np.where(np.isfinite(diameter) & (depth_z > 0.0), np.minimum(diameter, LARGEST), 0.0))


def defocus(image: Float32, diameter: Float, threads: int | None = None) -> Float32:
    """(h, w) light and (h, w) diameters in px -> (h, w): every pixel's light spread over its own disc."""
    lit = image > 0.0
    kind = np.where(lit, np.round(diameter / STEP), 0.0).astype(np.int32)
    used = np.unique(kind)
    if used[-1] == 0:
        return image
    start = np.zeros(int(used[-1]) + 1, np.int64)
    radius = np.zeros(int(used[-1]) + 1, np.int64)
    kernels = []
    at = 0
    for k in used:
        kernel = disc_kernel(int(k) * STEP)
        start[k], radius[k] = at, kernel.shape[0] // 2
        kernels.append(kernel.ravel())
        at += kernel.size
    taps = np.concatenate(kernels)
    out = np.zeros(image.shape)
    map_chunks(
        lambda first, last: _spread(image, kind, taps, start, radius, int(radius.max()), first, last, out),
        image.shape[0],
        ROWS,
        threads,
    )
    return out.astype(np.float32)


@numba.njit(nogil=True, cache=True)
def _spread(  # noqa: PLR0913
    image: Float32,
    kind: Int,
    taps: Float,
    start: NDArray[np.int64],
    radius: NDArray[np.int64],
    largest: int,
    first: int,
    last: int,
    out: Float,
) -> None:
    """Rows first..last - 1 of out: the light that all pixels within reach spread there, summed in a fixed order."""
    h, w = image.shape
    for y in range(max(0, first - largest), min(h, last + largest)):
        for x in range(w):
            light = image[y, x]
            if light <= 0.0:
                continue
            r = radius[kind[y, x]]
            size = 2 * r + 1
            for v in range(max(first, y - r), min(last, y + r + 1)):
                base = start[kind[y, x]] + (v - y + r) * size + r - x
                for u in range(max(0, x - r), min(w, x + r + 1)):
                    out[v, u] += light * taps[base + u]


@lru_cache(maxsize=1024)
def disc_kernel(diameter: float) -> Float:
    """(2 r + 1, 2 r + 1) of unit sum, whose variance along each axis is diameter^2 / 16."""
    variance = diameter * diameter / 16.0
    if variance <= FINEST:
        line = np.array([0.5 * variance, 1.0 - variance, 0.5 * variance])
        return np.outer(line, line)
    # partly covered pixels widen a disc: bisect for the smaller disc that has the variance once rasterised
    low, high = 0.0, diameter
    kernel = _covered(diameter)
    for _ in range(24):
        middle = 0.5 * (low + high)
        kernel = _covered(middle)
        low, high = (middle, high) if _variance(kernel) < variance else (low, middle)
    return kernel


def _covered(diameter: float) -> Float:
    radius = math.ceil(0.5 * diameter + 0.5)
    fine = (np.arange((2 * radius + 1) * SAMPLES) + 0.5) / SAMPLES - 0.5 - radius
    # sampled along y, exact along x, so that the coverage grows smoothly with the diameter
    half = np.sqrt(np.maximum(0.25 * diameter * diameter - fine * fine, 0.0))
    edge = np.arange(-radius, radius + 1) - 0.5
    inside = np.clip(np.minimum(half[:, None], edge + 1.0) - np.maximum(-half[:, None], edge), 0.0, 1.0)
    kernel = inside.reshape(2 * radius + 1, SAMPLES, -1).mean(axis=1)
    kernel = kernel + kernel.T
    return np.asarray(kernel / max(float(kernel.sum()), 1e-300))


def _variance(kernel: Float) -> float:
    x = np.arange(kernel.shape[0]) - kernel.shape[0] // 2
    return float(kernel.sum(axis=0) @ x**2)


class Spread(NamedTuple):
    """A point spread of three Gaussians, sigmas in px; the core has what halo and scatter leave of the light."""

    sigma: float
    halo: float = 0.0
    halo_sigma: float = 0.0
    scatter: float = 0.0
    scatter_sigma: float = 0.0


def point_spread(image: Float32, spread: Spread) -> Float32:
    """(h, w) through (1 - halo - scatter) Gaussian(sigma) + halo Gaussian(halo_sigma) + scatter Gaussian(...).

    A core and two wider scales are the form of measured stray light (Zong, Brown, Johnson, Lykke and Ohno, Applied
    Optics 45, 1111, 2006).
    """
    sharp = _gaussian(image, spread.sigma)
    if spread.halo <= 0.0 and spread.scatter <= 0.0:
        return sharp
    out = np.float32(1.0 - spread.halo - spread.scatter) * sharp
    if spread.halo > 0.0:
        out = out + np.float32(spread.halo) * _gaussian(image, spread.halo_sigma)
    if spread.scatter > 0.0:
        out = out + np.float32(spread.scatter) * _wide_gaussian(image, spread.scatter_sigma)
    return np.asarray(out, np.float32)


def _wide_gaussian(image: Float32, sigma: float) -> Float32:
    """As `_gaussian`, by Fourier transforms, for kernels of hundreds of pixels."""
    from scipy.signal import oaconvolve

    taps = _taps(sigma)[1]
    # beyond the image there is no light, so that a kernel may end where it has left it
    kept = slice(max(0, len(taps) // 2 - max(image.shape)), len(taps) // 2 + max(image.shape) + 1)
    part = oaconvolve(image.astype(np.float64), taps[kept][:, None], mode="same", axes=0)
    return np.asarray(np.maximum(oaconvolve(part, taps[kept][None, :], mode="same", axes=1), 0.0), np.float32)


def _taps(sigma: float) -> tuple[int, Float]:
    """Radius, and the discrete Gaussian of unit sum to either side."""
    from scipy.special import ive

    radius = math.ceil(5.0 * sigma + 3.0)
    taps = ive(np.abs(np.arange(-radius, radius + 1)), sigma * sigma)
    return radius, (taps / taps.sum()).astype(np.float64)


def _gaussian(image: Float32, sigma: float) -> Float32:
    """Separable discrete Gaussian exp(-t) I_n(t), t = sigma^2 (Lindeberg, PAMI 12, 1990); only where there is light."""
    if sigma <= 0.0:
        return image
    from scipy.ndimage import convolve1d

    radius, taps = _taps(sigma)
    rows, columns = np.nonzero((image > 0.0).any(axis=1))[0], np.nonzero((image > 0.0).any(axis=0))[0]
    if len(rows) == 0:
        return image
    box = tuple(
        slice(max(0, int(lit[0]) - radius), min(size, int(lit[-1]) + radius + 1))
        for lit, size in ((rows, image.shape[0]), (columns, image.shape[1]))
    )
    out = image.copy()
    part = convolve1d(image[box], taps, axis=0, mode="constant")
    out[box] = convolve1d(part, taps, axis=1, mode="constant")
    return out
