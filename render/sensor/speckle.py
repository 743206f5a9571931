"""Laser speckle as a multiplicative field on the sensor: gamma-distributed, with the correlation of a circular pupil.

    |mu(d)|^2 = (2 J1(x) / x)^2,  x = pi d / (lambda N)                  coherence on the sensor, N the working f-number
    C(m, n)   = its mean over two pixels (m, n) apart                    C(0, 0) is the squared contrast, 1 / M
    W         = gamma quantile of shape M at Phi(z), z a normal field    whose correlation makes that of W equal to C

Goodman, Speckle Phenomena in Optics (2007), 4.6 (integrated speckle is nearly gamma) and 4.5 (circular pupil). A
depolarised surface throws two independent patterns, which halves C. Each pixel is cut into 2 x 2, over which the light
is taken to run exponentially, since the flanks of a narrow line fill their pixels unevenly. Fully developed, from a
surface rough against the wavelength; the grain does not depend on focus. How far it moves the centre of a line, and how
alike it moves neighbouring rows, is `position_covariance`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np

from render.base.arrays import Float, Float32
from render.sampling.random import normal, wrapped

LARGEST_RADIUS = 12
"""Largest lag of the correlation, px: it truncates grains of several pixels only."""
FINEST = 0.02
"""Grain, in pixels, below which the covariance is scaled: 1,000 x 1,000 points are added up there."""
NEGLIGIBLE = 2e-3
"""Correlation below which a lag is truncated."""
TABLE, LIMIT = 4097, 6.0
"""Entries of the quantile table, and the normal deviate at its ends."""
ORDERS, NODES = 24, 128
"""Terms of the Hermite series, and nodes of the quadrature of its coefficients."""
CUTS = 2
"""Subpixels along a pixel's side."""
STEEPEST = 4.0
"""Largest slope of the logarithm of the light, 1/px, to which steeper ones are clipped."""
SURFACE = 0x53504543
"""Seed of the surface's random numbers, to keep them independent of the sensor's."""
_PATTERN = 16
"""First random dimension; one a laser."""
SPECTRUM = 513
"""Frequencies across the line at which a row's power spectrum is tabled."""


@dataclass(frozen=True)
class Speckle:
    """Statistics of one laser's speckle on one sensor."""

    contrast: float
    """Standard deviation over mean of a pixel's intensity."""
    correlation: Float
    """(2 r + 1, 2 r + 1) correlation of the intensity between pixels, 1 in the middle."""
    taps: Float
    """(2 q + 1, 2 q + 1) filter that gives white normals the field's correlation; unit sum of squares."""
    quantile: Float
    """(2, TABLE) intensity over its mean for normal deviates -LIMIT..LIMIT; row 1 is for twice the variance."""
    evenness: float
    """Weight with which uneven light within a subpixel raises its variance: 1 for a fine grain, 0 for a coarse one."""


@lru_cache(maxsize=16)
def speckle(wavelength_nm: float, f_number: float, pixel_pitch: float, depolarised: bool = False) -> Speckle:
    """Speckle of a laser through a circular pupil; f_number is the working one, pixel_pitch in m."""
    from scipy.special import gammaincinv, ndtr

    patterns = 2.0 if depolarised else 1.0
    grain = speckle_grain(wavelength_nm, f_number, pixel_pitch)
    whole, _ = _covariance(grain)
    part, evenness = _covariance(CUTS * grain)
    middle, centre = whole.shape[0] // 2, part.shape[0] // 2
    shape = patterns / part[centre, centre]
    cumulative = ndtr(np.linspace(-LIMIT, LIMIT, TABLE))
    quantile = np.stack([gammaincinv(k, cumulative) / k for k in (shape, 0.5 * shape)])
    taps = _taps(_normal_correlation(part / part[centre, centre], shape))
    variance = whole[middle, middle]
    return Speckle(math.sqrt(variance / patterns), whole / variance, taps, quantile, evenness)


def speckle_grain(wavelength_nm: float, f_number: float, pixel_pitch: float) -> float:
    """Diameter lambda N of the speckles in pixels; f_number is the working one, pixel_pitch in m."""
    return wavelength_nm * 1e-9 * f_number / pixel_pitch


