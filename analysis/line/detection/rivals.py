"""What the detection leaves open, pixel by pixel: how little light would make a peak, or one above the line."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from scipy.ndimage import median_filter

from analysis.line.detection.matched_filter import BLOCK, NOISE_GAIN, RADIUS, TAPS
from analysis.line.detection.noise import NoiseModel
from analysis.line.settings import ExtractionSettings
from render.base.arrays import Bool, Float, Float32

CERTAIN = 3.0
"""Standard deviations of the render by which a response must stay away from what would change a row."""
NEAREST = 0.25
"""Of the detection threshold, in the noise of line and rival: nearer than this to a change the sensor decides."""
AROUND = 3.0
"""Sigmas of a line within which it is itself the peak."""


def rival_weights(
    light: Float32, peaks: tuple[Float, Float, Bool], noise: NoiseModel, extraction: ExtractionSettings
) -> Float32:
    """Mean electrons (n, w) of some scan lines, without noise, and position and width of their peaks (n, k), px, with
    which of them are valid -> (n, w) weight of an electron, in what each pixel is away from a change of the detection.
    """
    u, width, valid = peaks
    n, w = light.shape
    response = np.empty((n, w), np.float32)
    respond_evenly(light, TAPS.astype(np.float32)[RADIUS:].astype(np.float64), response)
    block = max(1, min(BLOCK, w // 8))
    means = response[:, : w // block * block].reshape(n, -1, block).mean(axis=2)
    medians = median_filter(means, (1, 7), mode="nearest")
    margins = extraction.threshold * np.sqrt(NOISE_GAIN * np.maximum(medians + noise.floor, 1e-2))
    # alone, the strongest peak is the line, and another one counts only where it would be higher
    top = np.zeros(n, np.float32)
    if extraction.select == "strongest" and u.shape[1] == 1:
        centre = np.clip(np.rint(np.where(valid[:, 0], u[:, 0], 0.0)).astype(np.int64), 0, w - 1)
        row, column = np.arange(n), np.minimum(centre // block, medians.shape[1] - 1)
        top = np.where(valid[:, 0], response[row, centre] - medians[row, column], np.float32(0.0))
    reach = AROUND * np.maximum(width, 1.0)
    blocks = medians, margins.astype(np.float32), block
    numbers = (
        noise.floor,
        NOISE_GAIN,
        noise.table[0, 0] if noise.scintillation else 0.0,
        NEAREST * extraction.threshold,
        CERTAIN * TAPS[RADIUS],
    )
    _weigh_rivals(response, top, np.where(valid, u, np.nan), reach, blocks, tuple(map(np.float32, numbers)), response)
    return response


@njit(nogil=True, cache=True, error_model="numpy")
def respond_evenly(light: Float32, taps: Float, out: Float32) -> None:
    """(n, w) correlated along its rows with taps (RADIUS + 1,) from the middle on, edges repeated."""
    w = light.shape[1]
    row = np.empty(w + 2 * RADIUS)
    for y in range(light.shape[0]):
        for i in range(w):
            row[i + RADIUS] = light[y, i]
        for j in range(RADIUS):
            row[j] = row[RADIUS]
            row[w + RADIUS + j] = row[w + RADIUS - 1]
        for i in range(w):
            total = row[i + RADIUS] * taps[0]
            for d in range(RADIUS, 0, -1):
                total += (row[i + RADIUS - d] + row[i + RADIUS + d]) * taps[d]
            out[y, i] = total


@njit(nogil=True, cache=True, error_model="numpy")
def _weigh_rivals(
    response: Float32,
    top: Float32,
    u: Float,
    reach: Float,
    blocks: tuple[Float32, Float32, int],
    numbers: tuple[np.float32, np.float32, np.float32, np.float32, np.float32],
    out: Float32,
) -> None:
    """Response (n, w), height of the line (n,), peaks and their reach (n, k), u NaN where none is -> out (n, w), which
    may be the response.

    blocks: background and threshold (n, b), each of so many pixels. numbers: floor, variance of the response over that
    of a pixel, of the light by scintillation, least distance over the noise, and the weight at unit distance.
    """
    medians, margins, block = blocks
    floor, gain, scattered, least, unit = numbers
    n, w = response.shape
    away, zero, dark, last = np.empty(w, np.float32), np.float32(0.0), np.float32(1e-2), medians.shape[1] - 1
    for y in range(n):
        for b in range(last + 1):
            margin, median = margins[y, b], medians[y, b]
            change = max(margin, top[y])
            for i in range(b * block, w if b == last else (b + 1) * block):
                away[i] = abs(change - (response[y, i] - median))
        for k in range(u.shape[1]):
            if u[y, k] == u[y, k]:
                first, end = math.floor(u[y, k] - reach[y, k]), math.ceil(u[y, k] + reach[y, k]) + 1
                for i in range(max(first, 0), min(end, w)):
                    if abs(i - u[y, k]) <= reach[y, k]:
                        margin = margins[y, min(i // block, last)]
                        away[i] = max(top[y] - margin, margin)
        for b in range(last + 1):
            median, squared = medians[y, b], top[y] * top[y]
            for i in range(b * block, w if b == last else (b + 1) * block):
                variance = (max(response[y, i], zero) + (top[y] + floor)) * gain
                bright = max(response[y, i] - median, zero)
                variance += scattered * (bright * bright + squared)
                out[y, i] = unit / max(away[i], least * np.sqrt(max(variance, dark)))
