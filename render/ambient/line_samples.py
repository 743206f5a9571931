"""Samples where errors of the ambient light move a measured line, until each scan line is known well enough.

With weights w (`render.importance`), the variance v of one sample of a pixel and n samples on it, a scan line is known
once the sum of w^2 v / n over its pixels is at most 1. The fewest samples that do so are, by Lagrange's multipliers,

    n_p = w_p sqrt(v_p)  sum over q of w_q sqrt(v_q)

v is found from the samples themselves: of a half, the squared difference between its last samples and those before,
averaged over neighbouring pixels. That of one half decides where the other is sampled, so that this does not depend on
the values that are averaged there. How many samples a line gets follows, like its error, from the difference of both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from render.ambient.coarse_image import CoarseImage
from render.ambient.integrator import CONVERGENCE
from render.ambient.path_tracer import CameraPaths
from render.ambient.pixel_samples import PixelSamples
from render.base.arrays import Float, Int
from render.importance import Importance
from render.run import Run

MARGIN = 1.3
"""By which the variance of a scan line is to be less than allowed: it is known to about a sixth only."""
ENOUGH = 0.05
"""Of what a scan line may be off, by the error of the coarse image in one pixel: where it is less, that is enough."""
AROUND = 3
"""Pixels on each side of those with weight that are sampled as well, so that what a lens blurs into them is no mere
interpolation."""
REACH = 2
"""Pixels on each side over which variances are averaged."""
PILOT, GROWTH, PASSES = 2, 4.0, 12
"""Samples of each half on every pixel at first; most by which a pass multiplies those of a scan line; most passes."""


@dataclass(frozen=True)
class Band:
    """The pixels that are sampled one by one."""

    pixels: Int
    """(m,), in the order of the image."""
    weight: Float
    """(m,) 1 / (W/(m^2 sr)), 0 beside those that matter."""
    line: Int
    """(m,) the scan line of each."""
    place: Int
    """(h, w) of each pixel in `pixels`, -1: it is none of them."""


def band_of(importance: Importance, coarse: CoarseImage) -> Band:
    """Where the error of the coarse image would matter."""
    weight = np.abs(importance.ambient)
    wide = weight * coarse.radiance.max(axis=2) * coarse.error > ENOUGH
    weight = np.where(wide, weight, np.float32(0.0))
    for _ in range(AROUND):
        grown = wide.copy()
        grown[1:] |= wide[:-1]
        grown[:-1] |= wide[1:]
        grown[:, 1:] |= wide[:, :-1]
        grown[:, :-1] |= wide[:, 1:]
        wide = grown
    pixels = np.flatnonzero(wide).astype(np.int32)
    place = np.full(weight.shape, -1, np.int32)
    place.ravel()[pixels] = np.arange(len(pixels), dtype=np.int32)
    width = weight.shape[1]
    line = pixels // width if importance.axis == "rows" else pixels % width
    return Band(pixels, weight.ravel()[pixels].astype(np.float64), line, place)


def sample_band(film: PixelSamples, paths: CameraPaths, band: Band, most: int, run: Run) -> None:
    """Samples of the band until each scan line meets the goal, or `most` are spent. Raises Cancelled."""
    for level in range(1, PILOT + 1):
        film.add(paths, band.pixels, np.full((len(band.pixels), 2), level, np.int32), run.between(0.0, 0.3))
    for _ in range(PASSES):
        count = _wanted(film, band)
        more = count - film.done[band.pixels]
        left, asked = max(most - film.total, 0), more.sum(dtype=np.int64)
        if asked > left:
            count = film.done[band.pixels] + (more * (left / asked)).astype(np.int32)
            more = count - film.done[band.pixels]
        if not more.any():
            return
        film.add(paths, band.pixels, count, run.between(0.3, 1.0))


def line_deviations(film: PixelSamples, band: Band) -> Float:
    """(n,) standard deviation of each scan line with weight over the allowed one, in the colour that is known worst."""
    lines = np.unique(band.line[band.weight > 0.0])
    return np.asarray(np.sqrt(_moments(film, band)[lines]))


def _moments(film: PixelSamples, band: Band) -> Float:
    """Of each scan line of the image the sum of weight^2 times variance, in the colour that is known worst."""
    halves, count = film.means(band.pixels).astype(np.float64), 1.0 / film.done[band.pixels]
    single = (halves[:, 0] - halves[:, 1]) ** 2 / count.sum(axis=1)[:, None]
    variance = _pooled(single, band) * count.sum(axis=1)[:, None] / 4.0
    return np.max([_line_sums(band, band.weight**2 * variance[:, colour]) for colour in range(3)], axis=0)


def _wanted(film: PixelSamples, band: Band) -> Int:
    """(m, 2) samples of each half for the scan lines to meet the goal, shared out as the other half's variance says."""
    done, moments = film.done[band.pixels], MARGIN * _moments(film, band)
    wanted, heavy = done.copy(), (band.weight > 0.0).astype(np.float64)
    for half in range(2):
        variance = _pooled(film.spread[band.pixels, 1 - half].astype(np.float64), band).max(axis=1)
        deviation = np.sqrt(variance) * band.weight
        total, now = _line_sums(band, deviation), _line_sums(band, done[:, half] * heavy)
        needed = np.minimum(MARGIN * total**2 / 2.0, now * moments ** (0.5 / CONVERGENCE))
        # a line that is not known gets something in any case
        needed = np.clip(needed, 1.25 * now, GROWTH * now)
        share = deviation / np.maximum(total, 1e-300)[band.line]
        more = np.maximum(done[:, half], np.ceil(needed[band.line] * share).astype(np.int32))
        wanted[:, half] = np.where(moments[band.line] > 1.0, more, done[:, half])
    return wanted


def _line_sums(band: Band, values: Float) -> Float:
    """Sums over the pixels of each scan line of the image."""
    return np.asarray(np.bincount(band.line, values, minlength=max(band.place.shape)), dtype=np.float64)


def _pooled(values: Float, band: Band) -> Float:
    """Values (m, 3) of the band's pixels, each averaged with its neighbours'."""
    out = np.empty_like(values)
    pool(values, band.pixels, band.place, out)
    return out


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pool(values: Float, pixels: Int, place: Int, out: Float) -> None:
    """Values (m, c) of the pixels (m,), averaged over those within REACH -> out; place (h, w) as in `Band`."""
    height, width = place.shape
    for r in range(pixels.shape[0]):
        row, column, count = pixels[r] // width, pixels[r] % width, 0
        out[r] = 0.0
        for i in range(max(row - REACH, 0), min(row + REACH + 1, height)):
            for j in range(max(column - REACH, 0), min(column + REACH + 1, width)):
                q = place[i, j]
                if q >= 0:
                    count += 1
                    for c in range(values.shape[1]):
                        out[r, c] += values[q, c]
        for c in range(values.shape[1]):
            out[r, c] /= count