def position_covariance(grain: float, widths: Float, lags: int = 0, depolarised: bool = False) -> Float:
    """(n,) widths of Gaussian lines, sigma in px before the pixels -> (n, lags + 1) covariance, px^2, of the centres
    of two rows 0..lags apart: the variance stands first. grain: lambda N in px, as `speckle_grain` gives it.

    A centre of mass, and a fit by maximum likelihood in shot noise, moves to the first order of the contrast by the
    mean of x S(x, y) over the light of its row. With the power spectrum A_c T of the speckle, T the transfer function
    of a circular pupil (Goodman 2007, 4.5), and f, h in cycles per pixel across and along the line, that is

        cov(m) = A_c int int w(f) sinc^2(h) cos(2 pi m h) T(grain sqrt(f^2 + h^2)) df dh,      A_c = 4 grain^2 / pi
        w(f)   = s^2 (2 pi s f)^2 exp(-(2 pi s f)^2) + sum over k != 0 of exp(-(2 pi s (f - k))^2) / (2 pi k)^2

    where the sum holds the place of the pixels under the line, all being alike. A fine grain under a wide line leaves
    A_c s / (4 sqrt(pi)), the line's form of Dorsch, Haeusler and Herrmann 1994: its deviation is 14 % high for a grain
    of 0.5 px and 50 to 165 % from 1.5 px. The deviation here is that of coherent simulation within 9 % for widths from
    0.5 px and grains up to four of them. Beyond, rows that lost nearly all of their light scatter with long tails, and
    it is low: by 8, 20 and 34 % at five, seven and ten widths. Least squares, which weigh the flanks less by light,
    scatter 1.3 (0.5 px) to 1.7 times (wide lines) more; an estimator's own share follows from `Speckle.correlation`.
    """
    cutoff = 1.0 / grain
    count = math.ceil(16.0 * (1 + lags) * (cutoff + 2.0))
    along = (np.arange(count) + 0.5) / count * cutoff
    across = np.linspace(0.0, cutoff, SPECTRUM)
    rho = np.minimum(np.hypot(across[:, None], along) * grain, 1.0)
    transfer = 2.0 / math.pi * (np.arccos(rho) - rho * np.sqrt(1.0 - rho**2))
    rows = np.sinc(along)[:, None] ** 2 * np.cos(2.0 * np.pi * along[:, None] * np.arange(lags + 1))
    spectrum = 4.0 * grain**2 / math.pi * (2.0 * cutoff / count) * (transfer @ rows)
    found = np.empty((len(widths), lags + 1))
    for i, width in enumerate(widths):
        f = np.linspace(-cutoff, cutoff, 2 * max(256, math.ceil(50.0 * cutoff * width)) + 1)
        square = (2.0 * math.pi * width * f) ** 2
        weight = width**2 * square * np.exp(-square)
        for k in range(1, int(cutoff + 1.0 / width) + 1):
            for other in (f - k, f + k):
                weight += np.exp(-((2.0 * math.pi * width * other) ** 2)) / (2.0 * math.pi * k) ** 2
        power = np.stack([np.interp(np.abs(f), across, column) for column in spectrum.T])
        found[i] = (power @ weight) * (f[1] - f[0])
    return found / (2.0 if depolarised else 1.0)


def position_variance(grain: float, widths: Float, depolarised: bool = False) -> Float:
    """(n,) variance, px^2, of the centres of lines of (n,) widths by speckle: `position_covariance` of a row alone."""
    return position_covariance(grain, widths, 0, depolarised)[:, 0]


def position_correlation(grain: float, width: float, lags: int) -> Float:
    """(lags + 1,) correlation of the centres of two rows 0..lags apart, 1 at 0, of a line of one width in px.

    The variance of a mean over n rows is that of one times (1 + 2 sum over m < n of (1 - m / n) correlation[m]) / n.
    """
    covariance = position_covariance(grain, np.array([width]), lags)[0]
    return np.asarray(covariance / covariance[0])


def _covariance(grain: float) -> tuple[Float, float]:
    """(2 r + 1, 2 r + 1) C(m, n) for lambda N in pixels, and the evenness."""
    from scipy.special import j1

    if grain < FINEST:
        # many grains in a pixel: the variance of their mean falls with the square, and no two pixels share any
        covariance, evenness = _covariance(FINEST)
        return covariance * (grain / FINEST) ** 2, evenness
    reach = min(LARGEST_RADIUS, math.ceil(1.0 + 4.0 * grain))
    steps = max(8, math.ceil(10.0 / grain))
    offset = (np.arange((reach + 1) * steps) + 0.5) / steps
    x = np.pi * np.hypot(offset[:, None], offset) / grain
    coherence = (2.0 * j1(x) / x) ** 2
    lags = np.arange(reach + 1)
    # the distance between two points in two pixels has a triangular pdf
    near = np.maximum(1.0 - np.abs(offset - lags[:, None]), 0.0) + np.maximum(1.0 - np.abs(offset + lags[:, None]), 0.0)
    near /= steps
    quarter = near @ coherence @ near.T
    keep = max(1, int(np.max(np.nonzero(quarter[0] > NEGLIGIBLE * quarter[0, 0])[0], initial=1)))
    mirrored = np.abs(np.arange(-keep, keep + 1))
    # integral of x (x + d) over the pairs of points d apart in one pixel, about its centre
    inside = np.maximum(1.0 - offset, 0.0)
    product = (inside**3 / 12.0 - offset**2 * inside / 4.0) * 2.0 / steps
    moment = float(product @ coherence @ near[0]) * 12.0 / quarter[0, 0]
    return np.asarray(quarter[np.ix_(mirrored, mirrored)]), min(max(moment, 0.0), 1.0)


