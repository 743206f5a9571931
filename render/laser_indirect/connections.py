"""Connecting paths: a light vertex to the camera, a camera vertex to the laser; `ris` connects the two to each other.

A path over k surfaces can be made by k + 1 techniques, one for each of its edges that a connection can lie on. Each
technique's contribution has its MIS weight by the balance heuristic (Veach 1997, eq. 9.8), in the recursive form of
Georgiev et al. 2012 (dVCM, dVC), with the sample counts

    light_paths                               for the connection to the camera (light tracing),
    camera_paths[pixel] RIS_SAMPLE_WEIGHT     for one between two surfaces,
    camera_paths[pixel]                       for the one to the laser.

camera_paths is the expected number of a pixel's camera paths in a pass, a fraction where not every pass has one; a
pixel without any is left to light tracing, with weight 1. Light that met one surface only belongs to
`render.laser_direct.integrator`. Every connection goes into `Connections` and counts if its shadow ray is free.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Bool, Float, Float32
from render.base.borrowed import borrowed
from render.base.vectors import Vector, divided, length, minus, rotated, transformed, vector
from render.camera.distortion import tilt_matrix
from render.camera.lens import lens_point, lens_position, lens_project
from render.camera.view import View
from render.laser.irradiance import irradiance
from render.laser_indirect.connection_buffer import BLOCK, RIS_SAMPLE_WEIGHT, Connections, PassBuffer, set_shadow_ray
from render.laser_indirect.path_vertex import (
    PassContext,
    Record,
    Records,
    bsdf_pdf,
    cosine_to,
    eval_bsdf,
    interior_beyond,
    is_specular,
    shading_normal_factor,
    to_shading,
)
from render.laser_indirect.photon_emission import FanDistribution, emitted_density
from render.sampling.random import uniform


class CameraSampling(NamedTuple):
    """How often a pass tries what leads to the camera."""

    camera: View
    height: int
    camera_paths: Float32
    """(pixels,) expected camera paths of a pass."""
    light_paths: int
    clear: Bool
    """(pixels,) where light over listed chains is integrated; (0,): nowhere."""


class LaserSampling(NamedTuple):
    """The laser's light, and how a pass draws photons of it."""

    T_world_laser: Float
    T_laser_world: Float
    beam: Float
    """`LineLaser.packed`."""
    fan: FanDistribution


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def is_clear_light(path: Record, sampling: CameraSampling, pixel: int) -> bool:
    """What a light path brings to a pixel, over nothing more than mirrors and clear glass, is integrated there
    (`render.laser_indirect.clear_light`)."""
    return path.walked and sampling.clear.shape[0] > 0 and sampling.clear[pixel]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def connect_to_camera(
    vertices: Records,
    paths: Records,
    context: PassContext,
    sampling: CameraSampling,
    depth: int,
    connections: Connections,
) -> int:
    """Connect light vertices (n,) to the camera -> connections, to be divided by the light paths; their number."""
    vertices, paths, context, sampling = borrowed(vertices), borrowed(paths), borrowed(context), borrowed(sampling)
    connections = borrowed(connections)
    view, rows = sampling.camera, context.rows
    tilt = tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    a = b = 0.0
    n = 0
    for r in range(vertices.shape[0]):
        v, path = vertices[r], paths[r]
        if is_specular(v, rows):
            continue
        if view.lens[0] > 0.0:
            r1, r2 = uniform(context.seed, path.index, depth, 8), uniform(context.seed, path.index, depth, 9)
            a, b = lens_point(view.lens[0], r1, r2)
        pixel, area = pixel_of(view, tilt, distorted, sampling.height, v, a, b)
        if pixel < 0 or is_clear_light(path, sampling, pixel):
            continue
        direction, distance = towards(v, lens_position(view, a, b))
        cosine, wi, wo = cosine_to(v, direction), to_shading(v, direction), vector(v.wo)
        f = 0.0 if cosine * wi[2] <= 0.0 else eval_bsdf(v, rows, wo, wi)
        if f <= 0.0:
            continue
        camera_pdf = area * abs(cosine)
        mis_weight = 1.0
        reachable = path.dvcm > 0.0 or path.dvc > 0.0
        if sampling.camera_paths[pixel] > 0.0 and reachable:
            reverse_pdf = bsdf_pdf(v, rows, wi, wo)
            others = camera_pdf * (path.dvcm + reverse_pdf * path.dvc)
            mis_weight = 1.0 / (1.0 + RIS_SAMPLE_WEIGHT * sampling.camera_paths[pixel] / sampling.light_paths * others)
        connections.pixel[n], connections.kind[n], connections.fan_bin[n] = pixel, path.kind, path.fan_bin
        connections.reachable_from_camera[n] = reachable
        connections.contribution[n] = path.throughput * f * camera_pdf * mis_weight * shading_normal_factor(v)
        set_shadow_ray(connections, n, v, direction, distance, context)
        connections.interior[n] = interior_beyond(v, path, rows, wi[2])
        n += 1
    return n


