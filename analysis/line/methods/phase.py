"""The phase of the window's first Fourier bin, the window put back on its own result.

    u = m + L / 2 pi arg sum y(x) exp(2 pi i (x - m) / L),   L = 6 s + 3 pixels around m

One pass, blind to a constant background, and 96 % efficient, since its sine weighs the flanks and not the far wings. A
neighbour inside the window or a sloping background drags it along, as they do the centre of mass.
"""

from __future__ import annotations

import math

import numpy as np

from analysis.line.detection.detect import CENTRE, PLATEAU, REACH, WIDTH
from analysis.line.methods.seed_loop import Array, Options, Pixels, peak_kernel
from analysis.line.methods.window import any_saturated, brightest, load_window, position_sigma, write_peak
from analysis.line.result import Flag

NARROWEST = 0.5
"""px; narrower lines are not band-limited (0.02 px at 0.4), and no sigma is reported."""


@peak_kernel
def measure_phase(pixels: Pixels, y: int, seed: Array, flag: int, options: Options, out: Array) -> int:
    """Peak kernel (`seed_loop`)."""
    signal, mask = pixels.signal[y], pixels.mask[y]
    window, weight, sines, cosines = pixels.room[0], pixels.room[1], pixels.room[2], pixels.room[3]
    middle = brightest(signal, mask, seed)
    half = max(2, math.ceil(min(3.0 * seed[WIDTH] + 1.0 + seed[PLATEAU], seed[REACH])))
    n = 2 * half + 1
    if n > signal.shape[0]:
        return Flag.AT_BORDER.value
    step = 2.0 * math.pi / n
    sine, cosine = math.sin(step), math.cos(step)
    sines[half], cosines[half] = 0.0, 1.0
    for i in range(half, 2 * half):  # by the sum of angles, to 1e-14
        sines[i + 1] = sines[i] * cosine + cosines[i] * sine
        cosines[i + 1] = cosines[i] * cosine - sines[i] * sine
        sines[2 * half - i - 1], cosines[2 * half - i - 1] = -sines[i + 1], cosines[i + 1]
    reason, u, real, imaginary, previous = Flag.NOT_CONVERGED.value, np.nan, 0.0, 0.0, -1
    for _ in range(8):
        if load_window(signal, mask, middle - half, middle + half, seed, window) < 0:
            return Flag.AT_BORDER.value
        real = imaginary = 0.0
        for i in range(n):
            real += window[i] * cosines[i]
            imaginary += window[i] * sines[i]
        if real <= 0.0 and abs(imaginary) <= 0.0:
            break
        u = middle + math.atan2(imaginary, real) / step
        if abs(u - seed[CENTRE]) > half:
            return Flag.OUT_OF_WINDOW.value
        following = round(u)
        if following in (middle, previous):  # at rest, or astride two pixels
            reason = flag
            break
        previous, middle = middle, following
    if reason > Flag.SATURATED.value:
        return reason
    sigma, first = np.nan, middle - half
    if seed[WIDTH] >= NARROWEST and not any_saturated(mask, first, middle + half):
        power = real * real + imaginary * imaginary
        for i in range(n):
            weight[i] = (sines[i] * real - cosines[i] * imaginary) / (step * power)
        sigma = position_sigma(pixels, y, seed, first, n, weight, out)
    write_peak(seed, u, sigma, out)
    return reason
