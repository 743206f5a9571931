"""Detect and measure every scan line of an image, in chunks on threads. One line a method."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import MISSING, Lines, smoothed_covariances, smoothing_correlation
from analysis.line.detection.detect import PRIOR, PRIOR_WIDTHS, Limits
from analysis.line.detection.matched_filter import response_gain
from analysis.line.methods.blais_rioux import measure_zero_crossing
from analysis.line.methods.centre_of_mass import measure_centroid
from analysis.line.methods.derivative import STEGER, ZERO_CROSSING, measure_derivative_zero
from analysis.line.methods.fisher_scoring import LEAST_SQUARES, LIKELIHOOD
from analysis.line.methods.gaussian_fit import measure_gaussian
from analysis.line.methods.half_energy import measure_half_energy
from analysis.line.methods.leaning import keep_doubtful, keep_sure, no_gaussian_by_neighbours, parts_alone
from analysis.line.methods.log_fit import CARUANA, GUO, measure_log_parabola
from analysis.line.methods.misfit import UNLIKELY
from analysis.line.methods.odd_width import moved_by_odd_width
from analysis.line.methods.phase import measure_phase
from analysis.line.methods.seed_loop import (
    COLUMNS,
    CORRELATION_LENGTH,
    FIT,
    LEAN,
    ROOM,
    SHARED,
    TOLD,
    Options,
    Pixels,
    seed_kernel,
)
from analysis.line.methods.shared_width import width_priors
from analysis.line.methods.steger_2d import HALO, NORMAL_CENTROID, RIDGE, fill_gaps, measure_ridge
from analysis.line.methods.three_point import GAUSS, LINEAR, MAXIMUM, PARABOLA, measure_three_pixels
from analysis.line.methods.threshold import SUBTRACTED, WHOLE, measure_above_threshold
from analysis.line.passed_over import pass_over, seeds_of
from analysis.line.result import SYSTEMATIC, Flag, Line
from analysis.line.settings import ExtractionSettings
from render.base.arrays import Long
from render.base.threads import map_chunks

CHUNK = 128
"""Scan lines at a time: their electrons stay in the processor's cache."""
TALL_CHUNK = 256
"""The same for methods that look at neighbouring scan lines, which are read again for every chunk."""
USUAL_WINDOW = 256
"""px; a peak of 20 px, by default the widest, is measured on as many."""


class Estimator(NamedTuple):
    """How a method finds the position of a peak."""

    measure: Callable[..., int]
    """A peak kernel (`methods.seed_loop`)."""
    variant: int = 0
    halo: int = 0
    """Scan lines on either side that it looks at; it then sees them without gaps."""


class Neighbours(NamedTuple):
    """What scan lines tell of the peaks (n, k) beside them."""

    priors: NDArray[np.float64] | None
    """(n, k, widths): column PRIOR of a seed; None where no peak needs any."""
    leaning: NDArray[np.bool_]
    """Taken for one line, and two by the neighbours."""
    parted: NDArray[np.bool_]
    """Parted by noise alone, as the neighbours do not part."""
    passed: Long
    """(n,) peaks that are passed over, as they are none."""

    def of(self, rows: NDArray[np.intp]) -> Neighbours:
        """Of some scan lines (m,)."""
        # all zero: no line needs any
        priors = np.zeros((*self.leaning.shape, len(PRIOR_WIDTHS))) if self.priors is None else self.priors
        return Neighbours(priors[rows], self.leaning[rows], self.parted[rows], self.passed[rows])


METHODS = {
    "likelihood": Estimator(measure_gaussian, LIKELIHOOD),
    "gaussian": Estimator(measure_gaussian, LEAST_SQUARES),
    "phase": Estimator(measure_phase),
    "centre_of_mass": Estimator(measure_centroid),
    "centre_of_mass_threshold": Estimator(measure_above_threshold, WHOLE),
    "centre_of_mass_subtracted": Estimator(measure_above_threshold, SUBTRACTED),
    "centre_of_mass_normal": Estimator(measure_ridge, NORMAL_CENTROID, HALO),
    "half_energy": Estimator(measure_half_energy),
    "row_maximum": Estimator(measure_three_pixels, MAXIMUM),
    "linear": Estimator(measure_three_pixels, LINEAR),
    "parabola": Estimator(measure_three_pixels, PARABOLA),
    "gauss_3": Estimator(measure_three_pixels, GAUSS),
    "caruana": Estimator(measure_log_parabola, CARUANA),
    "guo": Estimator(measure_log_parabola, GUO),
    "blais_rioux_2": Estimator(measure_zero_crossing, 1),
    "blais_rioux_4": Estimator(measure_zero_crossing, 2),
    "blais_rioux_8": Estimator(measure_zero_crossing, 4),
    "derivative_of_gaussian": Estimator(measure_derivative_zero, ZERO_CROSSING),
    "steger": Estimator(measure_derivative_zero, STEGER),
    "steger_2d": Estimator(measure_ridge, RIDGE, HALO),
}


