"""What a fit leaves over, taken apart: noise that grows with the light, and noise that multiplies it.

    E[r r'] = R Cov R',  R = 1 - J (J' W J)^-1 J' W          the fit takes four numbers out of every scan line
    Cov     = B + K diag(L) + c (L L') o rho                 noise of the background, which is known, of the line's
                                                             light L as a count, and its scintillation

The moments of r are linear in K and in c rho(k, d), k scan lines and d pixels apart. Each is weighted as the score of a
normal likelihood weighs it (minimum norm quadratic estimation: C. R. Rao, J. Multivariate Analysis 1, 445, 1971), with
the rows in runs of neighbours, which left out in turn tell how well each number is known (Quenouille's jackknife).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import Lines
from analysis.line.methods.line_profile import profile
from analysis.line.result import Flag, Line
from render.base.arrays import Float

RUN = 16
"""Neighbouring scan lines in a run."""
ACROSS, ALONG = 4, 8
"""Distances told apart, 0 among them: pixels on a scan line, scan lines."""
WIDEST = 48
"""px on either side of a line's centre that are looked at."""
STRAY = 5.0
"""Times the typical chi-square from which a scan line shows something else than a line."""
SLOPING = 3.0
"""Mean square of the residuals' slope over its variance from which the background has one; 1 where it has none."""
KNOTS = 0.5
"""Widths of the line from knot to knot of the shape that all residuals may have in common."""
RESOLVED, SHAPED = 1.1, 0.7
"""px; of a line that is narrower than the first pixels tell no more than that it leans or is flat, than the second no
more than that it leans."""
FEWEST, COMMON = 6, 60.0
"""Runs, and Hotelling's T^2 of two numbers, of 16 runs by chance once in 80,000, from which all scan lines lean to one
side, or are flat or have tails alike."""
SURE, SURE_OF_TWO = 3.0, 4.5
"""Standard errors from which a number is believed, and from which scintillation is of lines that are double."""
FAR_ABOVE = 3.0
"""Spans of the half of the runs that agree best, above which a run shows something else, such as an edge. By chance
one run of 16 is left out in one image of 28."""


@dataclass(frozen=True)
class Scatter:
    """Of a line's light, in the electrons that the noise model assumed."""

    gain: float
    """Variance over mean of the noise that is a count: 1 where the assumed gain is right."""
    scintillation: tuple[tuple[float, ...], ...]
    """As `NoiseModel` has it; () where none is sure."""


def scatter(lines: Lines, line: Line) -> Scatter | None:
    """What scatters the light of the lines (n, w), in runs of `RUN` neighbours, with their fit (n, 1).

    None: too few lines that are whole.
    """
    rows = _Rows(lines, line)
    if rows.runs < 2:
        return None
    moments, design = _usual(*rows.moments())
    if not lines.noise.scintillation:  # with weights as yet wrong, distances cannot be told from one another
        moments, design = moments[:, :2], design[:, :2, :2]
    every = _solve(moments.sum(axis=0), design.sum(axis=0))
    runs = len(moments)
    others = np.array([_solve(moments.sum(axis=0) - moments[i], design.sum(axis=0) - design[i]) for i in range(runs)])
    error = np.sqrt((runs - 1.0) * np.mean((others - others.mean(axis=0)) ** 2, axis=0))
    gain, light = every[0], every[1]
    if not light > (SURE_OF_TWO if rows.leans else SURE) * error[1]:
        alone = moments[:, 0].sum() / design[:, 0, 0].sum()
        return Scatter(max(float(alone), 0.0), ())
    known = np.where(np.abs(every) > SURE * error, every, 0.0)
    across = np.append(1.0, _run(known[2 : 1 + ACROSS] / light))
    along = np.append(1.0, _run(known[1 + ACROSS :] / light))
    table = light * np.outer(along, across)
    return Scatter(max(float(gain), 0.0), tuple(tuple(row) for row in table.tolist()))


def _splines(t: Float) -> Float:
    """(...) -> (..., m) cubic B-splines at knots one apart, as far as 4 widths of a line."""
    last = int(np.ceil(4.0 / KNOTS)) + 1
    apart = np.abs(t[..., None] - np.arange(-last, last + 1))
    inner, outer = 2.0 / 3.0 - apart**2 + 0.5 * apart**3, np.maximum(2.0 - apart, 0.0) ** 3 / 6.0
    return np.where(apart < 1.0, inner, outer)


