"""A line measured along time: where, in one frame of a moving scan, the sheet's middle stands on the surface.

Curless and Levoy, ICCV 1995, on the paths that a known motion gives. A point of the surface under the sheet at pixel p
of frame k is seen at known pixels of the frames around it; along them its brightness is the sheet's profile over time
times one albedo. The position sought is the p whose passage is at k itself, found by secant steps: an ordinary line of
frame k, that edges, textures and occlusion do not pull.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import MISSING, SATURATED, Lines
from analysis.line.detection.detect import (
    AMPLITUDE,
    BACKGROUND,
    CENTRE,
    PLATEAU,
    PRIOR,
    SEED_COLUMNS,
    SLOPE,
    SLOPE_SIGMA,
    WIDTH,
)
from analysis.line.detection.noise import NoiseModel
from analysis.line.methods.fisher_scoring import LIKELIHOOD
from analysis.line.methods.gaussian_fit import measure_gaussian
from analysis.line.methods.seed_loop import COLUMNS, ROOM, Options, Pixels, seed_kernel
from analysis.line.result import Flag, Line, positioned
from render.base.arrays import Float
from render.base.errors import InputError
from render.base.threads import map_chunks
from render.camera.camera import Camera

FEWEST = 6
"""Frames on either side of one, or as many as there are."""
MOST = 24
FASTEST = 0.6
"""Frames; a sheet that passes with a smaller sigma falls between them."""
STEPS = 8
SETTLED = 0.005
"""px; of the last step, or a tenth of sigma_u."""


@dataclass(frozen=True)
class Sweep:
    """Frames of a moving scan around the one that is measured, frame `at`."""

    frames: Sequence[NDArray[Any]]
    """(t) of (h, w) mono DN."""
    at: int
    moves: Float
    """(t, 4, 4): takes a point of the surface from the camera's frame at `at` to that at t."""
    plane: Float
    """(4,) of the laser in the camera's frame."""
    camera: Camera
    noise: NoiseModel
    variances: Sequence[NDArray[Any]] | None = None
    """(t) of (h, w) e-^2, for fused images."""


class _Paths:
    """Where the surface points at positions (m,) of a line are seen in the frames first..last - 1."""

    def __init__(self, sweep: Sweep, line: Line) -> None:
        self.sweep, self.along_rows = sweep, line.axis == "rows"
        self.index, self.rank = np.nonzero(line.valid)
        self.scan = self.index.astype(np.float64)

    def pixels(self, u: Float, first: int, last: int) -> Float:
        """(m,) px -> (m, t, 2) px."""
        plane, camera = self.sweep.plane, self.sweep.camera
        scale = np.linalg.norm(plane[:3])
        pixel = np.column_stack((u, self.scan) if self.along_rows else (self.scan, u))
        rays = np.column_stack([camera.normalise(pixel)[0], np.ones(len(pixel))])
        with np.errstate(divide="ignore", invalid="ignore"):
            points = rays * (-float(plane[3] / scale) / (rays @ (plane[:3] / scale)))[:, None]
        part = self.sweep.moves[first:last]
        moved = np.einsum("tij,mj->mti", part[:, :3, :3], points) + part[:, :3, 3]
        return camera.project(np.nan_to_num(moved, nan=-1.0))[0]

    def speed(self, u: Float) -> Float:
        """(m,) px per frame that the surface moves along the scan line."""
        before, after = max(0, self.sweep.at - 1), min(len(self.sweep.frames) - 1, self.sweep.at + 1)
        seen = self.pixels(u, before, after + 1)[:, :, 0 if self.along_rows else 1]
        return np.asarray((seen[:, -1] - seen[:, 0]) / max(after - before, 1))


