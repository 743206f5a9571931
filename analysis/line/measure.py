"""Detect and measure every scan line of an image, in chunks on threads. One branch a method."""

from __future__ import annotations

import numpy as np

from analysis.line.centre_of_mass import weigh_seeds
from analysis.line.channel import Lines, smoothing_correlation
from analysis.line.detect import SEED_COLUMNS, detect
from analysis.line.fit import fit_seeds
from analysis.line.matched_filter import response_gain
from analysis.line.result import Line
from analysis.line.settings import ExtractionSettings
from render.threads import map_chunks

CHUNK = 64
"""Scan lines at a time: their electrons stay in the processor's cache."""


def measure(lines: Lines, settings: ExtractionSettings, threads: int | None) -> Line:
    """Scan lines -> Line with arrays (n, peaks); a chunk writes its own rows, so threads change nothing."""
    correlation = smoothing_correlation(settings.smoothing)
    out = np.empty((lines.count, settings.peaks, 6))
    flags = np.empty((lines.count, settings.peaks), np.uint8)
    known = settings.width or 0.0
    gain = response_gain(correlation)
    step = lines.noise.step / lines.noise.gain

    def work(start: int, stop: int) -> None:
        signal, mask, floor = lines.read(start, stop)
        here, flag = out[start:stop], flags[start:stop]
        seeds = np.empty((stop - start, settings.peaks, SEED_COLUMNS))
        detect(signal, mask, floor, settings.threshold, step, gain, known, settings.max_width, seeds, flag)
        if settings.method == "centre_of_mass":
            weigh_seeds(signal, mask, floor, seeds, flag, correlation, here)
        else:
            likelihood, integrated = settings.method == "likelihood", settings.profile == "integrated"
            fit_seeds(
                signal,
                mask,
                floor,
                seeds,
                flag,
                likelihood,
                integrated,
                correlation,
                known > 0,
                settings.max_width,
                here,
            )

    map_chunks(work, lines.count, CHUNK, threads)
    u, sigma_u, width, amplitude, background, chi2 = (np.ascontiguousarray(out[..., j]) for j in range(6))
    return Line(settings.axis, settings.method, u, sigma_u, width, amplitude, background, chi2, flags)
