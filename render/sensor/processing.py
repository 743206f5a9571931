"""From the sensor's raw numbers to the photograph that a camera hands out: colour, contours, tone, compression.

    white balance   raw less black level over its range, times the gain of its colour, clipped at 1: each colour at its
                    own light, so that a white core has coloured flanks
    demosaic        the two missing colours of every pixel from its neighbours'; not of a mono sensor
    denoise         bilateral filter: a mean over near pixels of about the same light (Tomasi and Manduchi, ICCV 1998)
    tone            0..1 -> 0..1: linear, a power 1 / gamma, or sRGB (IEC 61966-2-1)
    sharpen         unsharp mask: I + amount (I - Gaussian(I))
    numbers         8 bits, rounded
    JPEG            coded and decoded again: blocks of 8 x 8 px, colour at half resolution (ITU-T T.81)

The order is that of Karaimer and Brown (ECCV 2016, figure 2), the sharpening after the tone as in Ramanath et al. (IEEE
Signal Processing Magazine 22(1), 2005); white balance comes before the mosaic is filled, as OpenCV's edge-aware filling
compares colours. Demosaicing, filters and JPEG are OpenCV's. No matrix turns the filters' colours into those of a
screen.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Float32
from render.base.errors import InputError
from render.sensor.sensor import Processing

FULL = 65535.0
"""Numbers in which a mosaic is filled."""
SRGB_TOE, SRGB_SLOPE, SRGB_OFFSET, SRGB_POWER = 0.0031308, 12.92, 0.055, 2.4
REACH = 2.5
"""Sigmas at which the bilateral filter ends."""


def photograph(raw: NDArray[Any], black: float, full: float, pattern: str | None, how: Processing) -> NDArray[np.uint8]:
    """(h, w) raw numbers -> (h, w, 3) RGB of 8 bits, (h, w) of a mono sensor (pattern None).

    black, full: raw numbers without light and at saturation. InputError: too small to have all colours of its pattern.
    """
    light = np.clip((raw.astype(np.float32) - np.float32(black)) / np.float32(full - black), 0.0, 1.0)
    if pattern is not None:
        if min(raw.shape) < 2:
            found = f"{raw.shape[1]} x {raw.shape[0]} px"
            raise InputError("a Bayer mosaic of one row has no colours", where="sensor", found=found, allowed="2 x 2")
        light = demosaiced(balanced(light, pattern, how.white_balance), pattern, how.demosaic)
    if how.denoise > 0.0:
        light = denoised(light, how.denoise, how.denoise_range)
    light = toned(light, how.tone, how.gamma)
    if how.sharpening > 0.0:
        light = sharpened(light, how.sharpening, how.sharpening_radius)
    numbers = np.rint(255.0 * np.clip(light, 0.0, 1.0)).astype(np.uint8)
    return numbers if how.jpeg_quality is None else compressed(numbers, how.jpeg_quality, how.chroma)


def balanced(light: Float32, pattern: str, gains: tuple[float, float, float]) -> Float32:
    """(h, w) mosaic of 0..1, each pixel times the gain of its colour, cut off at 1."""
    out = light.copy()
    for place, colour in enumerate(pattern):
        out[place // 2 :: 2, place % 2 :: 2] *= np.float32(gains["RGB".index(colour)])
    return np.minimum(out, np.float32(1.0))


def demosaiced(light: Float32, pattern: str, how: str) -> Float32:
    """(h, w) mosaic of 0..1 -> (h, w, 3) RGB."""
    import cv2

    suffix = "_EA" if how == "edge_aware" else ""
    code = getattr(cv2, f"COLOR_Bayer{pattern}2RGB{suffix}")
    numbers = np.rint(FULL * light).astype(np.uint16)
    return np.asarray(cv2.cvtColor(numbers, code), np.float32) / np.float32(FULL)


def denoised(light: Float32, sigma: float, alike: float) -> Float32:
    """(h, w) or (h, w, 3) through a bilateral filter; sigma px, alike: sigma in light."""
    import cv2

    size = 2 * int(np.ceil(REACH * sigma)) + 1
    # OpenCV sums the colours' differences, so that three channels differ by three times as much as one
    channels = 1 if light.ndim == 2 else light.shape[2]
    return np.asarray(cv2.bilateralFilter(np.ascontiguousarray(light), size, alike * channels, sigma), np.float32)


def toned(light: Float32, tone: str, gamma: float) -> Float32:
    """Light of 0..1 as the tone curve codes it, 0..1."""
    if tone == "linear":
        return light
    if tone == "gamma":
        return np.asarray(np.power(light, np.float32(1.0 / gamma)), np.float32)
    above = (1.0 + SRGB_OFFSET) * np.power(np.maximum(light, SRGB_TOE), 1.0 / SRGB_POWER) - SRGB_OFFSET
    return np.where(light <= SRGB_TOE, SRGB_SLOPE * light, above).astype(np.float32)


def linear_light(numbers: NDArray[Any], how: Processing) -> Float:
    """Numbers of 8 bits -> light of 0..1: the inverse of the tone curve."""
    code = numbers.astype(np.float64) / 255.0
    if how.tone == "linear":
        return code
    if how.tone == "gamma":
        return np.asarray(code**how.gamma)
    above = ((np.maximum(code, SRGB_SLOPE * SRGB_TOE) + SRGB_OFFSET) / (1.0 + SRGB_OFFSET)) ** SRGB_POWER
    return np.where(code <= SRGB_SLOPE * SRGB_TOE, code / SRGB_SLOPE, above)


def sharpened(light: Float32, amount: float, radius: float) -> Float32:
    """Light through an unsharp mask of a Gaussian of `radius` px; not clipped."""
    import cv2

    soft = cv2.GaussianBlur(light, (0, 0), radius, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(light + np.float32(amount) * (light - soft), np.float32)


def compressed(numbers: NDArray[np.uint8], quality: int, chroma: str) -> NDArray[np.uint8]:
    """(h, w) or (h, w, 3) RGB, coded as JPEG and decoded again."""
    import cv2

    sampling = getattr(cv2, "IMWRITE_JPEG_SAMPLING_FACTOR_" + chroma.replace(":", ""))
    options = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, sampling]
    coloured = numbers.ndim == 3
    done, data = cv2.imencode(".jpg", numbers[..., ::-1] if coloured else numbers, options)
    if not done:
        found = f"{numbers.shape[1]} x {numbers.shape[0]} px"
        raise InputError("the image cannot be coded as JPEG", where="sensor.processing.jpeg_quality", found=found)
    decoded = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR if coloured else cv2.IMREAD_GRAYSCALE), np.uint8)
    return np.ascontiguousarray(decoded[..., ::-1] if coloured else decoded)
