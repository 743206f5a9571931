"""Time of every extraction method on one 2448 x 2048 frame of 8 bits, beside the NumPy, SciPy or OpenCV code for it.

Run: python tests/benchmarks/bench_line_extraction.py. That code takes the row's brightest pixel and its median for
background, and does not look whether there is a line at all; ours does, with sigma and reason.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, get_args

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import CANDIDATES, extract, select
from analysis.line.ridges.ridges import find_ridges
from analysis.line.settings import Method
from tests.analysis.line.line_images import expected, exposed

ROWS, WIDTH, REPEATS = 2048, 2448, 15
SIGMA, SOME = 1.5, 100
"""px; rows on which code that loops over rows is timed."""
BARS_MS = {"likelihood": 60.0, "gaussian": 60.0, "steger_2d": 250.0, "centre_of_mass_normal": 250.0, "auto": 60.0}
ROW_LOCAL_MS, CHOOSER_MS = 15.0, 30.0
Array = np.ndarray[Any, Any]


def frame(bits: int = 8) -> tuple[Array, Array, NoiseModel]:
    """Image, true centres and noise of a line that winds through the frame."""
    rng = np.random.default_rng(0)
    centre = 1200 + 300 * np.sin(np.arange(ROWS) / 250)
    counts = exposed(expected(WIDTH, centre, 3000, SIGMA, 20.0), 2.5, rng)
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


def window(image: Array, half: int) -> tuple[Array, Array]:
    """Brightest pixel of each row, and the pixels around it above the row's median."""
    top = image.argmax(axis=1).clip(half, image.shape[1] - half - 1)
    index = top[:, None] + np.arange(-half, half + 1)
    return top, np.take_along_axis(image, index, axis=1) - np.median(image, axis=1)[:, None]


def plain_maximum(image: Array) -> Array:
    top, around = window(image, 1)
    return np.asarray(np.where(around[:, 1] > 5, top, np.nan))


def plain_three(image: Array, kind: str) -> Array:
    top, y = window(image, 1)
    if kind == "gauss_3":
        y = np.log(np.maximum(y, 0.5))
    a, b, c = y.T
    if kind == "linear":
        return np.asarray(top + 0.5 * (c - a) / np.maximum(b - np.minimum(a, c), 0.5))
    return np.asarray(top + 0.5 * (a - c) / np.minimum(a - 2 * b + c, -0.01))


def plain_mass(image: Array, fraction: float = 0.0, subtract: bool = False) -> Array:
    top, y = window(image, 5)
    level = fraction * y.max(axis=1, keepdims=True)
    y = np.where(y > level, y - level * subtract, 0.0) if fraction else y
    return np.asarray(top + (y * np.arange(-5, 6)).sum(axis=1) / y.sum(axis=1))


def plain_half(image: Array) -> Array:
    top, y = window(image, 5)
    total = np.cumsum(y, axis=1)
    half = 0.5 * total[:, -1:]
    k = (total >= half).argmax(axis=1)[:, None]
    after = np.take_along_axis(total, k, axis=1)
    return np.asarray(top + (k - 5 + 0.5 - (after - half) / np.take_along_axis(y, k, axis=1))[:, 0])


def plain_phase(image: Array) -> Array:
    top, y = window(image, 6)
    return np.asarray(top + 13 / (2 * np.pi) * np.angle(y @ np.exp(2j * np.pi * np.arange(-6, 7) / 13)))


def plain_logarithms(image: Array, rounds: int) -> Array:
    """np.polyfit row by row, as in every tutorial; weights put back `rounds` times."""
    out = np.empty(SOME)
    top, windows = window(image[:SOME], 5)
    x = np.arange(-5, 6)
    for row, y in enumerate(windows):
        keep = y > (0.2 * y.max() if rounds == 0 else 0)
        weight = np.ones(keep.sum()) if rounds == 0 else y[keep]
        for _ in range(rounds + 1):
            c, b, _ = p = np.polyfit(x[keep], np.log(y[keep]), 2, w=weight)
            weight = np.exp(np.polyval(p, x[keep]))
        out[row] = top[row] - 0.5 * b / c
    return out


def zero_crossing(top: Array, slope: Array) -> Array:
    """Near the brightest pixel, linear."""
    index = top.clip(2, slope.shape[1] - 3)[:, None] + np.arange(-2, 3)
    s = np.take_along_axis(slope, index, axis=1)
    k = ((s[:, :-1] >= 0) & (s[:, 1:] < 0)).argmax(axis=1)[:, None]
    a, b = np.take_along_axis(s, k, axis=1), np.take_along_axis(s, k + 1, axis=1)
    return np.asarray((index[:, :1] + k + a / np.where(a == b, 1, a - b))[:, 0])


