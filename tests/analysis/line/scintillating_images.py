"""Synthetic lines whose light scintillates, by speckle as the renderer draws it or pixel by pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.noise import NoiseModel
from analysis.line.result import Line
from render.sensor.speckle import scintillate, speckle
from tests.analysis.line.line_images import expected, exposed

Array = NDArray[np.float64]
Kind = float | tuple[float, bool]
"""Contrast of independent pixels, or f-number and depolarised of speckle at 450 nm on pixels of 3.45 um."""

NM, PITCH, GAIN, BLACK, READ = 450.0, 3.45e-6, 0.1, 3.0, 2.5
WIDTH, BACKGROUND = 120, 20.0


def scintillating(
    kind: Kind, rows: int, sigma: float, seed: int, amplitude: float = 3000.0
) -> tuple[NDArray[np.uint16], Array]:
    """Image (rows, WIDTH) of 12 bit, and the true centres of a line that winds a little."""
    rng = np.random.default_rng(seed)
    centre = 60 + 2.0 * np.sin(np.arange(rows) / 50) + rng.uniform(-0.5, 0.5)
    light = expected(WIDTH, centre, amplitude, sigma, 0.0)
    if isinstance(kind, float):
        light *= rng.gamma(kind**-2, kind**2, light.shape) if kind else 1.0
    else:
        light = scintillate(light.astype(np.float32), 0, rows, speckle(NM, kind[0], PITCH, kind[1]), seed, 0, 0)
    counts = exposed(light + BACKGROUND, READ, rng)
    return np.clip(np.round(counts * GAIN + BLACK), 0, 4095).astype(np.uint16), centre


def known_noise(kind: Kind) -> NoiseModel:
    """That of `scintillating`."""
    known = NoiseModel(gain=GAIN, black_level=BLACK, read_noise=READ)
    if isinstance(kind, float):
        return known.model_copy(update={"scintillation": ((kind**2,),) if kind else ()})
    field = speckle(NM, kind[0], PITCH, kind[1])
    middle = len(field.correlation) // 2
    table = (field.contrast**2 * field.correlation[middle:, middle:]).tolist()
    update = {"scintillation": tuple(map(tuple, table)), "fineness": field.evenness}
    return known.model_copy(update=update)


def cover(line: Line, centre: Array, sigmas: float) -> float:
    """Share of the errors within so many sigmas."""
    claimed = line.valid[:, 0] & np.isfinite(line.sigma_u[:, 0])
    return float(np.mean(np.abs(line.u[:, 0] - centre)[claimed] < sigmas * line.sigma_u[claimed, 0]))


def variance_of_means(line: Line, centre: Array, rows: int) -> float:
    """Variance of the errors' means over neighbouring rows, over what sigma and correlation length foretell."""
    assert line.correlation_length is not None
    whole = len(centre) // rows * rows
    blocks = [a[:whole].reshape(-1, rows) for a in (line.u[:, 0] - centre, line.sigma_u[:, 0] ** 2)]
    length = line.correlation_length[:whole, 0].reshape(-1, rows)
    seen = np.isfinite(blocks[0]).all(axis=1)
    foretold = np.mean((blocks[1] * length)[seen].mean(axis=1)) / rows
    return float(np.mean(blocks[0][seen].mean(axis=1) ** 2) / foretold)
