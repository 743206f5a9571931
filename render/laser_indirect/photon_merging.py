"""Photon merging, for what neither connection nor walk can bring: light through glass or off mirrors on both sides.

The light arrives at its one rough surface between by a direction that only scattering can give, and leaves by another,
so a camera path that ends within a small radius of where a light path ended is taken to be connected to it (progressive
photon mapping, Hachisuka and Jensen 2009; one radius a pass, Knaus and Zwicker 2011). It blurs by that radius, about a
pixel at first, ever less with the passes; all other light is connected without bias.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Bool, Float, Long
from render.base.borrowed import borrowed
from render.base.vectors import dot, minus, vector
from render.laser_indirect.connection_buffer import BLOCK, PassBuffer
from render.laser_indirect.path_vertex import (
    SPECULAR_CHAIN,
    Record,
    Records,
    cosine_to,
    eval_bsdf,
    is_specular,
    shading_normal_factor,
)

RADIUS_EXPONENT = 1.0 / 6.0
"""The radius falls as n^-(1/6) with the passes (Knaus and Zwicker 2011, alpha = 2/3)."""
LEAST_COSINE = 0.7
"""Between the normals of a photon and of the surface it is merged on: none is taken from around a corner. Chosen, not
tuned."""


class PhotonMap(NamedTuple):
    """(n,) photons in the order of their cells: vertices, power, `walked` of PATH, bin of the fan; the cells' origin
    and size, m."""

    vertices: Records
    power: Float
    walked: Bool
    fan_bin: Long
    cell: Long
    corner: Float
    size: float
    light_paths: int


def photon_map(vertices: Records, paths: Records, radius: float, light_paths: int) -> PhotonMap:
    """Sort light vertices that only merging can use into cells of twice the radius."""
    alone = np.flatnonzero(paths["all_specular"] & paths["after_specular"])
    points = vertices["p"][alone]
    corner = points.min(axis=0) - 2.0 * radius if len(alone) else np.zeros(3)
    size = 2.0 * radius
    place = np.floor((points - corner) / size).astype(np.int64)
    cell = (place[:, 0] << 42) | (place[:, 1] << 21) | place[:, 2]
    order = np.argsort(cell, kind="stable")
    sorted_alone = alone[order]
    power, fan_bin = paths["throughput"][sorted_alone], paths["fan_bin"][sorted_alone].astype(np.int64)
    return PhotonMap(
        vertices.take(sorted_alone),
        power,
        paths["walked"][sorted_alone],
        fan_bin,
        cell[order],
        corner,
        size,
        light_paths,
    )


@numba.njit(nogil=True, cache=True, error_model="numpy")
def merge(vertices: Records, paths: Records, rows: Float, photons: PhotonMap, clear: Bool, buffer: PassBuffer) -> None:
    """Splat what the photons about each camera vertex bring; clear: of `CameraSampling`."""
    vertices, paths, rows, photons = borrowed(vertices), borrowed(paths), borrowed(rows), borrowed(photons)
    buffer = borrowed(buffer)
    radius = 0.5 * photons.size
    kernel = 1.0 / (math.pi * radius * radius * photons.light_paths)
    for r in range(vertices.shape[0]):
        v, path = vertices[r], paths[r]
        if not path.all_specular or not path.after_specular or path.walked:
            continue
        if is_specular(v, rows):
            continue
        integrated = path.count >= 0 and clear.shape[0] > 0 and clear[path.pixel]
        contribution = path.throughput * gather_photons(v, path, rows, photons, integrated, kernel, buffer) * kernel
        if not 0.0 <= contribution < math.inf:
            buffer.invalid[0] += 1.0
        elif contribution > 0.0:
            buffer.image[path.pixel] += contribution
            buffer.camera_radiance[path.pixel] += contribution
            buffer.touched[path.pixel // BLOCK] = True
            buffer.sums[SPECULAR_CHAIN] += contribution


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def gather_photons(
    v: Record, path: Record, rows: Float, photons: PhotonMap, integrated: bool, kernel: float, buffer: PassBuffer
) -> float:
    """Sum of power times BSDF of the photons within the radius of v; their moments go to the fan's bins.

    integrated: what comes over listed chains is known here.
    """
    radius, total = 0.5 * photons.size, 0.0
    # the two cells along each axis that the sphere can reach
    a = [int(math.floor((v.p[axis] - photons.corner[axis]) / photons.size - 0.5)) for axis in range(3)]
    for corner in range(8):
        x, y, z = a[0] + (corner & 1), a[1] + ((corner >> 1) & 1), a[2] + (corner >> 2)
        if x < 0 or y < 0 or z < 0 or x >= 1 << 20 or y >= 1 << 20 or z >= 1 << 20:
            continue
        key = (np.int64(x) << 42) | (np.int64(y) << 21) | np.int64(z)
        j = np.searchsorted(photons.cell, key)
        while j < photons.cell.shape[0] and photons.cell[j] == key:
            w = photons.vertices[j]
            apart = minus(vector(w.p), vector(v.p))
            near = dot(apart, apart) < radius * radius
            elsewhere = integrated and photons.walked[j]
            if near and not elsewhere and cosine_to(v, vector(w.n)) > LEAST_COSINE:
                f = eval_bsdf(v, rows, vector(w.wo), vector(v.wo)) * shading_normal_factor(w)
                value = photons.power[j] * f
                if 0.0 <= value < math.inf:
                    total += value
                    buffer.fan_moments[photons.fan_bin[j]] += (path.throughput * value * kernel) ** 2
                else:
                    buffer.invalid[0] += 1.0
            j += 1
    return total
