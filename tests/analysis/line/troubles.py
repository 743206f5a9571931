"""Lines that are not in all respects a Gaussian on level ground, with their true centres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from analysis.line.result import Flag, Line
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
    occluded: float = 0.0
    """Light of the right-hand half of the line that is missing."""


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
}


def photographed(
    trouble: Trouble, signal: float, sigma: float, rows: int, seed: int
) -> tuple[Array, Array, NoiseModel]:
    """Image (rows, w) in electrons, true centres (rows,) and what is known of the noise."""
    rng = np.random.default_rng(seed)
    width = int(120 + 30 * sigma) // 2 * 2
    centre = width / 2 + rng.uniform(-0.5, 0.5, rows)
    peak = signal * max(trouble.overexposure, 1.0)
    mean = expected(width, centre, peak, sigma, 0.0)
    if trouble.neighbour:
        mean += expected(width, centre + max(trouble.neighbour * sigma, 2.0), 0.3 * peak, sigma, 0.0)
    if trouble.halo:
        mean += expected(width, centre + 3.0 * sigma, trouble.halo * peak, 4.0 * sigma, 0.0)
    x = np.arange(width) - centre[:, None]
    slope = trouble.slope * peak * min(sigma / 0.6, 1.0) * min(2.0 / sigma, 1.0)
    ground = BACKGROUND + slope * x
    mean += ground - min(0.0, ground.min() - BACKGROUND)
    image = rng.poisson(mean) + rng.normal(0.0, READ_NOISE, mean.shape)
    if not trouble.overexposure:
        return image.astype(np.float32), centre, electrons(READ_NOISE)
    return np.minimum(image, signal).astype(np.float32), centre, electrons(READ_NOISE, saturation=signal)


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
    good = line.valid[:, 0]
    error = np.abs(line.u[good, 0] - centre[good])
    sigma = line.sigma_u[good, 0]
    if not good.any():
        return Coverage(np.nan, np.nan, 0, 1.0, 0.0, np.nan, np.nan)
    rms = float(np.sqrt(np.mean(error**2)))
    return Coverage(
        float(np.mean(error < sigma)),
        float(np.mean(error < 2.0 * sigma)),
        int(good.sum()),
        float(np.mean(~good)),
        float(np.mean(good & (line.flag[:, 0] != Flag.OK))),
        rms,
        float(np.median(sigma)),
    )


def measured(
    trouble: Trouble, signal: float, sigma: float, rows: int, seed: int, known: bool = True, **changes: object
) -> tuple[Line, Array]:
    """The line as "likelihood" measures it, and the true centres; known: whether the noise model is given."""
    image, centre, noise = photographed(trouble, signal, sigma, rows, seed)
    return extract(image, noise=noise if known else None, **changes), centre
