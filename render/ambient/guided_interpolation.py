"""An image from a grid of its pixels, guided by what the camera sees at each: albedo, normal, place and object.

Light varies slowly over a surface, what reflects it need not: the grid's radiance over its albedo is smoothed,
interpolated, and multiplied by the albedo of each pixel. Points of the grid count little where the object is another or
where they do not lie in the pixel's tangent plane, as in a joint bilateral filter (Kopf et al. 2007, Joint bilateral
upsampling).

What is seen, (n, SEEN): albedo in R, G, B, unit normal towards the camera, and the point, m from the scene's centre.
"""

from __future__ import annotations

import numba
import numpy as np

from render.ambient.light_sampling import Lights, light_in_view
from render.base.arrays import Float, Float32, Int
from render.camera.rays import camera_rays
from render.camera.view import View
from render.world.embree import RayScene
from render.world.triangles import Surface, plane_of, scattering

SEEN = 9
NOTHING, NO_RAY, FIRST_LAMP = -1, -2, -3
"""In place of an object: the surroundings; a pixel that the lens sends no ray through; the first lamp, others below."""
ON_EDGE = -(1 << 30)
"""In place of the object at a point of a grid that several share."""
DARK = 1e-3
"""Added to the albedo, so that what is black and shines does not divide by nothing."""
BENT, STEP = 0.05, 0.05
"""1 - cosine between two normals, and squared sine of a point's elevation over the tangent plane, that halve a weight.
"""
LEAST_WEIGHT = 1e-6
"""Of a point that fits badly: it decides only where none fits better."""


def seen_at(pixels: Int, view: View, surface: Surface, lights: Lights, rays: RayScene) -> tuple[Float32, Int]:
    """What rays through the centres of the pixels (n,) meet first: (n, SEEN), and (n,) the object."""
    n, eye = len(pixels), view.T_world_camera[:3, 3]
    normalised, offsets, directions = np.empty((n, 2)), np.empty((n, 2), np.float32), np.empty((n, 3), np.float32)
    camera_rays(view, pixels, 1, 0, False, normalised, offsets, directions)
    triangle = rays.from_point(eye, directions)
    seen, item = np.zeros((n, SEEN), np.float32), np.empty(n, np.int32)
    fill_seen(surface, lights, eye, rays.centre, directions, triangle, seen, item)
    return seen, item


