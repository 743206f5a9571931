"""The sensor's response: electrons for a radiance of 1 W/(m^2 sr), by optics, spectrum and quantum efficiency.

    irradiance of a pixel    E = pi L T cos^4(theta) / (4 N_w^2)          N_w the working f-number
    electrons                E A t integral(s(lambda) F(lambda) QE(lambda) lambda / (h c) dlambda)

with L the scene's radiance, s its unit-area spectrum, T the lens's transmission, F the band-pass filter's, A the
pixel's area and t the exposure time (EMVA 1288, release 4, section 2). A laser is a line at its wavelength. Ambient
light is flat within its band: B 400-500 nm, G 500-600 nm, R 600-700 nm, nothing outside.
"""

from __future__ import annotations

import math

import numpy as np

from render.base.arrays import Float, Float32
from render.base.kept_result import kept
from render.base.pose import Pose
from render.base.threads import map_chunks
from render.camera.camera import Camera, Lens
from render.sensor.sensor import BandPass, Sensor, SpectralCurve

PLANCK, LIGHT_SPEED = 6.62607015e-34, 299792458.0
BANDS_NM = ((600.0, 700.0), (500.0, 600.0), (400.0, 500.0))
"""Bands of ambient R, G and B, nm."""

_PHOTONS_PER_JOULE_NM = 1e-9 / (PLANCK * LIGHT_SPEED)
_CHANNEL = {"R": 0, "G": 1, "B": 2}


def joules_per_radiance(camera: Camera, sensor: Sensor) -> float:
    """Energy (J) that a pixel on the axis gets from radiance 1 W/(m^2 sr) in one exposure, before the filter."""
    pitch_y = camera.pixel_pitch * camera.fx / camera.fy  # both are the image distance over their pitch
    irradiance = math.pi * camera.lens.transmission / (4.0 * camera.working_f_number**2)
    return irradiance * camera.pixel_pitch * pitch_y * sensor.exposure_time


def laser_response(sensor: Sensor, wavelength_nm: float) -> Float:
    """(2, 2) electrons per joule at one wavelength, for the pixels of the 2 x 2 colour pattern (mono: all the same)."""
    joule = wavelength_nm * _PHOTONS_PER_JOULE_NM * _transmission(sensor.band_pass, wavelength_nm)
    return _mosaic(sensor, np.array([joule * _efficiency(curve, wavelength_nm) for curve in sensor.efficiency]))


def band_response(sensor: Sensor) -> Float:
    """(2, 2, 3) electrons per joule of ambient R, G, B light, for the pixels of the 2 x 2 colour pattern."""
    averages = [[_band_average(curve, sensor.band_pass, *band) for band in BANDS_NM] for curve in sensor.efficiency]
    return _mosaic(sensor, np.array(averages))


def relative_illumination(camera: Camera, threads: int | None = None) -> Float32:
    """(h, w) natural vignetting, cos^4 of the angle of each pixel's own ray; 0 where the lens has no ray."""
    shape = (camera.height, camera.width)
    if not camera.lens.vignetting:
        return np.broadcast_to(np.float32(1.0), shape)
    # pose and lens do not matter and are reset, so that a moved camera finds the cached image
    return _cos4(camera.model_copy(update={"T_rig_camera": Pose(), "lens": Lens()}), threads=threads)


@kept(most=2)
def _cos4(camera: Camera, *, threads: int | None) -> Float32:
    image = np.empty((camera.height, camera.width), dtype=np.float32)
    columns = np.arange(camera.width, dtype=np.float64)

    def rows(start: int, stop: int) -> None:
        pixels = np.empty((stop - start, camera.width, 2))
        pixels[..., 0] = columns
        pixels[..., 1] = np.arange(start, stop)[:, None]
        normalised, valid = camera.normalise(pixels)
        cos2 = 1.0 / (1.0 + normalised[..., 0] ** 2 + normalised[..., 1] ** 2)
        image[start:stop] = np.where(valid, cos2 * cos2, 0.0)

    map_chunks(rows, camera.height, 64, threads)
    image.flags.writeable = False
    return image


def _efficiency(curve: SpectralCurve, wavelength_nm: Float | float) -> Float:
    return np.asarray(np.interp(wavelength_nm, curve.wavelength_nm, curve.value, left=0.0, right=0.0))


def _transmission(band_pass: BandPass | None, wavelength_nm: float) -> float:
    if band_pass is None:
        return 1.0
    return band_pass.transmission if abs(wavelength_nm - band_pass.centre_nm) <= band_pass.width_nm / 2 else 0.0


def _band_average(curve: SpectralCurve, band_pass: BandPass | None, low: float, high: float) -> float:
    """Electrons per joule of light that is flat over low..high nm.

    QE is piecewise linear, so QE times lambda is piecewise quadratic and Simpson's rule between the knots is exact.
    """
    first, last = max(low, curve.wavelength_nm[0]), min(high, curve.wavelength_nm[-1])
    if band_pass is not None:
        first = max(first, band_pass.centre_nm - band_pass.width_nm / 2)
        last = min(last, band_pass.centre_nm + band_pass.width_nm / 2)
    if last <= first:
        return 0.0
    knots = np.array([first, *(k for k in curve.wavelength_nm if first < k < last), last])
    middles = (knots[:-1] + knots[1:]) / 2

    def integrand(wavelength: Float) -> Float:
        return _efficiency(curve, wavelength) * wavelength

    f = integrand(knots)
    integral = float(np.sum(np.diff(knots) * (f[:-1] + 4.0 * integrand(middles) + f[1:]) / 6.0))
    filtered = 1.0 if band_pass is None else band_pass.transmission
    return filtered * _PHOTONS_PER_JOULE_NM * integral / (high - low)


def _mosaic(sensor: Sensor, channels: Float) -> Float:
    """(c, ...) by channel -> (2, 2, ...) by place in the colour pattern."""
    if sensor.colour == "mono":
        return np.broadcast_to(channels[0], (2, 2, *channels.shape[1:])).copy()
    return channels[[_CHANNEL[c] for c in sensor.pattern]].reshape(2, 2, *channels.shape[1:])