def _normal_correlation(correlation: Float, shape: float) -> Float:
    """Correlation of normals whose gamma transforms have the required correlation (Hermite series)."""
    from scipy.special import eval_hermitenorm, gammaincinv, ndtr

    nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
    values = gammaincinv(shape, np.clip(ndtr(nodes), 1e-300, 1.0 - 1e-16)) / shape
    weights = weights / weights.sum()
    power = np.array(
        [(weights @ (values * eval_hermitenorm(k, nodes))) ** 2 / math.factorial(k) for k in range(1, ORDERS)]
    )
    normals = np.linspace(0.0, 1.0, 513)
    gammas = np.polynomial.polynomial.polyval(normals, np.append(0.0, power)) / power.sum()
    return np.asarray(np.interp(correlation, gammas, normals))


def _taps(correlation: Float) -> Float:
    """Symmetric filter with the given autocorrelation, truncated one lag beyond it."""
    radius = correlation.shape[0] // 2
    size = 8 * (radius + 2)
    grid = np.zeros((size, size))
    at = np.arange(-radius, radius + 1) % size
    grid[np.ix_(at, at)] = correlation
    spectrum = np.maximum(np.fft.fft2(grid).real, 0.0)
    kernel = np.fft.fftshift(np.fft.ifft2(np.sqrt(spectrum)).real)
    middle, reach = size // 2, radius + 1
    cut = kernel[middle - reach : middle + reach + 1, middle - reach : middle + reach + 1]
    return np.ascontiguousarray(cut / np.sqrt((cut**2).sum()))


def scintillate(image: Float32, start: int, stop: int, field: Speckle, seed: int, step: int, laser: int) -> Float32:
    """Rows start..stop of a laser's (h, w) image, with speckle.

    Another seed, step or laser is another pattern; how the image is cut into rows changes nothing.
    """
    rows = image[start:stop]
    lit = np.nonzero((rows > 0.0).any(axis=0))[0]
    if len(lit) == 0:
        return rows
    out = rows.copy()
    key = wrapped(seed ^ (SURFACE << 24))
    first, last = int(lit[0]), int(lit[-1]) + 1
    _scintillate(
        image, start, first, last, field.taps, field.quantile, field.evenness, key, step, _PATTERN + laser, out
    )
    return out


@numba.njit(nogil=True, cache=True)
def _slope(before: float, here: float, after: float) -> float:
    """Slope of the logarithm of the light at the middle of three pixels."""
    least = 1e-4 * here
    slope = 0.5 * math.log(max(after, least) / max(before, least))
    return min(max(slope, -STEEPEST), STEEPEST)


@numba.njit(nogil=True, cache=True)
def _unevenness(slope: float) -> float:
    """Mean square over squared mean of exp(slope x) over a subpixel."""
    half = 0.5 * slope / CUTS
    return 1.0 if abs(half) < 1e-6 else half / math.tanh(half)


@numba.njit(nogil=True, cache=True)
def _scintillate(  # noqa: PLR0913
    image: Float32,
    start: int,
    first: int,
    last: int,
    taps: Float,
    quantile: Float,
    evenness: float,
    seed: int,
    step: int,
    dimension: int,
    out: Float32,
) -> None:
    """Multiply columns first..last - 1 of out (n, w), rows start.. of the image (h, w), by the field."""
    n, (h, w) = out.shape[0], image.shape
    reach = taps.shape[0] // 2
    white = np.empty((CUTS * n + 2 * reach, CUTS * (last - first) + 2 * reach))
    for i in range(white.shape[0]):
        for j in range(white.shape[1]):
            # indices run beyond the image; the stride between rows is wider than any image and its margin
            row, column = CUTS * start - reach + i + 4096, CUTS * first - reach + j + 4096
            white[i, j] = normal(seed, np.int64(row) * 131072 + np.int64(column), step, dimension)
    scale = (quantile.shape[1] - 1) / (2.0 * LIMIT)
    for i in range(n):
        y = start + i
        for x in range(first, last):
            light = image[y, x]
            if light <= 0.0:
                continue
            across = _slope(image[y, max(x - 1, 0)], light, image[y, min(x + 1, w - 1)])
            along = _slope(image[max(y - 1, 0), x], light, image[min(y + 1, h - 1), x])
            more = 1.0 + (_unevenness(across) * _unevenness(along) - 1.0) * evenness
            blend = min(max(more - 1.0, 0.0), 1.0)
            total, weights = 0.0, 0.0
            for a in range(CUTS):
                for b in range(CUTS):
                    weight = math.exp((across * (b - 0.5 * (CUTS - 1)) + along * (a - 0.5 * (CUTS - 1))) / CUTS)
                    z, top, left = 0.0, CUTS * i + a, CUTS * (x - first) + b
                    for v in range(taps.shape[0]):
                        for u in range(taps.shape[1]):
                            z += taps[v, u] * white[top + v, left + u]
                    place = min(max((z + LIMIT) * scale, 0.0), quantile.shape[1] - 1.001)
                    k = int(place)
                    t = place - k
                    plain = quantile[0, k] + t * (quantile[0, k + 1] - quantile[0, k])
                    rough = quantile[1, k] + t * (quantile[1, k + 1] - quantile[1, k])
                    total += weight * (plain + blend * (rough - plain))
                    weights += weight
            out[i, x] = light * total / weights