def _typical(values: Float) -> Float:
    """(runs, RUN) -> the same, of each run its median; NaN is left out."""
    return np.array(np.broadcast_to(np.nanmedian(values, axis=1, keepdims=True), values.shape), np.float64)


def _run(values: Float) -> Float:
    """Correlations at distances 1, 2 ... up to the first that is none."""
    none = np.flatnonzero(values <= 0.0)
    return np.asarray(np.minimum(values[: none[0] if len(none) else None], 1.0))


def _usual(moments: Float, design: Float) -> tuple[Float, Float]:
    """Those of the runs that leave no more over, for their light, than the others."""
    if len(moments) < FEWEST:
        return moments, design
    weight = np.where(design[:, 0, 0] > 0.0, design[:, 0, 0], 1.0)
    left = moments[:, 0] / weight
    ordered, half = np.sort(left), (len(left) + 1) // 2
    spans = ordered[half - 1 :] - ordered[: len(left) - half + 1]
    first = int(np.argmin(spans))
    by_chance = 2.0 * np.sqrt(2.0 / np.median(weight))  # of normal residuals, between one run and another
    usual = left <= ordered[first + half - 1] + FAR_ABOVE * max(spans[first], float(by_chance))
    return moments[usual], design[usual]


def _solve(moments: Float, design: Float) -> Float:
    """Least squares with unknowns in units of their own, as counts are 10,000 times what scintillates."""
    unit = np.sqrt(np.maximum(np.diagonal(design), 0.0))
    unit = np.where(unit > 0.0, unit, 1.0)
    return np.asarray(np.linalg.lstsq(design / np.outer(unit, unit), moments / unit, rcond=1e-9)[0] / unit, np.float64)


