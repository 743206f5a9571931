"""Noise of a line's pixels by their light -> gain, read noise and the light's own scatter.

variance = gain (mean - black level) + R + (c light)^2 + 1/12, DN^2           after EMVA 1288
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import nnls

from render.base.arrays import Float
from render.base.errors import InputError
from studio.photographs.line_profile import Transfer, near, transfer_of
from studio.photographs.twin_profile import blurred_line
from studio.photographs.twin_seen import Seen

SURE = 3.0
"""Sigmas from which the light scatters by itself."""
COUNTED = 2.0
"""Sigmas from which the gain is better known by it than by the project."""
LEAST = 0.2
"""Of the variance that is expected, the least that a rehearsal may leave of what was seen."""


@dataclass(frozen=True)
class Noise:
    """(3,) gain DN/e-, R DN^2 and c^2; their sigmas; whether the light's scatter was told; (3,) sigmas by what a
    rehearsal leaves out."""

    values: Float
    sigmas: Float
    scattered: bool
    left_out: Float


def transfer(seen: Seen, shape: Float, edges: Float | None = None) -> Transfer | None:
    """Noise against light of all pieces by (4,) values of a `Shape`. None: too few pixels."""
    whole = seen.whole
    whole = replace(whole, stretch=near(whole.stretch, seen.width))
    blur = shape[1]
    variance = shape[0] * whole.sheet**2 + whole.known + (whole.tilt - 1.0) * blur
    sigma, distance = np.sqrt(variance)[:, None], whole.stretch.distance
    line = blurred_line(distance, sigma, blur)
    slope = 5.0 * (blurred_line(distance + 0.1, sigma, blur) - blurred_line(distance - 0.1, sigma, blur))
    return transfer_of(whole.stretch, line, slope, seen.width, 0.0, edges)


def basis(found: Transfer, black: float) -> Float:
    """(k, 3) variance by gain, R and c^2."""
    level = np.maximum(found.mean - black, 0.0)
    return np.stack([level, np.ones_like(level), found.light**2], axis=1)


def expected(values: Float, found: Transfer, black: float) -> Float:
    """(k,) variance, DN^2."""
    return np.asarray(basis(found, black) @ values + 1.0 / 12.0)


def counted(noise: Noise) -> bool:
    """The noise of counting electrons was told."""
    return bool(noise.values[0] > COUNTED * noise.sigmas[0])


def fit_noise(
    found: Transfer, black: float, scatter: float, own: bool, left_out: Float, like: Noise | None = None
) -> Noise:
    """Noise against light -> its three numbers. scatter: c of the project. own: c is the project's in any case.

    left_out: (k,) DN^2, standard deviation of each variance by what a rehearsal leaves out.
    like: a fit that tells what is told. InputError: the noise does not grow with the light.
    """
    good = np.isfinite(found.variance) & (found.sigma > 0.0)
    # where a million pixels tell the noise of the ground, the rehearsal does not
    sigma = np.hypot(found.sigma, left_out)[good]
    columns = basis(found, black)[good] / sigma[:, None]
    value = (found.variance[good] - 1.0 / 12.0) / sigma

    def solved(free: list[int], value: Float) -> tuple[Float, Float]:
        size = np.linalg.norm(columns[:, free], axis=0)
        best, left = nnls(columns[:, free] / size, value)
        excess = max(left**2 / max(len(value) - len(free), 1), 1.0)
        p, spread = np.zeros(3), np.zeros(3)
        p[free], spread[free] = best / size, np.sqrt(excess) * propagated(free, found.sigma)
        return p, spread

    def propagated(free: list[int], each: Float) -> Float:
        return np.asarray(np.sqrt(np.sum((np.linalg.pinv(columns[:, free]) * (each[good] / sigma)) ** 2, axis=1)))

    free = [0, 1, 2]
    p, spread = solved(free, value) if not own else (np.zeros(3), np.zeros(3))
    scattered = not own and (p[2] >= SURE * spread[2] if like is None else like.scattered)
    if not scattered:
        free = [0, 1]
        p, spread = solved(free, value - scatter**2 * columns[:, 2])
        p[2] = scatter**2
    if like is None and p[0] <= SURE * spread[0] and not own:
        raise InputError(
            "the noise does not grow with the light: these are not a sensor's own numbers",
            found=f"gain {p[0]:.3g} +- {spread[0]:.3g} DN/e-",
            cure="give raw images without compression, denoising or a tone curve",
        )
    unsure = np.zeros(3)
    unsure[free] = propagated(free, left_out)
    return Noise(p, spread, scattered, unsure)


def less(found: Transfer, rehearsed: Float, passed: Float, usual: Float) -> Transfer:
    """The noise as the closed form has it, by what a rehearsal of (k,) DN^2 lacks of it.

    passed: (k,) share of the sensor's noise that comes through; usual: (k,) of the rehearsal, at its own light, by the
    closed form.
    """
    variance = usual + (found.variance - rehearsed) / passed
    # a step that takes all of the noise would leave nothing to rehearse
    return Transfer(
        found.mean, found.light, np.maximum(variance, LEAST * usual), found.sigma / passed, found.edges, found.alike,
        found.alike_sigma,
    )  # fmt: skip
