"""Narrow peaks that brighter light hides, measured beside those that stand alone, where the line is chosen later."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import Lines, smoothed_covariances, smoothing_correlation
from analysis.line.detection.detect import SEED_COLUMNS
from analysis.line.detection.hidden import Sought, bend_gain, detect_hidden
from analysis.line.measure import CHUNK, METHODS, line_of, options_of
from analysis.line.methods.seed_loop import CHI2, ROOM, SHARED, TOLD, Pixels, seed_kernel
from analysis.line.result import Flag, Line, positioned, side_by_side
from analysis.line.settings import ExtractionSettings
from render.base.arrays import Float
from render.base.threads import map_chunks

HIDDEN = 4
"""Peaks of a scan line."""
CLEAR = 0.8
"""Of the detection threshold, as it is not for them to say what the line is."""


def with_hidden(line: Line, lines: Lines, settings: ExtractionSettings, threads: int | None) -> Line:
    """Peaks (n, k) of scan lines -> (n, k + HIDDEN). Methods that look at neighbouring scan lines see none beside."""
    estimator = METHODS[settings.method]
    if estimator.halo:
        return line
    correlation = smoothing_correlation(settings.smoothing)
    light = smoothed_covariances(lines.noise, settings.smoothing)
    sought = Sought(
        threshold=CLEAR * settings.threshold,
        gain=bend_gain(correlation),
        scattered=float(light[0, 0]) if light.shape[1] else 0.0,
        width=settings.width or 0.0,
    )
    options = options_of(settings)
    run = seed_kernel(estimator.measure)
    out = np.empty((lines.count, HIDDEN, TOLD))
    flags = np.empty((lines.count, HIDDEN), np.uint8)
    scattering = light, lines.noise.table, lines.noise.fineness, 1.0 / correlation[0] ** 0.5
    known = np.where(line.valid, line.u, np.nan), np.nan_to_num(line.width)

    def work(start: int, stop: int) -> None:
        signal, mask, floor = lines.read(start, stop)
        seeds = np.zeros((stop - start, HIDDEN, SEED_COLUMNS))
        beside = known[0][start:stop], known[1][start:stop]
        detect_hidden(signal, mask, floor, beside, sought, seeds, flags[start:stop])
        room = np.empty((ROOM, signal.shape[1]))
        pixels = Pixels(signal, mask, floor, correlation, 0, room, *scattering)
        run(pixels, seeds, flags[start:stop], options, out[start:stop])

    map_chunks(work, lines.count, CHUNK, threads)
    lost = (flags == Flag.OK) & (out[..., 1] > lines.image.shape[1] / math.sqrt(12.0))
    out[lost], flags[lost] = np.nan, Flag.NOT_CONVERGED
    _as_misfits(out, flags)
    return side_by_side([line, line_of(out, flags, settings, np.zeros(flags.shape), lines)])


def _as_misfits(out: Float, flags: NDArray[np.uint8]) -> None:
    """Flag what was measured (n, k, columns) on light that no fit describes, and widen its sigma by the root of
    chi-square (Birge, Phys. Rev. 40, 1932)."""
    found = positioned(flags)
    sigma, excess = out[found, 1], np.fmax(out[found, CHI2] - 1.0, 0.0)
    out[found, SHARED] = sigma * np.sqrt(excess)
    out[found, 1] = np.hypot(sigma, out[found, SHARED])
    flags[found] = Flag.MISFIT