def plain_blais(image: Array, arm: int) -> Array:
    from scipy.ndimage import correlate1d

    taps = np.r_[-np.ones(arm), 0, np.ones(arm)]
    return zero_crossing(image.argmax(axis=1), correlate1d(image.astype(np.float32), taps, axis=1))


def plain_derivative(image: Array) -> Array:
    from scipy.ndimage import gaussian_filter1d

    return zero_crossing(image.argmax(axis=1), gaussian_filter1d(image.astype(np.float32), SIGMA, axis=1, order=1))


def plain_steger(image: Array) -> Array:
    from scipy.ndimage import gaussian_filter1d

    smooth = image.astype(np.float32)
    first, second = (gaussian_filter1d(smooth, SIGMA, axis=1, order=k) for k in (1, 2))
    top = image.argmax(axis=1)
    row = np.arange(len(image))
    return np.asarray(top - first[row, top] / second[row, top])


def plain_ridge(image: Array) -> Array:
    """OpenCV: blur and five derivatives of the frame, then eigenvectors at the brightest pixels."""
    import cv2

    smooth = cv2.GaussianBlur(image.astype(np.float32), (0, 0), SIGMA)
    rx, ry, rxx, rxy, ryy = (
        cv2.Sobel(smooth, cv2.CV_32F, i, j, scale=0.125 if i + j == 1 else 0.25)
        for i, j in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    )
    row, top = np.arange(len(image)), smooth.argmax(axis=1)
    at = row, top
    hessian = np.stack([rxx[at], rxy[at], rxy[at], ryy[at]], axis=1).reshape(-1, 2, 2)
    values, vectors = np.linalg.eigh(hessian)
    n = vectors[:, :, 0]
    t = -(rx[at] * n[:, 0] + ry[at] * n[:, 1]) / np.minimum(values[:, 0], -1e-3)
    return np.asarray(top + t * n[:, 0])


def plain_ridges(image: Array) -> tuple[Array, Array]:
    """OpenCV and NumPy, everywhere: five derivatives, eigenvectors, points within half a pixel of theirs (u, v)."""
    import cv2

    smooth = cv2.GaussianBlur(image.astype(np.float32), (0, 0), 1.5 * SIGMA)
    rx, ry, rxx, rxy, ryy = (
        cv2.Sobel(smooth, cv2.CV_32F, i, j, scale=0.125 if i + j == 1 else 0.25)
        for i, j in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    )
    gap = 0.5 * (rxx - ryy)
    value = 0.5 * (rxx + ryy) - np.hypot(gap, rxy)
    angle = 0.5 * np.arctan2(-rxy, -gap)
    nx, ny = np.cos(angle), np.sin(angle)
    t = -(rx * nx + ry * ny) / np.minimum(value, -1e-3)
    v, u = np.nonzero((value < -0.5) & (np.abs(t * nx) <= 0.5) & (np.abs(t * ny) <= 0.5))
    return u + t[v, u] * nx[v, u], v + t[v, u] * ny[v, u]


def plain_normal(image: Array) -> Array:
    """Structure from OpenCV, samples along the normal from scipy.ndimage.map_coordinates."""
    from scipy.ndimage import map_coordinates

    start = plain_ridge(image)
    row = np.arange(len(image))
    slope = np.gradient(start)
    n = np.stack([np.ones_like(slope), -slope], axis=1) / np.hypot(1.0, slope)[:, None]
    k = np.arange(-5, 6)
    points = [row[:, None] + k * n[:, 1:], start[:, None] + k * n[:, :1]]
    y = map_coordinates(image.astype(np.float32), points, order=1) - np.median(image, axis=1)[:, None]
    return np.asarray(start + (y * k).sum(axis=1) / y.sum(axis=1) / n[:, 0])


def plain_fit(image: Array, weighted: bool) -> Array:
    """scipy.optimize.curve_fit row by row."""
    from scipy.optimize import curve_fit

    def gauss(x: Array, a: float, c: float, s: float, b: float) -> Array:
        return np.asarray(a * np.exp(-0.5 * ((x - c) / s) ** 2) + b)

    out = np.empty(SOME)
    for y in range(SOME):
        top = int(image[y].argmax())
        x = np.arange(max(top - 8, 0), min(top + 9, WIDTH))
        values = image[y, x].astype(float)
        spread = np.sqrt(values + 1.0) if weighted else None
        out[y] = curve_fit(gauss, x, values, p0=(values.max(), top, 1.5, 5.0), sigma=spread)[0][1]
    return out


