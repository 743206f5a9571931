"""Camera paths over mirrors and clear glass, divided where glass reflects and refracts: nothing random picks a way."""

from __future__ import annotations

from collections.abc import Iterator

import numba
import numpy as np

from render.base.arrays import Float, Long
from render.base.borrowed import borrowed
from render.base.vectors import store_row, vector
from render.camera.distortion import tilt_matrix
from render.camera.view import View
from render.laser_indirect.bdpt_pass import BdptPass, begun_paths
from render.laser_indirect.connections import path_lens_point
from render.laser_indirect.path_vertex import (
    MOST_FACETS,
    PassContext,
    Records,
    cosine_to,
    from_shading,
    is_specular,
    remember,
)
from render.laser_indirect.pixel_rays import set_pixel_ray
from render.material.bsdf import sample
from render.material.fresnel import fresnel_dielectric
from render.material.record import ALPHA_X, ALPHA_Y, BSDF_COLUMNS, DIELECTRIC, INDEX, KIND
from render.sampling.random import uniform
from render.world.triangles import off_surface

SEED = 0x2545F491
"""Of what is random all the same: rays anywhere in a part of a pixel, points of a lens, materials that are blended."""
LEAST_SHARE = 1e-5
"""Of a camera path's weight, below which it is not followed. Chosen, not tuned."""


def camera_tree(task: BdptPass, pixels: Long, cells: int, jitter: bool) -> Iterator[tuple[Records, Records]]:
    """Vertices and paths, one surface after the other, of paths through each of cells x cells parts of pixels (n,).

    The paths belong to pixels 0 .. n.
    """
    context, count = task.context(SEED), len(pixels) * cells**2
    origin, direction, paths = np.empty((count, 3)), np.empty((count, 3)), begun_paths(count, task.interiors[1])
    cell_rays(task.view, pixels, cells, jitter, SEED, origin, direction, paths)
    for depth in range(MOST_FACETS + 1):
        vertices, paths = task.intersect(context, depth, origin, direction, paths)
        if not len(vertices):
            return
        yield vertices, paths
        origin, direction = np.empty((2 * len(vertices), 3)), np.empty((2 * len(vertices), 3))
        divided = np.empty(2 * len(vertices), paths.dtype)
        n = divide(vertices, paths, context, LEAST_SHARE / cells**2, origin, direction, divided)
        origin, direction, paths = origin[:n], direction[:n], divided[:n]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def cell_rays(
    view: View,
    pixels: Long,
    cells: int,
    jitter: bool,
    seed: int,
    origin: Float,
    direction: Float,
    paths: Records,
) -> None:
    """Camera paths of pixels (n,), one through each of cells x cells parts of a pixel; they belong to pixels 0 .. n.

    Through the parts' middles, or anywhere in them.
    """
    tilt = tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    r = 0
    for n in range(pixels.shape[0]):
        pixel = pixels[n]
        column, row = pixel % view.width, pixel // view.width
        for part in range(cells * cells):
            index = np.int64(pixel) * cells * cells + part
            x, y = 0.5, 0.5
            if jitter:
                x, y = uniform(seed, index, 0, 90), uniform(seed, index, 0, 91)
            u, v = column - 0.5 + (part % cells + x) / cells, row - 0.5 + (part // cells + y) / cells
            a, b = path_lens_point(view, seed, index)
            set_pixel_ray(view, tilt, distorted, u, v, a, b, r, origin, direction)
            path = paths[r]
            path.throughput, path.index, path.pixel = 1.0 / (cells * cells), index, n
            r += 1


@numba.njit(nogil=True, cache=True, error_model="numpy")
def divide(
    vertices: Records,
    paths: Records,
    context: PassContext,
    least: float,
    origin: Float,
    direction: Float,
    divided: Records,
) -> int:
    """Reflect and refract camera paths (n,) that have met a mirror or clear glass -> divided (2 n,) and their rays.

    Returns how many go on, those of a weight of `least` and more. Radiance changes with the square of the refractive
    index, as in `path_vertex.scatter`.
    """
    vertices, paths, context, divided = borrowed(vertices), borrowed(paths), borrowed(context), borrowed(divided)
    row, f = np.empty(BSDF_COLUMNS), np.empty(1)
    going = 0
    for r in range(vertices.shape[0]):
        v, path = vertices[r], paths[r]
        if path.count == MOST_FACETS or not is_specular(v, context.rows):
            continue
        for c in range(BSDF_COLUMNS):
            row[c] = context.rows[v.material, c]
        row[ALPHA_X], row[ALPHA_Y], row[INDEX] = v.alpha[0], v.alpha[1], v.index
        wo = vector(v.wo)
        glass = row[KIND] == DIELECTRIC
        reflected, _ = (
            fresnel_dielectric(abs(wo[2]), v.index if wo[2] > 0.0 else 1.0 / v.index) if glass else (1.0, 0.0)
        )
        for crosses in range(2):
            probability = 1.0 - reflected if crosses else reflected
            if not probability > 0.0:
                continue
            numbers = 1.0 - 1e-12 if crosses else 0.0, 0.5, 0.5
            wi, pdf = sample(row, (v.reflectance, v.reflectance, v.reflectance), wo, numbers, f)
            d = from_shading(v, wi)
            cosine = cosine_to(v, d)
            if pdf == 0.0 or cosine * wi[2] <= 0.0:
                continue
            throughput = path.throughput * f[0] * probability
            if crosses:
                throughput *= row[INDEX] * row[INDEX] if wo[2] < 0.0 else 1.0 / (row[INDEX] * row[INDEX])
            if throughput < least:
                continue
            side = context.ray_epsilon if cosine > 0.0 else -context.ray_epsilon
            store_row(origin, going, off_surface(vector(v.p), vector(v.n), side))
            store_row(direction, going, d)
            divided[going] = paths[r]
            after = divided[going]
            after.throughput, after.after_specular = throughput, True
            remember(after, True, crosses == 1)
            going += 1
    return going
