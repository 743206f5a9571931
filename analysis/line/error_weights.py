"""The weights of one laser's light: what an error of a pixel does to its scan line, over what is allowed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from render.base.arrays import Bool, Float, Float32


@dataclass(frozen=True)
class Weights:
    """What becomes of one laser's weights, by scan line: arrays (n, w), those of columns turned."""

    laser: Float32
    peaks: Float32
    ambient: Float32
    """Of all lasers so far, by which peaks appear or a line is told otherwise."""
    moves: Float32
    """Of ambient light, by which it moves this laser's line."""
    illumination: Float32
    response: Float
    """(2, 2) electrons by the laser's radiance, by parity of scan line and place."""
    bands: Float
    """(2, 2) by ambient radiance."""

    def put(
        self,
        lines: slice,
        pixels: tuple[Float32, Float32, Float32],
        of_lines: tuple[Float, Float, Bool],
        numbers: tuple[float, float, float, float],
    ) -> None:
        """Of some scan lines, the first of them even.

        pixels (n, w): mean electrons, by how much one of them moves the line, and how far it goes to make or hide a
        peak; of_lines (n,): sigma told, px, infinite where no line is, the least sigma, px, and whether the fit's width
        is decided by the noise of single pixels; numbers: noise floor, e-^2, share of sigma that is allowed, share of a
        pixel's own noise, and what evenly spread light counts over a peak's.
        """
        everywhere = (self.laser, self.moves, self.peaks, self.ambient, self.illumination)
        arrays = [np.ascontiguousarray(one[lines]) for one in everywhere]
        _put(pixels, of_lines, numbers, self.response, self.bands, tuple(arrays))
        for whole, some in zip(everywhere[:-1], arrays[:-1], strict=True):
            if not np.may_share_memory(whole, some):
                whole[lines] = some


@njit(nogil=True, cache=True, error_model="numpy")
def _put(
    pixels: tuple[Float32, Float32, Float32],
    of_lines: tuple[Float, Float, Bool],
    numbers: tuple[float, float, float, float],
    response: Float,
    bands: Float,
    out: tuple[Float32, Float32, Float32, Float32, Float32],
) -> None:
    """As `Weights.put` -> out: laser, moves, peaks and ambient (n, w); its last is the illumination, which is read."""
    light, move, risen = pixels
    told, least, narrow = of_lines
    floor, allowed, of_pixel, evenly = numbers
    laser, moves, peaks, ambient, illumination = out
    n, w = light.shape
    decided = np.empty(w, np.bool_)
    for y in range(n):
        variance, count = 0.0, 0
        for i in range(w):
            # one more on either side, as windows begin with the pixel
            decided[i] = move[y, i] != 0.0 or _beside(move[y], i) != 0.0
            count += decided[i]
            variance += move[y, i] * move[y, i] * (light[y, i] + floor)
        # a line that is moved by more than it tells asks of no light to be known better than its pixels' noise
        sigma = max(told[y], np.sqrt(variance))
        scale = np.float32(1.0 / (allowed * max(sigma, least[y]))) if 0.0 < sigma < np.inf else np.float32(0.0)
        share = 1.0 / (of_pixel * np.sqrt(max(count, 1)))
        for i in range(w):
            even = risen[y, i] * evenly
            if narrow[y] and decided[i]:
                even = max(even, share / np.sqrt(max(light[y, i] + floor, 1e-2)))
            by_laser = illumination[y, i] * np.float32(response[y & 1, i & 1])
            by_band = illumination[y, i] * np.float32(bands[y & 1, i & 1])
            peaks[y, i] = risen[y, i] * by_laser
            ambient[y, i] = max(ambient[y, i], even * by_band)
            if decided[i]:
                moved = (move[y, i] if move[y, i] != 0.0 else _beside(move[y], i)) * scale
                laser[y, i] = moved * by_laser
                moves[y, i] = moved * by_band


@njit(nogil=True, cache=True, error_model="numpy")
def _beside(move: Float32, i: int) -> float:
    """Of pixel i in those of a scan line (w,): how far the one beside it moves the line, if either does."""
    if i + 1 < len(move) and move[i + 1] != 0.0:
        return float(move[i + 1])
    return float(move[i - 1]) if i > 0 else 0.0