def limits_of(lines: Lines, settings: ExtractionSettings) -> Limits:
    """What counts as a line in these scan lines."""
    return Limits(
        threshold=settings.threshold,
        step=lines.noise.step / lines.noise.gain,
        gain=response_gain(smoothing_correlation(settings.smoothing)),
        width=settings.width or 0.0,
        max_width=settings.max_width,
    )


def measure(
    lines: Lines, settings: ExtractionSettings, threads: int | None, judge: bool = False, passing: bool = False
) -> Line:
    """Scan lines -> Line with arrays (n, peaks); a chunk writes its own rows, so threads change nothing.

    judge: what is no single Gaussian line is measured as two, or flagged; not for who asks how well a line fits.
    passing: where the only peak asked for is no line, the next one is measured (`passed_over`); not for who asks what
    the noise is, without which nobody can tell a line from a bump of it.
    """
    return measure_with_neighbours(lines, settings, threads, judge, passing)[0]


def measure_with_neighbours(
    lines: Lines,
    settings: ExtractionSettings,
    threads: int | None,
    judge: bool = False,
    passing: bool = False,
    told: Neighbours | None = None,
) -> tuple[Line, Neighbours]:
    """As `measure`, and what neighbours tell of each peak.

    told: that, as found before, so that a line whose own pixels change keeps the neighbours that it had.
    """
    priors, estimator = None if told is None else told.priors, METHODS[settings.method]
    run, halo = seed_kernel(estimator.measure), estimator.halo
    correlation = smoothing_correlation(settings.smoothing)
    tells_width = estimator.measure is measure_gaussian and settings.width is None
    out = np.empty((lines.count, settings.peaks, COLUMNS if tells_width else TOLD))
    flags = np.empty((lines.count, settings.peaks), np.uint8)
    limits = limits_of(lines, settings)
    passed = np.zeros(lines.count, np.int64) if told is None else told.passed
    options = options_of(settings)._replace(judge=UNLIKELY if judge else math.inf)

    light = smoothed_covariances(lines.noise, settings.smoothing)
    scattering = light, lines.noise.table, lines.noise.fineness, 1.0 / correlation[0] ** 0.5

    def work(
        start: int,
        stop: int,
        options: Options,
        priors: NDArray[np.float64] | None = None,
        again: NDArray[np.bool_] | None = None,
    ) -> None:
        if again is not None:
            start, stop = _asked_for(again, start, stop)
            if start == stop:
                return
        first, last = max(0, start - halo), min(lines.count, stop + halo)
        signal, mask, floor = lines.read(first, last)
        own = slice(start - first, stop - first)
        seeds, found = seeds_of((signal[own], mask[own], floor[own]), limits, settings.peaks, passed[start:stop])
        if priors is not None:
            seeds[..., PRIOR:] = priors[start:stop]
        if halo and (mask & MISSING).any():
            signal = fill_gaps(signal, mask)
        room = np.empty((ROOM, signal.shape[1]))
        room[:, :USUAL_WINDOW] = np.nan  # what is read before it is written shows
        pixels = Pixels(signal, mask, floor, correlation, own.start, room, *scattering)
        chosen = np.ones(found.shape, np.bool_) if again is None else again[start:stop]
        found[~chosen] = Flag.REJECTED  # the kernel leaves out what is none
        measured = np.empty_like(out[start:stop])
        run(pixels, seeds, found, options, measured)
        out[start:stop][chosen], flags[start:stop][chosen] = measured[chosen], found[chosen]

    def run_all(options: Options, priors: NDArray[np.float64] | None, again: NDArray[np.bool_] | None = None) -> None:
        chunk = TALL_CHUNK if halo else CHUNK
        map_chunks(lambda start, stop: work(start, stop, options, priors, again), lines.count, chunk, threads)

    alike = lines.noise.alike and lines.seen is None
    run_all(options, priors)
    if passing and told is None and settings.peaks == 1:
        pass_over(out, flags, passed, settings.threshold, alike, partial(run_all, options, None))
    together = np.zeros((lines.count, settings.peaks))
    if tells_width and told is None:
        priors, together = _shared_widths(out)
        if priors is not None:
            run_all(options, priors, np.any(priors, axis=(1, 2)))
    farthest = lines.image.shape[1] / np.sqrt(12.0)  # a position that says less than a guess is none
    length = np.maximum(out[..., CORRELATION_LENGTH], lines.alike)
    every = no_gaussian_by_neighbours(out[..., LEAN], out[..., FIT], length, alike) if told is None else told.leaning
    leaning = every & np.isin(flags, (Flag.OK, Flag.UNRESOLVED))
    if leaning.any():
        single = out[leaning]
        run_all(options._replace(judge=0.0), priors, leaning)
        keep_sure(out, flags, leaning, single, farthest)
    parted = parts_alone(flags, out[..., LEAN]) if told is None else told.parted
    alone = parted & (flags == Flag.OK)
    if alone.any():
        double = out[alone]
        run_all(options._replace(judge=math.inf), priors, alone)
        keep_doubtful(out, flags, alone, double)
    lost = out[..., 1] > farthest
    out[lost], flags[lost] = np.nan, Flag.NOT_CONVERGED
    return line_of(out, flags, settings, together, lines), Neighbours(priors, leaning, parted, passed)


