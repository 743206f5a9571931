"""Closed-form estimates for a rig: resolution, width, electrons, noise and blur of the line.

Unshadowed ambient light, a thin lens: what a render tells exactly, these tell while dragging.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from analysis.line.detection.matched_filter import FILTER_SIGMA, NOISE_GAIN
from render.base.arrays import Float
from render.base.pose import invert, transform_points
from render.camera.camera import Camera
from render.laser.laser import LineLaser
from render.sensor.response import band_response, joules_per_radiance, laser_response
from render.sensor.sensor import Sensor
from studio.preview.preview import Lit, Look

SHARP_PX = 1.0
"""A blur disc up to this diameter counts as in focus."""
BLURRED_PX = 4.0 * SHARP_PX
"""Diameter of the blur disc from which it is most of a line's width."""
HALF = 0.5


def line_pixels(lit: Lit) -> Float:
    """(n, 2) (u, v) of the line."""
    index = lit.curve.index.astype(np.float64)
    pair = (lit.curve.position, index) if lit.curve.axis == "rows" else (index, lit.curve.position)
    return np.stack(pair, axis=1)


def resolution(camera: Camera, plane: Float, pixels: Float, direction: tuple[float, float]) -> Float:
    """(n, 3) m: how far the point in the laser's plane (4,) moves for one pixel of (n, 2) along a unit direction."""
    step = HALF * np.asarray(direction)
    ends = []
    for shifted in (pixels - step, pixels + step):
        rays, _ = camera.rays(shifted)
        with np.errstate(divide="ignore", invalid="ignore"):
            ends.append(rays * (-plane[3] / (rays @ plane[:3]))[:, None])
    return np.asarray(np.abs(ends[1] - ends[0]))


def line_width_px(
    camera: Camera, laser: LineLaser, T_camera_laser: Float, normal: Float, point: Float, pixels: Float, rows: bool
) -> Float:
    """(n,) sigma, px, of the line's image across the scan line: the sheet's Gaussian on each point's own facet.

    normal, point: (n, 3) of the facet, camera frame; pixels: (n, 2) where its line is.
    """
    T_laser_camera = invert(T_camera_laser)
    offset = np.einsum("ij,ij->i", normal, point)
    slopes = []
    for direction in ((1.0, 0.0), (0.0, 1.0)):
        q = []
        for sign in (-HALF, HALF):
            rays, _ = camera.rays(pixels + sign * np.asarray(direction))
            with np.errstate(divide="ignore", invalid="ignore"):
                on_facet = rays * (offset / np.einsum("ij,ij->i", normal, rays))[:, None]
            local = transform_points(T_laser_camera, on_facet)
            with np.errstate(divide="ignore", invalid="ignore"):
                q.append(local[:, 0] / laser.sigma(local[:, 2]))
        slopes.append(q[1] - q[0])
    across, along = slopes if rows else slopes[::-1]
    # over the height of a pixel a slanted line shifts, which widens it by a box
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.sqrt(1.0 + along**2 / 12.0) / np.abs(across))


def line_electrons(camera: Camera, laser: LineLaser, sensor: Sensor, lit: Lit, pixels: Float) -> Float:
    """(n,) electrons that a pixel would have in which the whole pixel were as bright as the line's centre."""
    response = joules_per_radiance(camera, sensor) * laser_response(sensor, laser.wavelength_nm)
    return np.asarray(lit.curve.irradiance * lit.reflected / math.pi * _by_pixel(response, pixels) * _cos4(camera, lit))


def pixel_share(position: Float, sigma: Float) -> Float:
    """(n,) mean over the brightest pixel of a Gaussian of peak 1, where its centre falls within the pixel."""
    from scipy.special import ndtr

    offset = position - np.round(position)
    area = ndtr((HALF - offset) / sigma) - ndtr((-HALF - offset) / sigma)
    return np.asarray(area * sigma * math.sqrt(2.0 * math.pi))


def ambient_electrons(look: Look, lit: Lit, pixels: Float) -> Float:
    """(n,) electrons of environment and lamps at the points of the line, as if nothing threw shadows."""
    scene, sensor = look.scene, look.project.sensor
    response = joules_per_radiance(scene.camera, sensor) * band_response(sensor)
    electrons = np.einsum("ij,ij->i", _by_pixel(response, pixels), lit.unshadowed)
    return np.asarray(electrons * _cos4(scene.camera, lit))