@numba.njit(nogil=True, cache=True, error_model="numpy")
def fill_seen(
    surface: Surface,
    lights: Lights,
    eye: Float,
    centre: Float,
    directions: Float32,
    triangle: Int,
    seen: Float32,
    item: Int,
) -> None:
    """The first hits of rays from the eye -> seen (n, SEEN), where no object is met white without a place, and item."""
    rgb = np.empty(3)
    for r in range(triangle.shape[0]):
        d0, d1, d2 = float(directions[r, 0]), float(directions[r, 1]), float(directions[r, 2])
        t, distance = triangle[r], np.inf
        for band in range(3):
            seen[r, band] = 1.0
        if d0 == 0.0 and d1 == 0.0 and d2 == 0.0:
            item[r] = NO_RAY
            continue
        n0 = n1 = n2 = 0.0
        if t >= 0:
            a0, a1, a2, n0, n1, n2 = plane_of(surface, t)
            cosine = n0 * d0 + n1 * d1 + n2 * d2
            distance = (n0 * (a0 - eye[0]) + n1 * (a1 - eye[1]) + n2 * (a2 - eye[2])) / cosine
            if cosine > 0.0:
                n0, n1, n2 = -n0, -n1, -n2
        if lights.rectangles > 0:
            k = light_in_view(lights.rows, (eye[0], eye[1], eye[2]), (d0, d1, d2), distance)
            if k >= 0:
                item[r] = FIRST_LAMP - k
                continue
        if t < 0:
            item[r] = NOTHING
            continue
        p0, p1, p2 = eye[0] + distance * d0, eye[1] + distance * d1, eye[2] + distance * d2
        scattering(surface, t, p0, p1, p2, 0.5, rgb)
        item[r] = surface.object_id[t]
        for band in range(3):
            seen[r, band] = rgb[band]
        seen[r, 3], seen[r, 4], seen[r, 5] = n0, n1, n2
        seen[r, 6], seen[r, 7], seen[r, 8] = p0 - centre[0], p1 - centre[1], p2 - centre[2]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def likeness(seen: Float32, r: int, item: int, other_seen: Float32, q: int, other_item: int) -> float:
    """Weight, at most 1, with which the light at the point q of a grid speaks for the pixel r."""
    if item != other_item:
        return LEAST_WEIGHT
    if item < 0:
        return 1.0
    n0, n1, n2 = seen[r, 3], seen[r, 4], seen[r, 5]
    bent = 1.0 - (n0 * other_seen[q, 3] + n1 * other_seen[q, 4] + n2 * other_seen[q, 5])
    x, y, z = other_seen[q, 6] - seen[r, 6], other_seen[q, 7] - seen[r, 7], other_seen[q, 8] - seen[r, 8]
    above = n0 * x + n1 * y + n2 * z
    step = above * above / max(x * x + y * y + z * z, 1e-30)
    bent, step = bent / BENT, step / STEP
    return max(1.0 / ((1.0 + bent * bent) * (1.0 + step * step)), LEAST_WEIGHT)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def smooth_grid(across: int, seen: Float32, item: Int, radiance: Float32, light: Float32) -> None:
    """Radiance (n, c) of a grid, so many points across -> light (n, c): over albedo, both averaged over neighbours.

    c: a multiple of 3, R, G, B by turns. Dark points, of which noise would be divided by little, so count for little.
    """
    down = item.shape[0] // across
    total, albedo = np.empty(radiance.shape[1]), np.empty(3)
    for r in range(item.shape[0]):
        row, column = r // across, r % across
        total[:], albedo[:] = 0.0, 0.0
        for i in range(max(row - 1, 0), min(row + 2, down)):
            for j in range(max(column - 1, 0), min(column + 2, across)):
                q = i * across + j
                w = (1.0 if i == row else 0.5) * (1.0 if j == column else 0.5)
                w *= likeness(seen, r, item[r], seen, q, item[q])
                for band in range(3):
                    albedo[band] += w * (seen[q, band] + DARK)
                for c in range(total.shape[0]):
                    total[c] += w * radiance[q, c]
        for c in range(total.shape[0]):
            light[r, c] = total[c] / albedo[c % 3]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def predict_by_neighbours(across: int, seen: Float32, item: Int, radiance: Float32, out: Float32) -> None:
    """Radiance (n, 3) of a grid, so many points across -> out (n, 3): of each point as the four about it have it."""
    down = item.shape[0] // across
    for r in range(item.shape[0]):
        row, column = r // across, r % across
        out[r], weight = 0.0, 0.0
        for side in range(4):
            i, j = row + (side == 0) - (side == 1), column + (side == 2) - (side == 3)
            if i < 0 or i >= down or j < 0 or j >= across:
                continue
            q = i * across + j
            w = likeness(seen, r, item[r], seen, q, item[q])
            weight += w
            for band in range(3):
                out[r, band] += w * radiance[q, band] / (seen[q, band] + DARK)
        for band in range(3):
            out[r, band] *= (seen[r, band] + DARK) / max(weight, 1e-30)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def interpolate(
    places: Float,
    shape: tuple[int, int],
    block: int,
    seen: Float32,
    item: Int,
    grid: tuple[Float32, Int, Float32],
    out: Float32,
    fit: Float32,
) -> None:
    """Rows and columns (n, 2) of an image of shape (h, w) -> out (n, c) radiance, c as in `smooth_grid`, and fit (n,):
    at most 1, how well what is seen there speaks for the place.

    What is beyond the image is as at its edge. seen, item: of the places; grid: the same of its points, which are
    `block` pixels apart, and their light.
    """
    (height, width), (grid_seen, grid_item, light) = shape, grid
    across = (width - 2) // block + 2
    down = grid_item.shape[0] // across
    total = np.empty(light.shape[1])
    for r in range(places.shape[0]):
        row, column = min(max(places[r, 0], 0.0), height - 1.0), min(max(places[r, 1], 0.0), width - 1.0)
        i, j = min(int(row) // block, max(down - 2, 0)), min(int(column) // block, max(across - 2, 0))
        # the last row and column of the grid are those of the image
        below, right = min((i + 1) * block, height - 1) - i * block, min((j + 1) * block, width - 1) - j * block
        v = (row - i * block) / below if below > 0 else 0.0
        u = (column - j * block) / right if right > 0 else 0.0
        total[:], weight = 0.0, 0.0
        for corner in range(4):
            w = (v if corner & 2 else 1.0 - v) * (u if corner & 1 else 1.0 - u)
            if w == 0.0:
                continue
            q = (i + (corner >> 1)) * across + j + (corner & 1)
            w *= likeness(seen, r, item[r], grid_seen, q, grid_item[q])
            weight += w
            for c in range(total.shape[0]):
                total[c] += w * light[q, c]
        fit[r] = weight
        for c in range(total.shape[0]):
            out[r, c] = total[c] / weight * (seen[r, c % 3] + DARK) if item[r] != NO_RAY else 0.0


def grid_of(width: int, height: int, block: int) -> tuple[Int, int]:
    """Pixels of a grid, `block` pixels from point to point, the last ones on the image's edge; and how many across."""
    columns = np.minimum(np.arange((width - 2) // block + 2) * block, width - 1)
    rows = np.minimum(np.arange((height - 2) // block + 2) * block, height - 1)
    pixels = rows[:, None] * width + columns
    return pixels.ravel().astype(np.int32), len(columns)