def _asked_for(again: NDArray[np.bool_], start: int, stop: int) -> tuple[int, int]:
    """Of the scan lines start .. stop those from the first to the last one that is asked for."""
    asked = start + np.flatnonzero(again[start:stop].reshape(stop - start, -1).any(axis=1))
    return (int(asked[0]), int(asked[-1]) + 1) if len(asked) else (start, start)


def _shared_widths(out: NDArray[np.float64]) -> tuple[NDArray[np.float64] | None, NDArray[np.float64]]:
    """What kernels wrote of peaks (n, k, columns) -> (n, k, widths), column PRIOR of a seed, None where no peak needs
    any, and (n, k), what makes of their column SHARED the error that neighbours have in common."""
    none = np.zeros((len(out), len(PRIOR_WIDTHS)))
    shared = [width_priors(out[:, k, TOLD:], out[:, k, 0], out[:, k, 1]) for k in range(out.shape[1])]
    if all(one is None for one in shared):
        return None, np.zeros(out.shape[:2])
    priors = np.stack([none if one is None else one[0] for one in shared], axis=1)
    return priors, np.stack([none[:, 0] if one is None else one[1] for one in shared], axis=1)


def options_of(settings: ExtractionSettings) -> Options:
    """What a kernel is told of the settings; it judges nothing."""
    return Options(
        variant=METHODS[settings.method].variant,
        integrated=settings.profile == "integrated",
        known_width=settings.width is not None,
        max_width=settings.max_width,
        filter_scale=settings.filter_scale,
    )


def line_of(
    out: NDArray[np.float64],
    flags: NDArray[np.uint8],
    settings: ExtractionSettings,
    together: NDArray[np.float64],
    lines: Lines,
) -> Line:
    """What kernels wrote of peaks (n, k, columns), their flags, and what makes of their column SHARED the error (n, k)
    that neighbours have in common."""
    u, sigma_u, width, amplitude, background, chi2, length = (
        np.ascontiguousarray(out[..., j]) for j in range(CORRELATION_LENGTH + 1)
    )
    if lines.seen is not None:
        times = lines.summed(0, lines.count)[:, None]
        amplitude, background, length = amplitude / times, background / times, np.maximum(length, lines.alike)
    line = Line(settings.axis, settings.method, u, sigma_u, width, amplitude, background, chi2, flags)
    by_width = np.where(together > 0.0, np.nan_to_num(out[..., SHARED]) * together, 0.0)
    common = np.where(np.isin(flags, SYSTEMATIC), np.nan_to_num(out[..., SHARED]), by_width)
    moved = moved_by_odd_width(u, width, flags)
    line = replace(line, sigma_u=np.hypot(sigma_u, moved))
    common = np.where(moved > 0.0, np.copysign(np.hypot(common, moved), common), common)
    return replace(line, length_apart=length, shared_u=common if common.any() else None)