class _Rows:
    """Residuals of whole runs, on pixels that all rows of a run share: arrays (runs, RUN, n) and (runs, RUN, n, n)."""

    def __init__(self, lines: Lines, line: Line) -> None:
        signal, mask, floor = lines.read(0, lines.count)
        u, width, height = line.u[:, 0], line.width[:, 0], line.amplitude[:, 0]
        whole = np.isin(line.flag[:, 0], (Flag.OK, Flag.SPECKLED))
        if whole.any():
            whole &= line.chi2[:, 0] < STRAY * np.median(line.chi2[whole, 0])
        runs = lines.count // RUN
        self.half = min(int(np.ceil(4.0 * np.nanmedian(width) + 1.5)), WIDEST) if whole.any() else 1
        parts = [self._run(slice(i * RUN, (i + 1) * RUN), whole, u) for i in range(runs)]
        kept = [(i, start, size) for i, (start, size) in enumerate(parts) if size > 0]
        size = max((size for _, _, size in kept), default=1)
        kept = [(i, start, size) for i, start, _ in kept if start >= 0 and start + size <= signal.shape[1]]
        self.runs = len(kept)
        if self.runs < 2:
            return
        index = np.array([i for i, _, _ in kept])[:, None] * RUN + np.arange(RUN)
        x = np.array([start for _, start, _ in kept])[:, None] + np.arange(size)
        # scintillation pulls width and height of a fit along: those of the run do not lean towards the residuals
        width, height = (
            _typical(np.where(whole, width, np.nan)[index]),
            _typical(np.where(whole, height, np.nan)[index]),
        )
        fitted = line.amplitude[:, 0][index][:, :, None] * self._profiles(x, u[index], line.width[:, 0][index])[..., 0]
        shape = self._profiles(x, u[index], width)
        pick = index[:, :, None], x[:, None, :]
        near = np.abs(x[:, None, :] - u[index][:, :, None]) <= self.half
        usable = whole[index][:, :, None] & near & (mask[pick] == 0)
        base = np.broadcast_to(floor, signal.shape)[pick].astype(np.float64)
        amplitude, background = height[:, :, None], line.background[:, 0][index][:, :, None]
        self.light = np.where(usable, amplitude * shape[..., 0], 0.0)
        self.still = np.where(usable, np.maximum(background + base, 0.1 * np.abs(base)), 0.0)
        self.variance = np.where(usable, self.light + self.still, 1.0)
        contrast = lines.noise.contrast
        self.expected = np.where(usable, self.variance + (contrast * self.light) ** 2, 1.0)
        residual = np.where(usable, signal[pick] - fitted - background, 0.0)
        jacobian = np.stack(
            [shape[..., 0], amplitude * shape[..., 1], amplitude * shape[..., 2], np.ones_like(shape[..., 0])], axis=-1
        )
        jacobian = np.where(usable[..., None], jacobian, 0.0)
        along = np.where(usable, x[:, None, :] - np.nan_to_num(u[index])[:, :, None], 0.0)
        certain = np.sum(along**2 / self.variance, axis=2)
        lean = np.sum(along * residual / self.variance, axis=2) ** 2 / np.maximum(certain, 1e-300)
        sloping = float(np.mean(lean[certain > 0.0])) > SLOPING
        typical = float(np.nanmedian(width))
        narrow = typical < RESOLVED
        if sloping and not narrow:  # of the background, which the fit had taken off
            jacobian = np.concatenate([jacobian, along[..., None]], axis=-1)
        weighted = jacobian / self.variance[..., None]
        # a row without a line has no information, and is zero throughout
        normal = np.linalg.pinv(np.swapaxes(jacobian, -1, -2) @ weighted, rcond=1e-12, hermitian=True)
        self.left = np.eye(size) * usable[..., None] - jacobian @ normal @ np.swapaxes(weighted, -1, -2)
        self.residual = np.einsum("rpij,rpj->rpi", self.left, residual) if sloping else residual
        if sloping and narrow:  # of three pixels a slope of their own would leave nothing over: it is that of the run
            rising = np.einsum("rpij,rpj->rpi", self.left, along)
            weighed = rising / self.variance
            rise = np.sum(weighed * self.residual, axis=(1, 2)) / np.sum(weighed * rising, axis=(1, 2))
            self.residual = self.residual - rise[:, None, None] * rising
        z = along / np.where(usable, width[:, :, None], 1.0)
        self._take_out_shape(z, np.where(usable, amplitude, 0.0), typical)

    def _take_out_shape(self, z: Float, amplitude: Float, width: float) -> None:
        """What all residuals, z sigmas from lines of an amplitude (runs, RUN, n), hold alike is the line's shape."""
        lean = np.stack([(z**2 - 3.0) * z, (z**4 - 10.0 * z**2 + 15.0) * z], axis=-1) * self.light[..., None]
        even = np.stack([z**4 - 6.0 * z**2 + 3.0, z**6 - 15.0 * z**4 + 45.0 * z**2 - 15.0], axis=-1)
        lean, even = self.left @ lean, self.left @ (even * self.light[..., None])
        self.leans = self._is_common(lean)
        flat = width >= SHAPED and self._is_common(even)
        if not (self.leans or flat):
            return
        if width < RESOLVED:
            shapes = [shape for shape, common in ((lean, self.leans), (even, flat)) if common]
        else:
            shapes = [self.left @ (amplitude[..., None] * _splines(z / KNOTS))]
        self.residual = self.residual - self._common(np.concatenate(shapes, axis=-1))

    def _is_common(self, lean: Float) -> bool:
        """Whether all residuals hold alike what shapes (runs, RUN, n, m) are: Hotelling's T^2 over the runs.

        A second line beside the first, or a lens out of focus, is there on every scan line, noise is not.
        """
        score, normal = self._projected(lean)
        total = score.sum(axis=0)
        apart = score - normal @ _solve(total, normal.sum(axis=0))
        return self.runs >= FEWEST and bool(total @ _solve(total, apart.T @ apart) > COMMON)

    def _common(self, shapes: Float) -> Float:
        """What of shapes (runs, RUN, n, m) the residuals hold together."""
        score, normal = self._projected(shapes)
        return np.asarray(shapes @ _solve(score.sum(axis=0), normal.sum(axis=0)))

    def _projected(self, shapes: Float) -> tuple[Float, Float]:
        """By run, products of shapes (runs, RUN, n, m) with the residuals (runs, m), and with themselves."""
        weighed = shapes / self.expected[..., None]
        flat, other = (one.reshape(self.runs, -1, shapes.shape[-1]).swapaxes(1, 2) for one in (weighed, shapes))
        return (flat @ self.residual.reshape(self.runs, -1, 1))[..., 0], flat @ other.swapaxes(1, 2)

    def _run(self, rows: slice, whole: NDArray[np.bool_], u: Float) -> tuple[int, int]:
        """First pixel and size of the window of a run, (0, 0) without two whole rows or where they are far apart."""
        centres = u[rows][whole[rows]]
        if len(centres) < 2 or np.ptp(centres) > 4 * RUN:
            return 0, 0
        start = int(np.floor(centres.min())) - self.half
        return start, int(np.ceil(centres.max())) + self.half - start + 1

    @staticmethod
    def _profiles(x: NDArray[np.intp], u: Float, width: Float) -> Float:
        """(runs, n), (runs, RUN), (runs, RUN) -> (runs, RUN, n, 3): the unit profile and its two derivatives."""
        out = np.zeros((*u.shape, x.shape[1], 3))
        shape = np.empty((3, x.shape[1]))
        for i, j in np.argwhere(np.isfinite(u)):
            profile(x[i].astype(np.float64), x.shape[1], u[i, j], width[i, j], True, shape)
            out[i, j] = shape.T
        return out

    def moments(self) -> tuple[Float, Float]:
        """(runs, m) moments less what is known, (runs, m, m) by unknown: K, c across, c along without distance 0."""
        lags = [(0, d) for d in range(ACROSS)] + [(k, 0) for k in range(1, ALONG)]
        seen = self.light / self.expected
        z = self.residual * seen
        carried, weighed = self.left * self.light[..., None, :], seen[..., None] * self.left
        flat, width = _flat(weighed), z.shape[2] + ACROSS
        by_light, by_still = (_flat(weighed * one[..., None, :]) for one in (self.light, self.still))
        squares, weights = self.left**2, self.light / self.expected**2
        moments = np.empty((self.runs, 1 + len(lags)))
        design = np.zeros((self.runs, 1 + len(lags), 1 + len(lags)))
        known = np.einsum("rpij,rpj->rpi", squares, self.still)
        moments[:, 0] = np.sum(weights * (self.residual**2 - known), axis=(1, 2))
        design[:, 0, 0] = np.einsum("rpi,rpi->r", weights, np.einsum("rpij,rpj->rpi", squares, self.light))
        for b, (_, d) in enumerate(lags[:ACROSS]):
            pair = self._pairs(carried, d)
            design[:, 0, 1 + b] = np.einsum("rpi,rpi->r", weights, pair)
        for a, (k, d) in enumerate(lags):
            n = z.shape[2] - d
            upper, lower = slice(0, RUN - k), slice(k, RUN)
            moments[:, 1 + a] = np.sum(z[:, upper, :n] * z[:, lower, d:], axis=(1, 2))
            shift = d * width
            if k == 0:
                moments[:, 1 + a] -= _shifted(flat, by_still, shift)
                design[:, 1 + a, 0] = _shifted(flat, by_light, shift)
                for b, (_, apart) in enumerate(lags[:ACROSS]):
                    both = (shift + apart, abs(shift - apart)) if apart > 0 else (shift,)
                    design[:, 1 + a, 1 + b] = sum(_shifted(by_light, by_light, one) for one in both)
            else:
                design[:, 1 + a, 1 + a] = _shifted(by_light[:, :-k], by_light[:, k:], shift)
        return moments, design

    @staticmethod
    def _pairs(left: Float, apart: int) -> Float:
        """Sum over pixels j, j' that far apart of left[i, j] left[i, j']."""
        n = left.shape[-1] - apart
        pairs = np.einsum("...j,...j->...", left[..., :n], left[..., apart:])
        return np.asarray((1.0 if apart == 0 else 2.0) * pairs)


def _flat(values: Float) -> Float:
    """(runs, RUN, n, n) -> (runs, RUN, m) with zeros, so that one shift of all pairs the same pixels everywhere."""
    return np.pad(values, ((0, 0), (0, 0), (0, ACROSS), (0, ACROSS))).reshape(*values.shape[:2], -1)


def _shifted(first: Float, second: Float, shift: int) -> Float:
    """(runs, n, m) and (runs, n, m) -> (runs,) sums of products of values that are so far apart."""
    return np.asarray(np.vecdot(first[..., : first.shape[-1] - shift], second[..., shift:]).sum(axis=1))