def read_variance(sensor: Sensor) -> float:
    """Read noise, uneven offsets and quantisation, e-^2."""
    return sensor.read_noise**2 + sensor.dsnu**2 + 1.0 / (12.0 * sensor.dn_per_electron**2)


def detection_response(amplitude: Float, sigma: Float, background: Float, variance: float) -> Float:
    """(n,) response of the detection's matched filter to a Gaussian line over that filter's noise beside it.

    Peak and background e-, sigma px, read variance e-^2.
    """
    wide = np.sqrt(sigma**2 + 1.0 / 12.0 + FILTER_SIGMA**2)
    return np.asarray(amplitude * sigma / wide / np.sqrt(NOISE_GAIN * (background + variance)))


def centre_bound_px(amplitude: Float, sigma: Float, background: Float, variance: float) -> Float:
    """(n,) Cramer-Rao bound of a Gaussian line's centre, px: peak and background e-, sigma px, read variance e-^2.

    sigma_c^2 = s_t^2 / (N I(tau)), N = A s sqrt(2 pi), s_t^2 = s^2 + 1/12, tau = (r^2 + b) sqrt(2 pi) s_t / N, with
    I(tau) the integral of z^2 phi(z) / (1 + tau exp(z^2 / 2)); at most 2 % low where s >= 0.4 px (after Winick 1986).
    """
    photons = np.maximum(amplitude * sigma * math.sqrt(2.0 * math.pi), 1e-12)
    wide = np.sqrt(sigma**2 + 1.0 / 12.0)
    tau = (variance + background) * math.sqrt(2.0 * math.pi) * wide / photons
    knots, values = _information()
    return np.asarray(wide / np.sqrt(photons * np.exp(np.interp(np.log(tau + 1e-30), knots, values))))


@lru_cache(maxsize=1)
def _information() -> tuple[Float, Float]:
    """log I over log tau."""
    z = np.linspace(-9.0, 9.0, 721)
    weight = z**2 * np.exp(-(z**2) / 2.0) / math.sqrt(2.0 * math.pi) * (z[1] - z[0])
    knots = np.linspace(-14.0, 18.0, 321)
    return knots, np.log([np.sum(weight / (1.0 + math.exp(t) * np.exp(z**2 / 2.0))) for t in knots])


def blur_px(camera: Camera, points: Float) -> Float:
    """(n,) diameter, px, of the blur disc of (n, 3) points, camera frame: D fx |w - 1/z|.

    w is that of `render.camera.lens`.
    """
    plane = camera.focus_plane
    return np.asarray(dioptre_px(camera) * np.abs(points @ plane[:3] + plane[3]) / points[:, 2])


def blurred(width: Float, amplitude: Float, disc: Float) -> tuple[Float, Float]:
    """(n,) sigma, px, and peak of a Gaussian line, and diameter of the disc that it is spread by, px -> both of what
    an image has: the variance of a disc along one axis is d^2 / 16, and its mean of a Gaussian at the centre
    exp(-z) (I0(z) + I1(z)), z = (d / 4 sigma)^2.
    """
    from scipy.special import ive

    z = (0.25 * disc / width) ** 2
    return np.hypot(width, 0.25 * disc), np.asarray(amplitude * (ive(0, z) + ive(1, z)))


def depth_of_field(camera: Camera, sharp_px: float = SHARP_PX) -> tuple[float, float]:
    """Nearest and farthest depth on the axis at which the blur disc is at most `sharp_px` across; inf: no end."""
    reach, focus = sharp_px / dioptre_px(camera), camera.focus_vergence
    return 1.0 / (focus + reach), 1.0 / (focus - reach) if focus > reach else math.inf


def dioptre_px(camera: Camera) -> float:
    """Blur in px for one dioptre: aperture times image distance over pitch."""
    return 2.0 * camera.aperture_radius * camera.fx


def _by_pixel(response: Float, pixels: Float) -> Float:
    """(2, 2, ...) by parity of row and column -> (n, ...) at the nearest pixels."""
    nearest = np.round(pixels).astype(np.int64) & 1
    return np.asarray(response[nearest[:, 1], nearest[:, 0]])


def _cos4(camera: Camera, lit: Lit) -> Float:
    if not camera.lens.vignetting:
        return np.ones(len(lit.curve.index))
    return np.asarray((lit.curve.depth_z / lit.curve.depth_range) ** 4)