PLAIN: dict[str, Callable[[Array], Array]] = {
    "auto": partial(plain_fit, weighted=True),
    "likelihood": partial(plain_fit, weighted=True),
    "gaussian": partial(plain_fit, weighted=False),
    "phase": plain_phase,
    "centre_of_mass": plain_mass,
    "centre_of_mass_threshold": partial(plain_mass, fraction=0.2),
    "centre_of_mass_subtracted": partial(plain_mass, fraction=0.2, subtract=True),
    "centre_of_mass_normal": plain_normal,
    "half_energy": plain_half,
    "row_maximum": plain_maximum,
    "linear": partial(plain_three, kind="linear"),
    "parabola": partial(plain_three, kind="parabola"),
    "gauss_3": partial(plain_three, kind="gauss_3"),
    "caruana": partial(plain_logarithms, rounds=0),
    "guo": partial(plain_logarithms, rounds=5),
    "blais_rioux_2": partial(plain_blais, arm=1),
    "blais_rioux_4": partial(plain_blais, arm=2),
    "blais_rioux_8": partial(plain_blais, arm=4),
    "derivative_of_gaussian": plain_derivative,
    "steger": plain_steger,
    "steger_2d": plain_ridge,
}


def ridges(image: Array, noise: NoiseModel) -> None:
    """Points of any direction, the whole frame searched: ours and the plain code."""
    work = partial(find_ridges, image, noise=noise, threads=2)
    best, median = milliseconds(work)
    plain = milliseconds(partial(plain_ridges, image), 5)[0]

    def rms(u: Array, v: Array) -> float:
        centre = 1200 + 300 * np.sin(v / 250)
        across = np.hypot(1.0, 1.2 * np.cos(v / 250))
        off = (u - centre) / across
        return float(np.sqrt(np.mean(off[np.abs(off) < 3] ** 2)))

    found = work()
    verdict = "ok" if best <= 250 and best < plain else "MISSED"
    print(
        f"  {'ridges, free (Steger 2-D)':26} {best:7.1f} / {median:7.1f} ms  rms {rms(found.u, found.v):.4f}   "
        f"bar   250 ms  plain {plain:8.1f} ms  rms {rms(*plain_ridges(image)):.4f}  {plain / best:6.1f} x  {verdict}"
    )


def chooser(image: Array, noise: NoiseModel) -> None:
    """The network among the candidates of a frame whose every row has a reflection half as bright beside its line."""
    doubled = np.maximum(image, np.roll(image, 300, axis=1) // 2)
    few = partial(extract, doubled, noise=noise, threads=2)
    seen = few(peaks=CANDIDATES, shared=False)
    alone, _ = milliseconds(lambda: select(seen, "learned"))
    strongest, learned = (milliseconds(partial(few, select=how))[0] for how in ("strongest", "learned"))
    verdict = "ok" if alone <= CHOOSER_MS else "MISSED"
    print(
        f"  {'the chooser':26} {alone:7.1f} ms among {int(seen.valid.sum())} candidates   bar {CHOOSER_MS:5.0f} ms  "
        f"{verdict}; extraction with it {learned:.1f} ms, by the strongest peak {strongest:.1f} ms"
    )


def main() -> None:
    image, centre, noise = frame()
    print(f"8 bit, {WIDTH} x {ROWS}, one peak a row, 2 threads; best / median of {REPEATS}; rms error in px")
    for method in get_args(Method):
        work = partial(extract, image, method=method, noise=noise, threads=2)
        best, median = milliseconds(work)
        line = work()
        rms = float(np.sqrt(np.nanmean((line.u[:, 0] - centre) ** 2)))
        other = partial(PLAIN[method], image)
        plain = milliseconds(other, 3)[0]
        found = other()
        if len(found) < ROWS:
            plain *= ROWS / SOME
        plain_rms = float(np.sqrt(np.nanmean((found - centre[: len(found)]) ** 2)))
        bar = BARS_MS.get(method, ROW_LOCAL_MS)
        verdict = "ok" if best <= bar and best < plain else "MISSED"
        print(
            f"  {method:26} {best:7.1f} / {median:7.1f} ms  rms {rms:.4f}   bar {bar:5.0f} ms  "
            f"plain {plain:8.1f} ms  rms {plain_rms:.4f}  {plain / best:6.1f} x  {verdict}"
        )
    ridges(image, noise)
    chooser(image, noise)
    quick = milliseconds(lambda: image.argmax(axis=1))[0]
    print(f"  (numpy.argmax alone, with no background, threshold or reason: {quick:.1f} ms)")


if __name__ == "__main__":
    main()
