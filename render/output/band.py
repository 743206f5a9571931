"""A frame of which only a band of pixels is kept as it was rendered: what lies outside is told coarsely.

Outside the band every light is the mean of what its block of pixels holds there: the frame is developed with about the
background and the noise that were there, and compresses to next to nothing. Of the truth nothing is there. Inside, and
in the exact line, no bit differs.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Float32
from render.frame import Frame, Truth

Mask = NDArray[np.bool_]

HALF_WIDTH = 32
"""px along the scan line on either side of a line: where a fit, its slope of the background and its search for the
line's end reach."""
ALONG = 2
"""Scan lines on either side."""
BLOCK = 16
"""px a side."""


def band_about(shape: tuple[int, int], axis: str, lines: Iterable[tuple[Float, Float]]) -> Mask:
    """(h, w) image: the pixels near any of some points, each given as scan lines (n,) and positions along them (n,).

    axis: "rows" or "columns" are scan lines. Points that are no number are left out.
    """
    height, width = shape if axis == "rows" else shape[::-1]
    edges = np.zeros((height, width + 1), np.int32)
    for index, position in lines:
        here = np.isfinite(index) & np.isfinite(position)
        row, at = np.round(index[here]).astype(np.int64), np.round(position[here]).astype(np.int64)
        low, high = np.clip(at - HALF_WIDTH, 0, width), np.clip(at + HALF_WIDTH + 1, 0, width)
        for shift in range(-ALONG, ALONG + 1):
            inside = (row + shift >= 0) & (row + shift < height)
            np.add.at(edges, (row[inside] + shift, low[inside]), 1)
            np.add.at(edges, (row[inside] + shift, high[inside]), -1)
    mask = np.cumsum(edges, axis=1)[:, :-1] > 0
    return mask if axis == "rows" else np.ascontiguousarray(mask.T)


def coarse_outside(frame: Frame, band: Mask) -> Frame:
    """The frame with means of blocks in place of the light outside the band (h, w), and without truth there."""

    def coarse(light: Float32) -> Float32:
        return np.where(band if light.ndim == 2 else band[..., None], light, block_means(light, ~band))

    truth = frame.truth
    if truth is not None:
        images: dict[str, Any] = {}
        for name in ("depth_z", "depth_range", "position", "normal"):
            values = getattr(truth, name)
            images[name] = np.where(band if values.ndim == 2 else band[..., None], values, np.float32(np.nan))
        truth = Truth(**images, object_id=np.where(band, truth.object_id, np.int32(-1)))
    return replace(
        frame,
        laser_direct=tuple(coarse(light) for light in frame.laser_direct),
        laser_indirect=tuple(coarse(light) for light in frame.laser_indirect),
        ambient=None if frame.ambient is None else coarse(frame.ambient),
        truth=truth,
    )


def block_means(light: Float32, counted: Mask) -> Float32:
    """(h, w) or (h, w, 3) -> the same shape: each pixel the mean of those of its block that are counted (h, w)."""
    height, width = light.shape[:2]
    rows, columns = np.arange(0, height, BLOCK), np.arange(0, width, BLOCK)

    def sums(values: NDArray[Any]) -> Float:
        return np.add.reduceat(np.add.reduceat(values, rows, axis=0, dtype=np.float64), columns, axis=1)

    weight = counted if light.ndim == 2 else counted[..., None]
    counts = np.maximum(sums(counted), 1.0)
    means = sums(np.where(weight, light, np.float32(0.0))) / counts.reshape(counts.shape + (1,) * (light.ndim - 2))
    small = means.astype(np.float32)
    return np.repeat(np.repeat(small, BLOCK, axis=0)[:height], BLOCK, axis=1)[:, :width]


def told(share: float) -> str:
    """What is to be known of a frame of which this share of the pixels is kept."""
    return (
        f"the frames are kept as a band about the line, {share:.0%} of the pixels, and elsewhere as means of "
        f"{BLOCK} px blocks: a peak there that other settings would find is not seen"
    )
