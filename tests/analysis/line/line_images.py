"""Synthetic scan lines with a known answer, and the Cramer-Rao bound, written apart from the code under test."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from analysis.line.detection.noise import NoiseModel

Array = NDArray[np.float64]


def expected(width: int, centre: Array, amplitude: float, sigma: float, background: float) -> Array:
    """(n, width) electrons of a Gaussian line of peak `amplitude`, integrated over the pixels."""
    x = np.arange(width)[None, :] - np.asarray(centre)[:, None]
    scale = sigma * np.sqrt(2.0)
    area = amplitude * sigma * np.sqrt(np.pi / 2.0)
    return np.asarray(area * (erf((x + 0.5) / scale) - erf((x - 0.5) / scale)) + background)


def exposed(mean: Array, read_noise: float, rng: np.random.Generator) -> Array:
    """Electrons with shot and read noise."""
    return np.asarray(rng.poisson(mean) + rng.normal(0.0, read_noise, mean.shape))


def electrons(read_noise: float, **other: float) -> NoiseModel:
    """The noise model of a float image in electrons."""
    return NoiseModel(gain=1.0, read_noise=read_noise, step=0.0, **other)


def cramer_rao(amplitude: float, sigma: float, read_noise: float, background: float, step: float = 0.0) -> float:
    """Joint bound on the centre in px, rms over sub-pixel phase (accuracy note, 2.1); derivatives by differences."""
    half = int(np.ceil(8.0 * sigma)) + 6
    squares = []
    for phase in np.linspace(-0.5, 0.5, 21)[:-1]:
        p = np.array([half + phase, amplitude, sigma, background])

        def model(q: Array, width: int = 2 * half + 1) -> Array:
            return expected(width, q[:1], q[1], q[2], q[3])[0]

        jacobian = np.empty((2 * half + 1, 4))
        for j in range(4):
            h = 1e-5 * max(abs(p[j]), 1.0)
            up, down = p.copy(), p.copy()
            up[j] += h
            down[j] -= h
            jacobian[:, j] = (model(up) - model(down)) / (2.0 * h)
        variance = model(p) + read_noise**2 + step**2 / 12.0
        fisher = jacobian.T @ (jacobian / variance[:, None])
        squares.append(np.linalg.inv(fisher)[0, 0])
    return float(np.sqrt(np.mean(squares)))