def along_time(line: Line, sweep: Sweep, threads: int | None = None) -> Line:
    """The line of frame `sweep.at` -> the same peaks measured along time, where they settle; others carry a reason.

    InputError: colour, a motion that leaves the surface under the sheet, or one too fast for its width.
    """
    frames, at = sweep.frames, sweep.at
    if any(frame.ndim != 2 for frame in frames):
        raise InputError("along time only mono images can be followed", where="extraction.spacetime", found="colour")
    paths = _Paths(sweep, line)
    u, width = line.u[paths.index, paths.rank], line.width[paths.index, paths.rank]
    if len(u) == 0:
        return line
    speed = paths.speed(u)
    spread = _spread(width, speed)
    half = int(min(max(np.ceil(5.0 * spread) + 2, FEWEST), MOST))
    first, last = max(0, at - half), min(len(frames), at + half + 1)

    def passage(along: Float) -> Line:
        series, variance, share = _sample(sweep, first, paths.pixels(along, first, last))
        return _fit(Lines(series, "mono", None, sweep.noise, variance=variance), share, at - first, spread, threads)

    slope = -speed  # px that the position moves for each frame that the passage comes late
    last_u, last_late = u, np.full(len(u), np.nan)
    move, result = np.full(len(u), np.nan), passage(u)
    for _ in range(STEPS):
        late = result.u[:, 0] - (at - first)
        with np.errstate(divide="ignore", invalid="ignore"):
            secant = (u - last_u) / (late - last_late)
        # a surface seen at a slant turns the slope by some, never round
        sane = np.isfinite(secant) & (secant / -speed > 0.2) & (secant / -speed < 5.0)
        slope = np.where(sane & (np.abs(late - last_late) > 1e-3), secant, slope)
        limit = 2.0 * width + 1.0
        move = np.clip(-slope * late, -limit, limit)
        open_ = np.abs(move) > np.maximum(SETTLED, 0.1 * np.abs(slope) * result.sigma_u[:, 0])
        if not open_.any():
            break
        last_u, last_late = np.where(open_, u, last_u), np.where(open_, late, last_late)
        u = np.where(open_, u + move, u)
        result = passage(u)
    return _settled(line, paths.index, paths.rank, u + np.nan_to_num(move), move, slope, result)


def _spread(width: Float, speed: Float) -> float:
    """Sigma of the passage in frames, typically. InputError: too little or too fast a motion."""
    fast = float(np.nanmedian(np.abs(speed)))
    if not fast > 1e-3:
        raise InputError(
            "the motion leaves the surface under the sheet, so that nothing passes along time",
            where="extraction.spacetime",
            cure="move the rig or the objects across the sheet, or switch it off",
        )
    spread = float(np.nanmedian(width)) / fast
    if spread < FASTEST:
        raise InputError(
            "the sheet passes too fast to be measured along time",
            where="extraction.spacetime",
            found=f"in {spread:.2f} frames (sigma)",
            allowed=f"at least {FASTEST} frames",
            cure=f"make the motion's steps {FASTEST / spread:.1f} times finer, or switch it off",
        )
    return spread


def _sample(sweep: Sweep, first: int, pixels: Float) -> tuple[NDArray[np.float32], NDArray[np.float32], Float]:
    """(m, t, 2) pixels -> (m, t) DN and variance of a pixel there in e-^2, bilinear, NaN off the image.

    Third (m,): how much of that variance is left in a mean of four pixels, typically.
    """
    frames, variances, noise = sweep.frames, sweep.variances, sweep.noise
    m, count = pixels.shape[:2]
    series, spread = np.full((m, count), np.nan, np.float32), np.ones((m, count), np.float32)
    share, seen = np.zeros(m), np.zeros(m)
    for t in range(count):
        frame = frames[first + t]
        height, width = frame.shape
        u, v = pixels[:, t, 0], pixels[:, t, 1]
        inside = (u >= 0) & (u <= width - 1) & (v >= 0) & (v <= height - 1)  # not NaN either
        u, v = u[inside], v[inside]
        x, y = np.minimum(u.astype(np.intp), width - 2), np.minimum(v.astype(np.intp), max(height - 2, 0))
        below = np.minimum(y + 1, height - 1)
        fx, fy = u - x, v - y
        value, variance, full = np.zeros(len(u)), np.zeros(len(u)), np.zeros(len(u), np.bool_)
        for row, column, weight in (
            (y, x, (1 - fx) * (1 - fy)),
            (y, x + 1, fx * (1 - fy)),
            (below, x, (1 - fx) * fy),
            (below, x + 1, fx * fy),
        ):
            numbers = frame[row, column].astype(np.float64)
            value += weight * numbers
            counts = np.maximum((numbers - noise.black_level) / noise.gain, 0.0) + noise.floor
            variance += weight * (counts if variances is None else variances[first + t][row, column])
            share[inside] += weight**2
            if noise.saturation is not None:
                full |= (numbers >= noise.saturation) & (weight > 0.0)
        if noise.saturation is not None:  # a mean of saturated and other pixels is not a measurement
            value = np.where(full, noise.saturation, np.minimum(value, np.nextafter(noise.saturation, 0.0)))
        series[inside, t], spread[inside, t] = value, variance
        seen += inside
    return series, spread, share / np.maximum(seen, 1.0)


