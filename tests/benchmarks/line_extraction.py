"""Time of line extraction on one 2448 x 2048 frame, 8 and 16 bit, beside the NumPy and SciPy code a user would write.

Run: python -m tests.benchmarks.line_extraction
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from analysis.line.extract import extract
from analysis.line.noise import NoiseModel
from analysis.line.settings import Method
from tests.analysis.line_images import expected, exposed

ROWS, WIDTH, REPEATS = 2048, 2448, 15
METHODS: tuple[Method, ...] = ("centre_of_mass", "gaussian", "likelihood")


def frame(bits: int) -> tuple[np.ndarray, np.ndarray, NoiseModel]:
    rng = np.random.default_rng(0)
    centre = 1200 + 300 * np.sin(np.arange(ROWS) / 250)
    counts = exposed(expected(WIDTH, centre, 3000, 1.5, 20.0), 2.5, rng)
    noise = NoiseModel(gain=(2**bits - 1) / 10500, black_level=2.0, read_noise=2.5, saturation=2.0**bits - 1)
    numbers = np.clip(np.round(counts * noise.gain + noise.black_level), 0, 2**bits - 1)
    return numbers.astype(np.uint8 if bits == 8 else np.uint16), centre, noise


def milliseconds(work: Callable[[], object], repeats: int = REPEATS) -> tuple[float, float]:
    """Best and median."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(1e3 * (time.perf_counter() - start))
    return min(times), float(np.median(times))


def numpy_centre_of_mass(image: np.ndarray) -> np.ndarray:
    """Row maximum, then a +-5 px centre of mass over the row's median."""
    top = image.argmax(axis=1).clip(5, image.shape[1] - 6)
    index = top[:, None] + np.arange(-5, 6)
    window = np.take_along_axis(image, index, axis=1) - np.median(image, axis=1)[:, None]
    return np.asarray((window * index).sum(axis=1) / window.sum(axis=1))


def scipy_gaussian(image: np.ndarray, rows: int) -> np.ndarray:
    """Row maximum, then scipy.optimize.curve_fit of a Gaussian, on the first rows."""
    from scipy.optimize import curve_fit

    def gauss(x: np.ndarray, a: float, c: float, s: float, b: float) -> np.ndarray:
        return np.asarray(a * np.exp(-0.5 * ((x - c) / s) ** 2) + b)

    out = np.empty(rows)
    for y in range(rows):
        top = int(image[y].argmax())
        x = np.arange(max(top - 8, 0), min(top + 9, WIDTH))
        out[y] = curve_fit(gauss, x, image[y, x].astype(float), p0=(image[y, top], top, 1.5, 5.0))[0][1]
    return out


def report(bits: int) -> None:
    image, centre, noise = frame(bits)
    print(f"{bits} bit, {WIDTH} x {ROWS}, one peak a row: best / median of {REPEATS}")
    best = {}
    for threads in (1, 2):
        for method in METHODS:
            work = partial(extract, image, method=method, noise=noise, threads=threads)
            best[method], median = milliseconds(work)
            rms = float(np.sqrt(np.nanmean((work().u[:, 0] - centre) ** 2)))
            print(f"  {method:15} {threads} threads {best[method]:7.1f} / {median:7.1f} ms   rms error {rms:.4f} px")
    plain, _ = milliseconds(partial(numpy_centre_of_mass, image), 3)
    print(f"  NumPy centre of mass  {plain:7.1f} ms, {plain / best['centre_of_mass']:.1f} times ours")
    rows = 100
    plain = milliseconds(partial(scipy_gaussian, image, rows), 2)[0] * ROWS / rows
    print(f"  SciPy curve_fit       {plain:7.1f} ms, {plain / best['gaussian']:.0f} times ours")


if __name__ == "__main__":
    for depth in (8, 16):
        report(depth)