@numba.njit(nogil=True, cache=True, error_model="numpy")
def connect_to_laser(
    vertices: Records, paths: Records, context: PassContext, laser: LaserSampling, connections: Connections
) -> int:
    """Connect camera vertices (n,) to the laser -> connections. Returns their number."""
    vertices, paths, context, laser = borrowed(vertices), borrowed(paths), borrowed(context), borrowed(laser)
    connections = borrowed(connections)
    m, rows = laser.T_laser_world, context.rows
    position = (
        -(m[0, 0] * m[0, 3] + m[1, 0] * m[1, 3] + m[2, 0] * m[2, 3]),
        -(m[0, 1] * m[0, 3] + m[1, 1] * m[1, 3] + m[2, 1] * m[2, 3]),
        -(m[0, 2] * m[0, 3] + m[1, 2] * m[1, 3] + m[2, 2] * m[2, 3]),
    )
    n = 0
    for r in range(vertices.shape[0]):
        v, path = vertices[r], paths[r]
        light, photon_pdf = laser_irradiance(v, laser)
        if light <= 0.0:
            continue
        if is_specular(v, rows):
            continue
        direction, distance = towards(v, position)
        cosine, wi, wo = cosine_to(v, direction), to_shading(v, direction), vector(v.wo)
        f = 0.0 if cosine * wi[2] <= 0.0 else eval_bsdf(v, rows, wi, wo)
        if f <= 0.0:
            continue
        others = photon_pdf * (path.dvcm + bsdf_pdf(v, rows, wi, wo) * path.dvc)
        mis_divisor = 1.0 + RIS_SAMPLE_WEIGHT * others
        connections.pixel[n], connections.kind[n], connections.fan_bin[n] = path.pixel, path.kind, -1
        connections.reachable_from_camera[n] = True
        connections.contribution[n] = path.throughput * f * light * abs(wi[2] / cosine) / mis_divisor
        set_shadow_ray(connections, n, v, direction, distance, context)
        connections.interior[n] = interior_beyond(v, path, rows, wi[2])
        n += 1
    return n