def _fit(lines: Lines, share: Float, at: int, spread: float, threads: int | None) -> Line:
    """The Gaussian over time of every series (m, t), which is known to be about frame `at`, `spread` frames wide.

    share (m,): of a pixel's variance. A mean of pixels counts as so many more electrons, so that it is Poisson again.
    """
    out = np.empty((lines.count, 1, COLUMNS))
    flags = np.empty((lines.count, 1), np.uint8)
    longest = lines.image.shape[1] / 4.0
    options = Options(LIKELIHOOD, integrated=False, known_width=False, max_width=longest, filter_scale=1.0)

    def work(start: int, stop: int) -> None:
        signal, mask, floor = lines.read(start, stop)
        more = (1.0 / np.maximum(share[start:stop, None], 0.05)).astype(np.float32)
        signal, floor = signal * more, floor * more
        seen = np.where(mask & MISSING, np.nan, signal)
        count = signal.shape[1]
        reach = int(np.ceil(2.0 * spread)) + 2
        low, high = max(0, at - reach), min(count, at + reach + 1)
        near = np.nan_to_num(seen[:, low:high], nan=-np.inf)
        top = near.argmax(axis=1) + low
        seeds = np.full((stop - start, 1, SEED_COLUMNS), np.inf)  # nothing limits the window but the series itself
        ordered = np.sort(np.nan_to_num(seen, nan=np.inf), axis=1)
        base = ordered[np.arange(len(top)), (np.isfinite(seen).sum(axis=1) // 5).clip(0, count - 1)]
        seeds[:, 0, CENTRE], seeds[:, 0, WIDTH], seeds[:, 0, BACKGROUND] = top, spread, base
        seeds[:, 0, AMPLITUDE] = np.maximum(signal[np.arange(len(top)), top] - base, 1.0)
        seeds[:, 0, PLATEAU] = seeds[:, 0, SLOPE] = seeds[:, 0, SLOPE_SIGMA] = 0.0
        seeds[:, 0, PRIOR:] = 0.0
        full = (mask & SATURATED).any(axis=1)
        edge = (top <= 0) | (top >= count - 1) | ~np.isfinite(near.max(axis=1))
        flags[start:stop, 0] = np.where(edge, Flag.AT_BORDER, np.where(full, Flag.SATURATED, Flag.OK))
        pixels = Pixels(signal, mask, floor, np.ones(1), 0, np.empty((ROOM, count)))
        seed_kernel(measure_gaussian)(pixels, seeds, flags[start:stop], options, out[start:stop])

    map_chunks(work, lines.count, 256, threads)
    u, sigma_u, width, amplitude, background, chi2 = (np.ascontiguousarray(out[..., j]) for j in range(6))
    return Line("rows", "likelihood", u, sigma_u, width, amplitude, background, chi2, flags)


def _settled(
    line: Line, index: NDArray[np.intp], rank: NDArray[np.intp], u: Float, move: Float, slope: Float, result: Line
) -> Line:
    """The line with the peaks that came to rest in their places, and the others' reasons."""
    flag = result.flag[:, 0].copy()
    sigma = np.abs(slope) * result.sigma_u[:, 0]
    with np.errstate(invalid="ignore"):
        restless = ~(np.abs(move) <= np.maximum(2.0 * SETTLED, 0.3 * sigma))
        gone = np.abs(u - line.u[index, rank]) > 4.0 * line.width[index, rank] + 2.0
    flag[positioned(flag) & restless] = Flag.NOT_CONVERGED
    flag[positioned(flag) & gone] = Flag.OUT_OF_WINDOW
    good = positioned(flag)
    flags = line.flag.copy()
    flags[index, rank] = flag

    def put(before: Float, values: Float) -> Float:
        after = before.copy()
        after[index, rank] = np.where(good, values, np.nan)
        return after

    return replace(
        line,
        u=put(line.u, u),
        sigma_u=put(line.sigma_u, sigma),
        width=put(line.width, np.abs(slope) * result.width[:, 0]),
        chi2=put(line.chi2, result.chi2[:, 0]),
        flag=flags,
    )
