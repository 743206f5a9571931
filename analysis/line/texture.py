"""What the texture of a surface does to the line, told by how the line's light varies along it.

A surface that reflects unevenly, with variance c and alike over the distance g in all directions, brightens one side of
the line: its centre of light moves, and the pixels of one scan line take that for its place. The light of all of it
varies along the line by the same texture. For a Gaussian line of width s on a texture of covariance
c exp(-r^2 / 4 g^2), with t the light's relative deviation at x from the line,

    Var(int p t dx) = V = c / (1 + s^2 / g^2)^(1/2)           between scan lines k apart V exp(-k^2 / 4 g^2)
    Var(int p x t dx)   = V s^4 / (2 (g^2 + s^2))             so much the position errs, alike over 2 pi^(1/2) g

V and g are found in the structure function of the light's logarithm, where what counts scatter is the same at all
distances. A shape that shades the line finer than the runs counts as texture; a rough surface that moves the line and
leaves its light as it is does not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from analysis.line.detection.noise import NoiseModel
from analysis.line.result import Flag, Line
from render.base.arrays import Float

RUN, DEGREE = 64, 3
"""Scan lines in a run, out of which a cubic takes what is no texture: shading, and ends of the lamp's cone."""
FILLED, FEWEST = 0.6, 8
"""Share of a run with a line, and runs, below which nothing is said."""
FARTHEST = 12
"""Scan lines apart that are compared."""
GRAINS = 0.5 * 2.0 ** (0.5 * np.arange(9))
"""px, that are tried: finer ones are noise to the scan lines, coarser ones a slope to a run."""
STRAY = 4.0
"""Robust standard deviations of a run's light beyond which a scan line is at an edge."""
SURE, MATTERS = 3.0, 0.04
"""Standard errors from which a texture is believed, and the share of sigma's square from which it counts."""


@dataclass(frozen=True)
class Texture:
    """Of the light of the line."""

    variance: float
    """V, relative, beyond what the noise model tells."""
    grain: float
    """px."""

    def moves(self, width: Float) -> Float:
        """Widths of lines, px -> variance of their position, px^2."""
        return np.asarray(self.variance * width**4 / (2.0 * (self.grain**2 + width**2)))

    @property
    def length(self) -> float:
        """Scan lines that err alike."""
        return max(2.0 * math.sqrt(math.pi) * self.grain, 1.0)


def with_texture(line: Line, noise: NoiseModel) -> Line:
    """A line (n, k) -> the same with what texture moves it by in sigma and correlation length, as its first peaks tell;
    as it is where there is none."""
    found = texture(line, noise)
    if found is None:
        return line
    candidates = None if line.candidates is None else _added(line.candidates, found)
    return replace(_added(line, found), candidates=candidates)


