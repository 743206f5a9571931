"""Lines that are not in all respects a Gaussian on level ground, with their true centres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d, gaussian_filter

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from analysis.line.result import SYSTEMATIC, Flag, Line
from analysis.measures import means
from tests.analysis.line.line_images import electrons, expected

Array = NDArray[np.float64]

READ_NOISE, BACKGROUND = 2.5, 10.0
SIGNALS = (100.0, 300.0, 1000.0, 3000.0, 10000.0)
"""Electrons of the peak."""
WIDTHS = (0.2, 0.6, 2.0, 8.0)
"""px."""


@dataclass(frozen=True)
class Trouble:
    """What is there besides a Gaussian line on level ground; lengths in px or, for blended lines, in sigmas."""

    slope: float = 0.0
    """Of the background, of the peak a pixel, for lines of 0.6 to 2 px; of others in proportion less."""
    neighbour: float = 0.0
    """Distance in sigmas, at least 2 px, of a line of 30 % of the height; 0: none."""
    overexposure: float = 0.0
    """Peak over the full well; 0: nothing is clipped."""
    halo: float = 0.0
    """Height, of the peak, of a glow 3 sigmas beside, 4 sigmas wide."""
    edge: float = 1.0
    """Light, of that to its left, beyond an edge that crosses the line by one px in `EDGE_ROWS` scan lines; of 0,
    where the middle of the line is hidden nothing is compared."""
    defocus: float = 0.0
    """Radius of the circle of confusion in sigmas."""
    reflection: float = 0.0
    """Height, of the peak, of a light 3 sigmas wide that lies 5 sigmas beside, as a groove's other wall throws it."""
    texture: float = 0.0
    """Relative standard deviation of what reflects the line, alike over `TEXTURE_GRAIN` pixels and scan lines."""
    mosaic: bool = False
    """Every other pixel of every other scan line is seen, the rest filled in from them."""


PLAIN = Trouble()
TROUBLES = {
    "plain": PLAIN,
    "slope 0.3 %": Trouble(slope=0.003),
    "slope 1 %": Trouble(slope=0.01),
    "slope 3 %": Trouble(slope=0.03),
    "neighbour at 1.4 sigma": Trouble(neighbour=1.4),
    "neighbour at 2 sigma": Trouble(neighbour=2.0),
    "neighbour at 3 sigma": Trouble(neighbour=3.0),
    "saturated 30 times, halo": Trouble(overexposure=30.0, halo=0.005),
    "saturated 300 times, halo": Trouble(overexposure=300.0, halo=0.005),
    "slanted edge to 30 %": Trouble(edge=0.3),
    "partly occluded": Trouble(edge=0.0),
    "defocus of 2 sigma": Trouble(defocus=2.0),
    "reflection of 10 %": Trouble(reflection=0.1),
    "texture of 5 %": Trouble(texture=0.05),
    "mosaic": Trouble(mosaic=True),
}
EDGE_ROWS = 10.0
TEXTURE_GRAIN = 2.0
"""px, standard deviation of the filter that makes a texture of white noise."""
SLANT = 0.0137
"""px a scan line, of a line that a mosaic sees."""
FINEST_PARTS = 5
"""Of a pixel, and of a sigma, in which the light of a spoiled line is counted."""


def photographed(
    trouble: Trouble, signal: float, sigma: float, rows: int, seed: int
) -> tuple[Array, Array, NoiseModel]:
    """Image (rows, w) in electrons, true centres (rows,) and what is known of the noise."""
    rng = np.random.default_rng(seed)
    width = int(120 + 30 * sigma) // 2 * 2
    centre = width / 2 + rng.uniform(-0.5, 0.5, rows)
    if trouble.mosaic:  # what is filled in is of other scan lines, and right where the line is straight
        centre = width / 2 + SLANT * (np.arange(rows) - 0.5 * rows)
    peak = signal * max(trouble.overexposure, 1.0)
    mean = _spoiled(trouble, width, centre, peak, sigma, rng)
    if trouble.neighbour:
        mean += expected(width, centre + max(trouble.neighbour * sigma, 2.0), 0.3 * peak, sigma, 0.0)
    if trouble.halo:
        mean += expected(width, centre + 3.0 * sigma, trouble.halo * peak, 4.0 * sigma, 0.0)
    if trouble.reflection:
        mean += expected(width, centre + 5.0 * sigma, trouble.reflection * peak, 3.0 * sigma, 0.0)
    x = np.arange(width) - centre[:, None]
    slope = trouble.slope * peak * min(sigma / 0.6, 1.0) * min(2.0 / sigma, 1.0)
    ground = BACKGROUND + slope * x
    mean += ground - min(0.0, ground.min() - BACKGROUND)
    image = rng.poisson(mean) + rng.normal(0.0, READ_NOISE, mean.shape)
    if trouble.edge == 0.0:
        centre = np.where(edges(rows) > 0.0, centre, np.nan)
    if trouble.mosaic:
        return filled_in(image).astype(np.float32), centre, electrons(READ_NOISE, alike=True)
    if not trouble.overexposure:
        return image.astype(np.float32), centre, electrons(READ_NOISE)
    return np.minimum(image, signal).astype(np.float32), centre, electrons(READ_NOISE, saturation=signal)


