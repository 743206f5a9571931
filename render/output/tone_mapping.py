"""Pictures for a screen: numbers to 8-bit colours, and the halved copies that are drawn when zoomed out.

A picture is (h, w) uint32, 0xffRRGGBB. Kernels release the GIL, so that a worker makes them while the window lives.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float32
from render.base.threads import map_chunks

Picture = NDArray[np.uint32]
ROWS = 64
SMALLEST = 256
"""Px a side: pictures are not halved below it."""


@numba.njit(nogil=True, cache=True)
def _byte(value: float, bright: bool) -> np.uint32:
    if not value > 0.0:  # NaN included
        return np.uint32(0)
    value = min(value, 1.0)
    if bright:
        value = math.sqrt(value)
    return np.uint32(255.0 * value + 0.5)


@numba.njit(nogil=True, cache=True)
def _rgb(r: np.uint32, g: np.uint32, b: np.uint32) -> np.uint32:
    return np.uint32(0xFF000000) | (r << np.uint32(16)) | (g << np.uint32(8)) | b


@numba.njit(nogil=True, cache=True)
def _grey(image: Any, low: float, scale: float, bright: bool, out: Picture) -> None:
    for i in range(image.shape[0]):
        for j in range(image.shape[1]):
            value = _byte((np.float64(image[i, j]) - low) * scale, bright)
            out[i, j] = _rgb(value, value, value)


@numba.njit(nogil=True, cache=True)
def _colour(image: Float32, scale: float, bright: bool, out: Picture) -> None:
    for i in range(image.shape[0]):
        for j in range(image.shape[1]):
            r, g, b = image[i, j, 0] * scale, image[i, j, 1] * scale, image[i, j, 2] * scale
            out[i, j] = _rgb(_byte(r, bright), _byte(g, bright), _byte(b, bright))


@numba.njit(nogil=True, cache=True)
def _mapped(image: Float32, low: float, scale: float, table: Picture, empty: np.uint32, out: Picture) -> None:
    last = table.shape[0] - 1
    for i in range(image.shape[0]):
        for j in range(image.shape[1]):
            value = (np.float64(image[i, j]) - low) * scale
            out[i, j] = empty if value != value else table[int(min(max(value, 0.0), 1.0) * last + 0.5)]


@numba.njit(nogil=True, cache=True)
def _halve(picture: Picture, out: Picture) -> None:
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            red = green = blue = np.uint32(0)
            for k in range(2):
                for m in range(2):
                    pixel = picture[min(2 * i + k, picture.shape[0] - 1), min(2 * j + m, picture.shape[1] - 1)]
                    red += (pixel >> np.uint32(16)) & np.uint32(255)
                    green += (pixel >> np.uint32(8)) & np.uint32(255)
                    blue += pixel & np.uint32(255)
            half = np.uint32(2)
            out[i, j] = _rgb((red + half) >> half, (green + half) >> half, (blue + half) >> half)


def grey(image: NDArray[Any], low: float, high: float, bright: bool = False) -> Picture:
    """(h, w) uint8, uint16 or float32 -> picture; `low` is black, `high` white; bright: the square root of it."""
    out = np.empty(image.shape, np.uint32)
    scale = 1.0 / (high - low) if high > low else 0.0
    map_chunks(lambda a, b: _grey(image[a:b], low, scale, bright, out[a:b]), len(image), ROWS)
    return out


def colour(image: Float32, high: float, bright: bool = False) -> Picture:
    """(h, w, 3) float32 RGB -> picture; `high` is white."""
    out = np.empty(image.shape[:2], np.uint32)
    scale = 1.0 / high if high > 0.0 else 0.0
    map_chunks(lambda a, b: _colour(image[a:b], scale, bright, out[a:b]), len(image), ROWS)
    return out


def mapped(image: Float32, low: float, high: float, table: Picture, empty: int = 0xFF000000) -> Picture:
    """(h, w) float32 by a colour table (n,) from low to high; NaN takes `empty`."""
    out = np.empty(image.shape, np.uint32)
    scale = 1.0 / (high - low) if high > low else 0.0
    missing = np.uint32(empty)
    map_chunks(lambda a, b: _mapped(image[a:b], low, scale, table, missing, out[a:b]), len(image), ROWS)
    return out


def pyramid(picture: Picture) -> list[Picture]:
    """The picture and its halves, quarters, ... down to about `SMALLEST`; each pixel is the mean of four."""
    levels = [picture]
    while min(levels[-1].shape) >= 2 * SMALLEST:
        before = levels[-1]
        after = np.empty(((before.shape[0] + 1) // 2, (before.shape[1] + 1) // 2), np.uint32)
        map_chunks(lambda a, b, x=before, y=after: _halve(x[2 * a : 2 * b], y[a:b]), len(after), ROWS)  # type: ignore[misc]
        levels.append(after)
    return levels


def white_level(image: Float32) -> float:
    """A radiance to show as white: that of the 99.9th percentile of what is lit, from a sixteenth of the pixels."""
    some = np.asarray(image[::4, ::4]).ravel()
    some = some[some > 0.0]
    if not len(some):
        return float(image.max(initial=0.0)) or 1.0
    return float(np.percentile(some, 99.9))


def colour_table(name: str, size: int = 256) -> Picture:
    """(size,) of a matplotlib colour map."""
    import matplotlib

    rgba = (matplotlib.colormaps[name](np.linspace(0.0, 1.0, size)) * 255 + 0.5).astype(np.uint32)
    return np.uint32(0xFF000000) | (rgba[:, 0] << np.uint32(16)) | (rgba[:, 1] << np.uint32(8)) | rgba[:, 2]