def texture(line: Line, noise: NoiseModel) -> Texture | None:
    """What the light of a line (n, k) says of its surface; None: nothing that is sure and counts."""
    alone = (line.flag[:, 0] == Flag.OK) & (line.amplitude[:, 0] > 0.0) & (line.width[:, 0] > 0.0)
    light = np.log(np.where(alone, line.amplitude[:, 0] * line.width[:, 0], np.nan))
    runs = _structure(light[: len(light) // RUN * RUN].reshape(-1, RUN))
    if len(runs) < FEWEST:
        return None
    total = runs.sum(axis=0, keepdims=True)
    grain = min(range(len(GRAINS)), key=lambda one: float(_fit(total, one)[1][0]))
    variance, others = float(_fit(total, grain)[0][0]), _fit(total - runs, grain)[0]
    error = math.sqrt((len(runs) - 1.0) * float(np.mean((others - others.mean()) ** 2)))
    if not variance > SURE * error:
        return None
    width, sigma = (float(np.median(values[alone, 0])) for values in (line.width, line.sigma_u))
    found = Texture(variance, float(GRAINS[grain]))
    moved = float(found.moves(np.array(width)))
    found = replace(found, variance=variance * max(1.0 - _told(noise, width) / moved, 0.0))
    return found if float(found.moves(np.array(width))) > MATTERS * sigma**2 else None


def _structure(light: Float) -> Float:
    """Logarithms (runs, RUN), NaN where unknown -> (m, 2, FARTHEST) sums of half their squared differences, and how
    many, at distances from 1; of the runs that are filled."""
    there = np.isfinite(light)
    light = light[there.sum(axis=1) >= FILLED * RUN]
    for _ in range(2):  # the second time without strays
        rest = _less_shape(light)
        near = np.abs(rest) <= STRAY * 1.4826 * np.nanmedian(np.abs(rest), axis=1, keepdims=True)
        light = np.where(near, light, np.nan)[near.sum(axis=1) >= FILLED * RUN]
    rest = _less_shape(light)
    out = np.empty((len(rest), 2, FARTHEST))
    for k in range(1, FARTHEST + 1):
        square = (rest[:, k:] - rest[:, :-k]) ** 2
        out[:, 0, k - 1], out[:, 1, k - 1] = 0.5 * np.nansum(square, axis=1), np.isfinite(square).sum(axis=1)
    return out


def _less_shape(light: Float) -> Float:
    """(runs, RUN) -> what a cubic leaves of each run."""
    powers = np.vander(np.arange(RUN) / RUN - 0.5, DEGREE + 1)
    there = np.isfinite(light)
    normal = np.einsum("rk,ki,kj->rij", there, powers, powers)
    right = np.where(there, light, 0.0) @ powers
    return np.asarray(light - np.linalg.solve(normal, right[..., None])[..., 0] @ powers.T)


def _fit(sums: Float, grain: int) -> tuple[Float, Float]:
    """Sums (m, 2, FARTHEST) as `_structure` has them -> (m,) the light's variance at one of GRAINS, beside what
    scatters by itself, neither below 0; and what both leave over of the squares."""
    weight = sums[:, 1]
    found = sums[:, 0] / np.maximum(weight, 1.0)
    flat, shape = _foreseen()[0], _foreseen()[1 + grain]
    ff, fs, ss = ((weight * one).sum(axis=1) for one in (flat * flat, flat * shape, shape * shape))
    fd, sd = ((weight * one * found).sum(axis=1) for one in (flat, shape))
    variance = np.maximum((ff * sd - fs * fd) / (ff * ss - fs * fs), 0.0)
    still = (fd - fs * variance) / ff
    variance = np.where(still < 0.0, np.maximum(sd / ss, 0.0), variance)
    rest = found - np.maximum(still, 0.0)[:, None] * flat - variance[:, None] * shape
    return variance, (weight * rest**2).sum(axis=1)


@cache
def _foreseen() -> Float:
    """(1 + GRAINS, FARTHEST) mean half squared differences of what a cubic leaves of a run, of independent light of
    unit variance, and of that of each grain."""
    apart = np.abs(np.subtract.outer(np.arange(RUN), np.arange(RUN)))
    powers = np.vander(np.arange(RUN) / RUN - 0.5, DEGREE + 1)
    left = np.eye(RUN) - powers @ np.linalg.pinv(powers)
    covariances = [np.eye(RUN)] + [np.exp(-((apart / (2.0 * grain)) ** 2)) for grain in GRAINS]
    out = np.empty((len(covariances), FARTHEST))
    for one, covariance in zip(out, covariances, strict=True):
        rest = left @ covariance @ left
        variance = np.diagonal(rest)
        for k in range(1, FARTHEST + 1):
            one[k - 1] = float(np.mean(0.5 * (variance[k:] + variance[:-k]) - np.diagonal(rest, k)))
    return out


def _told(noise: NoiseModel, width: float) -> float:
    """px^2 that the noise model's scintillation moves the centre of light of a line of a width, px, by."""
    if not noise.scintillation:
        return 0.0
    x = np.arange(-math.ceil(4.0 * width), math.ceil(4.0 * width) + 1)
    light = np.exp(-0.5 * (x / width) ** 2)
    moment = x * light / light.sum()
    apart = np.abs(np.subtract.outer(x, x))
    covariance = np.append(noise.table[0], 0.0)[np.minimum(apart, noise.table.shape[1])]
    return float(moment @ covariance @ moment)


def _added(line: Line, found: Texture) -> Line:
    more = found.moves(line.width)
    length = np.ones_like(line.u) if line.length_apart is None else line.length_apart
    apart = line.variance_apart
    both = (apart * length + more * found.length) / np.maximum(apart + more, 1e-300)
    return replace(line, sigma_u=np.sqrt(line.sigma_u**2 + more), length_apart=both)