def _spoiled(trouble: Trouble, width: int, centre: Array, peak: float, sigma: float, rng: np.random.Generator) -> Array:
    """(rows, width) mean light of the line itself, in parts of a pixel where its shape is not that of a Gaussian."""
    if trouble.defocus == 0.0 and trouble.edge == 1.0 and trouble.texture == 0.0:
        return expected(width, centre, peak, sigma, 0.0)
    parts = max(FINEST_PARTS, int(np.ceil(FINEST_PARTS / sigma)) // 2 * 2 + 1)
    light = expected(width * parts, (centre + 0.5) * parts - 0.5, peak / parts, sigma * parts, 0.0)
    x = (np.arange(width * parts) + 0.5) / parts - 0.5 - centre[:, None]
    if trouble.defocus:
        radius = trouble.defocus * sigma * parts
        offsets = np.arange(-int(radius), int(radius) + 1)
        chord = np.sqrt(radius**2 - offsets**2)
        light = convolve1d(light, chord / chord.sum(), axis=1)
    if trouble.edge != 1.0:
        light *= np.where(x > edges(len(centre))[:, None], trouble.edge, 1.0)
    if trouble.texture:
        light *= 1.0 + trouble.texture * textured(light.shape, rng, parts)
    return np.asarray(light.reshape(len(centre), width, parts).sum(axis=2))


def textured(shape: tuple[int, int], rng: np.random.Generator, parts: int = 1) -> Array:
    """(rows, columns) of unit variance, so many columns to a pixel."""
    field = gaussian_filter(rng.normal(size=shape), (TEXTURE_GRAIN, TEXTURE_GRAIN * parts), mode="wrap")
    return np.asarray(field / field.std())


def edges(rows: int) -> Array:
    """(rows,) px from the line's centre to an edge that crosses it, in the middle of the scan lines from the left."""
    return (np.arange(rows) - 0.5 * rows) / EDGE_ROWS


def filled_in(image: Array) -> Array:
    """A colour that a Bayer mosaic sees at even columns of even scan lines (h, w), bilinear between them."""
    seen = np.zeros(image.shape)
    seen[::2, ::2] = image[::2, ::2]
    weights = np.array([0.5, 1.0, 0.5])
    return np.asarray(convolve1d(convolve1d(seen, weights, axis=0), weights, axis=1))


@dataclass(frozen=True)
class Coverage:
    """Of the points that have a position."""

    one: float
    """Share of the errors below one sigma."""
    two: float
    count: int
    lost: float
    """Share of the scan lines without a position."""
    flagged: float
    """Share of them with a position and a flag that is not OK."""
    rms: float
    sigma: float
    """Median."""


def coverage(line: Line, centre: Array) -> Coverage:
    """How often the error is below sigma, and below twice sigma."""
    good = line.valid[:, 0] & np.isfinite(centre)
    error = np.abs(line.u[good, 0] - centre[good])
    sigma = line.sigma_u[good, 0]
    if not good.any():
        return Coverage(np.nan, np.nan, 0, 1.0, 0.0, np.nan, np.nan)
    rms = float(np.sqrt(np.mean(error**2)))
    return Coverage(
        float(np.mean(error < sigma)),
        float(np.mean(error < 2.0 * sigma)),
        int(good.sum()),
        float(np.mean(~good[np.isfinite(centre)])),
        float(np.mean((good & (line.flag[:, 0] != Flag.OK))[np.isfinite(centre)])),
        rms,
        float(np.median(sigma)),
    )


def variance_of_means(line: Line, centre: Array, rows: int) -> float:
    """Mean square of the errors' means over neighbouring scan lines, over what is told of them."""
    index = np.flatnonzero(line.valid[:, 0] & np.isfinite(centre))
    shared = np.zeros(len(line.u)) if line.shared_u is None else line.shared_u[:, 0]
    assert line.length_apart is not None
    error, sigma, length = line.u[:, 0] - centre, line.sigma_u[:, 0], line.length_apart[:, 0]
    of_rows = (one[index] for one in (error, sigma, length, shared, np.isin(line.flag[:, 0], SYSTEMATIC)))
    found, told = means(*of_rows, index, np.zeros_like(index), rows)
    return float(np.mean(found**2) / np.mean(told**2))


def measured(
    trouble: Trouble, signal: float, sigma: float, rows: int, seed: int, known: bool = True, **changes: object
) -> tuple[Line, Array]:
    """The line as "likelihood" measures it, and the true centres; known: whether the noise model is given."""
    image, centre, noise = photographed(trouble, signal, sigma, rows, seed)
    return extract(image, noise=noise if known else None, **changes), centre
