"""How many scan lines saturate: the chance that shot noise, read noise and speckle lift a pixel over its full well.

One estimate for all who tell of it, be the mean light of the pixels a closed form or rendered. Where an image has been
developed, they are counted in it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.camera.camera import Camera
from render.frame import LaserCurve
from render.sensor.develop import Image
from render.sensor.sensor import Sensor
from studio.preview.scintillation import line_light, relative_covariance, widths_known

REACH = 12.0
"""Standard deviations below the full well from which on a pixel is not asked: even of coarse speckle, whose light falls
off exponentially, two in a million exceed it."""
LEVELS = 257
"""Of light, among which the least that is asked of is sought."""
SMOOTHEST = 1e8
"""Shape of a gamma distribution that is as good as a normal one."""


def full_electrons(sensor: Sensor) -> float:
    """Electrons that a pixel tells of at most: its full well, or those that the highest number stands for."""
    return min(sensor.full_well, float(2**sensor.bits - 1 - sensor.black_level) / sensor.dn_per_electron)


def exceeding(sensor: Sensor, camera: Camera, wavelength_nm: float, light: Float, background: Float | float) -> Float:
    """Chance that a pixel reads as saturated: mean light of the laser and background, e-, of any one shape.

    Goodman, Speckle Phenomena in Optics (2007), 4.6: light that is integrated over a pixel is gamma-distributed. With
    the noise of `render.sensor.develop` it has the mean m = L + b and the central moments

        variance = c^2 L^2 + (prnu m)^2 + m + read variance,  third = 2 c^4 L^3 + 3 c^2 L^2 + m,  c the contrast

    of which a shifted gamma distribution is taken: without noise that of the speckle, without speckle nearly Poisson's.
    """
    from scipy.special import gammaincc

    square = _squared_contrast(sensor, camera, wavelength_nm)
    mean = np.maximum(light + background, 1e-12)
    variance = square * light**2 + (sensor.prnu * mean) ** 2 + mean + sensor.read_noise**2 + sensor.dsnu**2
    third = 2.0 * square**2 * light**3 + 3.0 * square * light**2 + mean
    # a number is rounded, so that half a step below the highest reads as it
    above = (full_electrons(sensor) - 0.5 / sensor.dn_per_electron - mean) / np.sqrt(variance)
    cells = np.minimum(4.0 * variance**3 / third**2, SMOOTHEST)
    return np.asarray(gammaincc(cells, np.maximum(cells + np.sqrt(cells) * above, 0.0)))


def saturated_rows(
    sensor: Sensor, camera: Camera, wavelength_nm: float, light: Float, background: Float | float
) -> Float:
    """(n,) chance that any pixel of a scan line saturates: mean light of the laser (n, m) and background, e-.

    Pixels count as independent, which tells a tenth too much of speckle whose grain is as large as they are.
    """
    behind = np.broadcast_to(background, light.shape)
    full = full_electrons(sensor)
    levels = np.linspace(0.0, full, LEVELS)
    square = _squared_contrast(sensor, camera, wavelength_nm) + sensor.prnu**2
    reached = levels + REACH * np.sqrt(square * levels**2 + levels + sensor.read_noise**2 + sensor.dsnu**2)
    asked = light + behind > np.interp(full, reached, levels)
    chance = np.zeros(light.shape)
    chance[asked] = exceeding(sensor, camera, wavelength_nm, light[asked], behind[asked])
    return np.asarray(1.0 - np.prod(1.0 - chance, axis=1))


def saturated_lines(
    sensor: Sensor,
    camera: Camera,
    wavelength_nm: float,
    sigma: Float,
    position: Float,
    amplitude: Float,
    background: Float,
) -> Float:
    """(n,) chance that any pixel of a Gaussian line saturates: of lines as in `scintillation.speckle_px`."""
    known = widths_known(sigma, position, amplitude)
    found = np.zeros(len(sigma))
    if known.any():
        *_, light = line_light(sigma[known], position[known], amplitude[known])
        found[known] = saturated_rows(sensor, camera, wavelength_nm, light, background[known][:, None])
    return found


def counted_saturated(images: Sequence[Image], curves: Sequence[LaserCurve]) -> NDArray[np.int64]:
    """(n, 2) of the scan lines that a laser's line is seen on: those whose brightest pixel saturates, and all."""
    found = np.zeros((len(curves), 2), dtype=np.int64)
    for own, image, curve in zip(found, images, curves, strict=False):
        # of a photograph in colour any of its channels
        across = tuple(axis for axis in range(image.pixels.ndim) if axis != (0 if curve.axis == "rows" else 1))
        hit = np.unique(curve.index)
        own[:] = np.count_nonzero(image.pixels.max(axis=across)[hit] >= image.saturation), len(hit)
    return found


def shares(counted: NDArray[np.int64]) -> list[float | None]:
    """Of such counts; None: there are no scan lines."""
    return [full / seen if seen else None for full, seen in counted.tolist()]


def brightest(sensor: Sensor, camera: Camera, wavelength_nm: float, chance: float) -> float:
    """Times its mean that a pixel's light is exceeded by on `chance` of all lines; 1 without speckle."""
    from scipy.special import gammainccinv

    square = _squared_contrast(sensor, camera, wavelength_nm)
    return float(gammainccinv(1.0 / square, chance) * square) if square > 0.0 else 1.0


def _squared_contrast(sensor: Sensor, camera: Camera, wavelength_nm: float) -> float:
    """Relative variance of a pixel's light by speckle; 0 without."""
    if sensor.speckle == "off":
        return 0.0
    covariance, _ = relative_covariance(camera, wavelength_nm, sensor.speckle == "depolarised")
    return float(covariance[0, 0])
