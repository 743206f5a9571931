"""Detect and measure every scan line of an image, in chunks on threads. One branch a method."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import MISSING, Lines, smoothing_correlation
from analysis.line.detection.detect import SEED_COLUMNS, detect
from analysis.line.detection.matched_filter import response_gain
from analysis.line.methods.blais_rioux import cross_seeds
from analysis.line.methods.centre_of_mass import weigh_seeds
from analysis.line.methods.derivative import differentiate_seeds
from analysis.line.methods.gaussian_fit import fit_seeds
from analysis.line.methods.half_energy import halve_seeds
from analysis.line.methods.log_fit import fit_logarithms
from analysis.line.methods.phase import turn_seeds
from analysis.line.methods.steger_2d import HALO, fill_gaps, ridge_seeds
from analysis.line.methods.three_point import GAUSS, LINEAR, MAXIMUM, PARABOLA, interpolate_seeds
from analysis.line.methods.threshold import FRACTION, weigh_above
from analysis.line.result import Flag, Line
from analysis.line.settings import ExtractionSettings
from render.base.threads import map_chunks

Float32 = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

CHUNK = 64
"""Scan lines at a time: their electrons stay in the processor's cache."""
TALL_CHUNK = 256
"""The same for methods that look at neighbouring scan lines, which are read again for every chunk."""
NEWTON_STEPS = 50
THREE_POINT = {"row_maximum": MAXIMUM, "linear": LINEAR, "parabola": PARABOLA, "gauss_3": GAUSS}
ARMS = {"blais_rioux_2": 1, "blais_rioux_4": 2, "blais_rioux_8": 4}
TWO_DIMENSIONAL = ("steger_2d", "centre_of_mass_normal")


def measure(lines: Lines, settings: ExtractionSettings, threads: int | None) -> Line:
    """Scan lines -> Line with arrays (n, peaks); a chunk writes its own rows, so threads change nothing."""
    correlation = smoothing_correlation(settings.smoothing)
    out = np.empty((lines.count, settings.peaks, 6))
    flags = np.empty((lines.count, settings.peaks), np.uint8)
    known = settings.width or 0.0
    gain = response_gain(correlation)
    step = lines.noise.step / lines.noise.gain
    halo = HALO if settings.method in TWO_DIMENSIONAL else 0

    def work(start: int, stop: int) -> None:
        first, last = max(0, start - halo), min(lines.count, stop + halo)
        signal, mask, floor = lines.read(first, last)
        own = slice(start - first, stop - first)
        seeds = np.empty((stop - start, settings.peaks, SEED_COLUMNS))
        limits = (settings.threshold, step, gain, known, settings.max_width)
        detect(signal[own], mask[own], floor[own], *limits, seeds, flags[start:stop])
        if halo:
            _measure_ridge(signal, mask, floor, own.start, settings, seeds, flags[start:stop], out[start:stop])
        else:
            _measure_rows(signal, mask, floor, settings, correlation, seeds, flags[start:stop], out[start:stop])

    map_chunks(work, lines.count, TALL_CHUNK if halo else CHUNK, threads)
    # a position that says less than a guess along the whole scan line is none
    lost = out[..., 1] > lines.image.shape[1] / np.sqrt(12.0)
    out[lost], flags[lost] = np.nan, Flag.NOT_CONVERGED
    u, sigma_u, width, amplitude, background, chi2 = (np.ascontiguousarray(out[..., j]) for j in range(6))
    return Line(settings.axis, settings.method, u, sigma_u, width, amplitude, background, chi2, flags)


def _measure_rows(
    signal: Float32,
    mask: Mask,
    floor: Float32,
    settings: ExtractionSettings,
    correlation: Array,
    seeds: Array,
    flags: Mask,
    out: Array,
) -> None:
    """Methods that need no more than the scan line itself."""
    method = settings.method
    if method in ("likelihood", "gaussian"):
        fit_seeds(
            signal,
            mask,
            floor,
            seeds,
            flags,
            method == "likelihood",
            settings.profile == "integrated",
            correlation,
            settings.width is not None,
            settings.max_width,
            out,
        )
    elif method == "centre_of_mass":
        weigh_seeds(signal, mask, floor, seeds, flags, correlation, out)
    elif method in ("centre_of_mass_threshold", "centre_of_mass_subtracted"):
        weigh_above(signal, mask, seeds, flags, FRACTION, method == "centre_of_mass_subtracted", out)
    elif method == "phase":
        turn_seeds(signal, mask, floor, seeds, flags, correlation, out)
    elif method == "half_energy":
        halve_seeds(signal, mask, seeds, flags, out)
    elif method in ("caruana", "guo"):
        fit_logarithms(signal, mask, floor, seeds, flags, method == "guo", correlation, out)
    elif method in THREE_POINT:
        interpolate_seeds(signal, mask, floor, seeds, flags, THREE_POINT[method], correlation, out)
    elif method in ARMS:
        cross_seeds(signal, mask, seeds, flags, ARMS[method], out)
    elif method in ("derivative_of_gaussian", "steger"):
        steps = NEWTON_STEPS if method == "steger" else 0
        differentiate_seeds(signal, mask, floor, seeds, flags, settings.filter_scale, steps, correlation, out)
    else:
        raise ValueError(f"no such method: {method}")


def _measure_ridge(
    signal: Float32,
    mask: Mask,
    floor: Float32,
    offset: int,
    settings: ExtractionSettings,
    seeds: Array,
    flags: Mask,
    out: Array,
) -> None:
    """Methods that look at the scan lines above and below as well."""
    filled = fill_gaps(signal, mask) if (mask & MISSING).any() else signal
    mass = settings.method == "centre_of_mass_normal"
    scale = 1.0 if mass else settings.filter_scale
    ridge_seeds(filled, signal, mask, floor, offset, seeds, flags, scale, mass, settings.smoothing == 0.0, out)
