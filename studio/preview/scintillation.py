"""How the light of a laser scatters between the pixels of a sensor: its speckle, and the pixels' uneven gain.

What `render.sensor.speckle` knows of the pattern it draws, as plain numbers for `analysis.line.detection.noise`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.camera.camera import Camera
from render.sensor.sensor import Sensor
from render.sensor.speckle import speckle

WIDEST = 1000.0
"""px; a wider line is none."""
NARROW = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6), (0.47, 0.31, 0.25, 0.20, 0.15, 0.055, 0.0)
"""Sigma of a line, px, and the share by which drawn patterns move it less than its profile tells, by lenses of f/1.4 to
f/11 on pixels of 3.45 um: all within a tenth of what is left."""
WINDOW = 4.0
"""Sigmas of the line on either side that its pixels are taken from."""


def scintillation(sensor: Sensor, camera: Camera, wavelength_nm: float) -> tuple[tuple[tuple[float, ...], ...], float]:
    """Relative covariance of a laser's light between pixels, () where there is none, and its fineness: `NoiseModel`."""
    table, fineness = np.zeros((1, 1)), 0.0
    if sensor.speckle != "off":
        table, fineness = relative_covariance(camera, wavelength_nm, sensor.speckle == "depolarised")
    table[0, 0] += sensor.prnu**2
    return tuple(tuple(row) for row in table.tolist()) if table[0, 0] > 0.0 else (), fineness


def speckle_px(
    camera: Camera,
    wavelength_nm: float,
    sigma: Float,
    position: Float,
    amplitude: Float,
    background: Float,
    variance: float,
    depolarised: bool = False,
) -> Float:
    """(n,) standard deviation of the line's centre by speckle, px, as maximum likelihood measures it.

    Of Gaussian lines: sigma px, position of the centre px, peak and background e- (n,); read variance e-^2. NaN of
    lines without a place, or wider than WIDEST.

        sqrt(sum_ij w_i w_j L_i L_j C_ij),  w = (dL/du / V) / sum (dL/du)^2 / V,  V = L + background + variance

    Of lines narrower than half a pixel nearly all light is in one pixel, which takes in more grains than the profile
    tells: less by the share in NARROW.

    C_ii is larger by h / tanh h where the grain is fine and the light within a pixel runs as exp(2 h x), x in px.
    Without background, a fine grain on a wide line makes it sqrt(C_00 A_c s / (4 sqrt(pi) p^2)), with A_c =
    4 lambda^2 N_w^2 / pi (a line's form of Dorsch, Haeusler and Herrmann 1994).
    """
    known = widths_known(sigma, position, amplitude)
    found = np.full(len(sigma), np.nan)
    if not known.any():
        return found
    sigma, position, amplitude, background = (one[known] for one in (sigma, position, amplitude, background))
    covariance, fineness = relative_covariance(camera, wavelength_nm, depolarised)
    across, left, right, light = line_light(sigma, position, amplitude)
    slope = amplitude[:, None] * (np.exp(-0.5 * left**2) - np.exp(-0.5 * right**2))
    noise = light + background[:, None] + variance
    # far from a line without background or read noise there is neither light nor noise, and nothing is to be weighed
    weight = np.divide(slope, noise, out=np.zeros_like(slope), where=noise > 0.0)
    # of a line without any light nothing is known, which is NaN
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = weight * light / np.sum(weight * slope, axis=1)[:, None]
    steep = np.maximum(np.abs(across) / (2.0 * sigma[:, None] ** 2), 1e-6)
    uneven = 1.0 + fineness * (steep / np.tanh(steep) - 1.0)
    shared = covariance[0, 0] * np.sum(moved**2 * uneven, axis=1)
    for distance in range(1, min(len(covariance), across.shape[1] - 1)):
        shared += 2.0 * covariance[0, distance] * np.sum(moved[:, distance:] * moved[:, :-distance], axis=1)
    found[known] = np.sqrt(np.maximum(shared, 0.0)) * (1.0 - np.interp(sigma, *NARROW))
    return found


def widths_known(sigma: Float, position: Float, amplitude: Float) -> NDArray[np.bool_]:
    """(n,) lines that have a place, a width and light."""
    return np.isfinite(position) & (sigma > 0.0) & (sigma < WIDEST) & (amplitude > 0.0)


def line_light(sigma: Float, position: Float, amplitude: Float) -> tuple[Float, Float, Float, Float]:
    """(n, m) pixels from the centre of a Gaussian line, their edges in its sigmas, and their light, e-."""
    from scipy.special import ndtr

    half = math.ceil(WINDOW * float(np.max(sigma))) + 1
    across = np.arange(-half, half + 1) - (position - np.round(position))[:, None]
    left, right = (across - 0.5) / sigma[:, None], (across + 0.5) / sigma[:, None]
    area = (sigma * math.sqrt(2.0 * math.pi))[:, None]
    return across, left, right, amplitude[:, None] * area * (ndtr(right) - ndtr(left))


def relative_covariance(camera: Camera, wavelength_nm: float, depolarised: bool) -> tuple[Float, float]:
    """(m, m) relative covariance k scan lines and d pixels apart, and how much uneven light adds to a pixel's."""
    field = speckle(wavelength_nm, camera.working_f_number, camera.pixel_pitch, depolarised)
    middle = len(field.correlation) // 2
    return np.array(field.contrast**2 * field.correlation[middle:, middle:]), field.evenness
