"""One image from several exposures: the maximum-likelihood rate of electrons of every pixel, with its variance.

    rate = sum(e_i t_i / v_i) / sum(t_i^2 / v_i),   v_i = rate t_i + floor,   var(rate) = 1 / sum(t_i^2 / v_i)

over the exposures in which the pixel is not saturated. The variances are those of the rate itself, not of the noisy
counts, which would pull it down. Without read noise it is all electrons over all time. The image is given in electrons
of all exposures together, so that its variance is never less than a count's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import check_image
from analysis.line.detection.noise import NoiseModel
from render.base.arrays import Float32
from render.base.errors import InputError

SHORTEST, LONGEST, MOST_RATIO = 1e-30, 1e30, 1e15
"""Of exposure times in any unit; farther apart, their electrons leave the range of float32."""
ROUNDS = 3
"""Weights and rate settle in two."""


@dataclass(frozen=True)
class Fused:
    """An image in electrons of all exposures together; give all three to `extract`."""

    electrons: Float32
    """(h, w); pixels saturated in every exposure hold `noise.saturation`."""
    variance: Float32
    """(h, w) e-^2."""
    noise: NoiseModel


def fuse(images: Sequence[NDArray[Any]], exposure_times: Sequence[float], noise: NoiseModel) -> Fused:
    """Images (h, w) DN of one scene and sensor, and their exposure times in s -> Fused.

    Raises InputError: fewer than two images, another shape or type, a time that is not positive, no saturation known.
    """
    if len(images) < 2 or len(images) != len(exposure_times):
        found = f"{len(images)} images, {len(exposure_times)} times"
        raise InputError("fusion needs two exposures or more, and a time for each", where="exposures", found=found)
    arrays = [check_image(image) for image in images]
    if any(array.ndim != 2 or array.shape != arrays[0].shape for array in arrays):
        found = ", ".join(str(array.shape) for array in arrays)
        raise InputError("the exposures are not of one shape", where="exposures", found=found, allowed="all (h, w)")
    types = sorted({str(array.dtype) for array in arrays})
    if len(types) > 1:
        raise InputError("the exposures are not of one type", where="exposures", found=", ".join(types))
    times = np.asarray(exposure_times, dtype=np.float64)
    if not np.all((times >= SHORTEST) & (times <= LONGEST)):
        allowed = f"{SHORTEST:g} to {LONGEST:g}"
        raise InputError("an exposure time is out of range", where="exposures", found=times.tolist(), allowed=allowed)
    if times.max() > MOST_RATIO * times.min():
        found, allowed = f"{times.max() / times.min():.3g} times the shortest", f"{MOST_RATIO:g} times at most"
        raise InputError("the longest exposure is too long", where="exposures", found=found, allowed=allowed)
    if noise.saturation is None:
        raise InputError("fusion needs to know which pixels are saturated", where="noise.saturation")
    full = (noise.saturation - noise.black_level) / noise.gain
    together = float(times.sum())
    counts = [((array.astype(np.float32) - noise.black_level) / noise.gain).astype(np.float32) for array in arrays]
    usable = [(array < noise.saturation).astype(np.float32) for array in arrays]  # NaN is not
    counts = [np.where(good > 0, count, np.float32(0)) for count, good in zip(counts, usable, strict=True)]
    seen = sum(good * time for good, time in zip(usable, times, strict=True))
    rate = sum(counts) / np.maximum(seen, times.min() * 1e-9)
    information = np.zeros(arrays[0].shape)
    for _ in range(ROUNDS):
        total = np.zeros(arrays[0].shape)
        information[:] = 0.0
        for count, good, time in zip(counts, usable, times, strict=True):
            weight = good * time / (np.maximum(rate, 0.0) * time + noise.floor)
            total += weight * count
            information += weight * time
        rate = total / np.maximum(information, 1e-300)
    top = full * together / float(times.min())
    blind = information <= 0.0
    missing = np.any([np.isnan(array) for array in arrays if array.dtype.kind == "f"], axis=0) & blind
    electrons = np.where(blind, top, np.minimum(rate * together, np.nextafter(np.float32(top), np.float32(0))))
    variance = np.where(blind, top, together**2 / np.maximum(information, 1e-300))
    electrons = np.where(missing, np.nan, electrons)
    model = NoiseModel(
        gain=1.0,
        black_level=0.0,
        read_noise=noise.read_noise,
        saturation=float(np.float32(top)),
        step=0.0,
        scintillation=noise.scintillation,  # the same grains in every exposure
        fineness=noise.fineness,
        alike=noise.alike,
    )
    return Fused(electrons.astype(np.float32), variance.astype(np.float32), model)