@numba.njit(nogil=True, cache=True, error_model="numpy")
def init_light_mis(vertices: Records, paths: Records, laser: LaserSampling) -> None:
    """The partial MIS sums of light paths at the first surface that they meet."""
    vertices, paths, laser = borrowed(vertices), borrowed(paths), borrowed(laser)
    for r in range(vertices.shape[0]):
        _, photon_pdf = laser_irradiance(vertices[r], laser)
        path = paths[r]
        path.dvcm = 1.0 / (RIS_SAMPLE_WEIGHT * photon_pdf) if photon_pdf > 0.0 else 0.0
        path.dvc = 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def init_camera_mis(vertices: Records, paths: Records, sampling: CameraSampling, seed: int) -> None:
    """The partial MIS sums of camera paths at the first surface that they meet."""
    vertices, paths, sampling = borrowed(vertices), borrowed(paths), borrowed(sampling)
    view = sampling.camera
    tilt = tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    for r in range(vertices.shape[0]):
        v, path = vertices[r], paths[r]
        a, b = path_lens_point(view, seed, path.index)
        _, _, area = lens_project(view, tilt, distorted, v.p[0], v.p[1], v.p[2], a, b)
        to_lens = minus(lens_position(view, a, b), vector(v.p))
        camera_pdf = area * abs(cosine_to(v, to_lens)) / length(to_lens)
        connection_samples = RIS_SAMPLE_WEIGHT * sampling.camera_paths[path.pixel]
        path.dvcm = sampling.light_paths / (connection_samples * camera_pdf) if camera_pdf > 0.0 else 0.0
        path.dvc = 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def mark_reachable(
    vertices: Records, paths: Records, sampling: CameraSampling, specular: Bool, buffer: PassBuffer
) -> None:
    """Add to `buffer.camera_radiance` roughly what light vertices look like behind clear glass, as if it bent nothing.

    specular (pixels,): where the camera sees a mirror or clear glass. It only says where camera paths are worthwhile.
    """
    vertices, paths, sampling = borrowed(vertices), borrowed(paths), borrowed(sampling)
    specular, buffer = borrowed(specular), borrowed(buffer)
    view = sampling.camera
    tilt = tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    for r in range(vertices.shape[0]):
        v = vertices[r]
        pixel, area = pixel_of(view, tilt, distorted, sampling.height, v, 0.0, 0.0)
        if pixel < 0:
            continue
        if specular[pixel]:
            buffer.touched[pixel // BLOCK] = True
            buffer.camera_radiance[pixel] += (
                paths[r].throughput * v.reflectance * area / (math.pi * sampling.light_paths)
            )


@numba.njit(nogil=True, cache=True, error_model="numpy")
def connectable(vertices: Records, paths: Records, rows: Float) -> tuple[Records, Records]:
    """Copies of the vertices (n,) and paths that connections can be made of: all but the specular ones."""
    kept_vertices, kept_paths = np.empty_like(vertices), np.empty_like(paths)
    n = 0
    for r in range(vertices.shape[0]):
        if not is_specular(vertices[r], rows):
            kept_vertices[n], kept_paths[n] = vertices[r], paths[r]
            n += 1
    return kept_vertices[:n], kept_paths[:n]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def towards(v: Record, point: Vector) -> tuple[Vector, float]:
    """Unit direction from a vertex to a point, and its distance, m."""
    to = minus(point, vector(v.p))
    distance = length(to)
    return divided(to, distance), distance


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pixel_of(view: View, tilt: Float, distorted: bool, height: int, v: Record, a: float, b: float) -> tuple[int, float]:
    """The pixel that sees a vertex through lens point (a, b), -1 if none, and `lens_project`'s area."""
    x, y, area = lens_project(view, tilt, distorted, v.p[0], v.p[1], v.p[2], a, b)
    if not (area > 0.0 and -0.5 <= x < view.width - 0.5 and -0.5 <= y < height - 0.5):
        return -1, 0.0
    return int(math.floor(y + 0.5)) * view.width + int(math.floor(x + 0.5)), area


@numba.njit(nogil=True, cache=True, error_model="numpy")
def laser_irradiance(v: Record, laser: LaserSampling) -> tuple[float, float]:
    """Irradiance (W/m^2, on the geometric normal) of a vertex by the laser, and the pdf (1/m^2) of photons there."""
    m = laser.T_laser_world
    (x, y, z), (nx, ny, nz) = transformed(m, vector(v.p)), rotated(m, vector(v.n))
    value = irradiance(x, y, z, nx, ny, nz, laser.beam)
    return value, value / laser.beam[0] * emitted_density(y / z, laser.fan, laser.beam) if value > 0.0 else 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def path_lens_point(view: View, seed: int, index: int) -> tuple[float, float]:
    """(a, b) on the aperture through which camera path `index` goes."""
    if view.lens[0] == 0.0:
        return 0.0, 0.0
    return lens_point(view.lens[0], uniform(seed, index, 0, 94), uniform(seed, index, 0, 95))
