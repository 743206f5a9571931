"""Conservative rasterisation of a laser's sheet: the pixels that may see its direct light.

Triangles are clipped to the slab, which is the sheet out to `SHEET_SIGMAS` within the fan, and their outlines are drawn
conservatively. Triangles that do not face both camera and laser are culled; occlusion is ignored, so the set is a
superset. A thin lens widens each outline by its blur disc.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Int
from render.base.pose import invert
from render.base.threads import map_chunks
from render.camera.camera import Camera
from render.camera.distortion import distort, tilt_matrix
from render.camera.lens import chief_ray
from render.camera.projection import project_point
from render.camera.view import View
from render.laser.irradiance import SHEET_SIGMAS, sheet_sigma
from render.laser.laser import LineLaser
from render.world.triangles import Surface
from render.world.world import World

TRIANGLES_A_CHUNK = 1 << 15
MARGIN_PX = 1
"""Pixels by which an outline is widened."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _clip(polygon: Float, count: int, plane: Float, out: Float) -> int:
    """Sutherland-Hodgman: keep the part of polygon (count, 3) where plane . (p, 1) >= 0."""
    kept = 0
    for i in range(count):
        j = (i + 1) % count
        fi = plane[0] * polygon[i, 0] + plane[1] * polygon[i, 1] + plane[2] * polygon[i, 2] + plane[3]
        fj = plane[0] * polygon[j, 0] + plane[1] * polygon[j, 1] + plane[2] * polygon[j, 2] + plane[3]
        if fi >= 0.0:
            out[kept] = polygon[i]
            kept += 1
        if (fi >= 0.0) != (fj >= 0.0):
            t = fi / (fi - fj)
            for axis in range(3):
                out[kept, axis] = polygon[i, axis] + t * (polygon[j, axis] - polygon[i, axis])
            kept += 1
    return kept


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _slab(planes: Float, T_camera_laser: Float, tangent: float, slope: float, offset: float) -> None:
    """Half spaces (6, 4) in laser coordinates: |x| <= slope z + offset, within the fan, in front of both devices."""
    planes[:] = 0.0
    planes[0, 0], planes[1, 0] = -1.0, 1.0
    planes[0, 2] = planes[1, 2] = slope
    planes[0, 3] = planes[1, 3] = offset
    planes[2, 1], planes[3, 1] = -1.0, 1.0
    planes[2, 2] = planes[3, 2] = tangent
    planes[4, 2], planes[4, 3] = 1.0, -1e-9
    planes[5] = T_camera_laser[2]
    planes[5, 3] -= 1e-6


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _faces_both(corners: Float, camera: Float, aperture: float) -> bool:
    """Camera and laser are on the same side of a triangle, all (.., 3) in laser coordinates.

    aperture: its radius, m; some point of it being on the laser's side is enough.
    """
    a, b, c = corners[0], corners[1], corners[2]
    n0 = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
    n1 = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
    n2 = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    to_laser = -(n0 * a[0] + n1 * a[1] + n2 * a[2])
    to_camera = n0 * (camera[0] - a[0]) + n1 * (camera[1] - a[1]) + n2 * (camera[2] - a[2])
    if to_camera * to_laser > 0.0:
        return True
    return abs(to_camera) < aperture * math.sqrt(n0 * n0 + n1 * n1 + n2 * n2) and to_laser != 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _clip_all(corners: Float, planes: Float, front: Float, back: Float) -> int:
    """Clip corners (3, 3) by all planes -> front (12, 3), with back (12, 3) as scratch; returns how many are left."""
    count = len(corners)
    front[:count] = corners
    for plane in range(len(planes)):
        count = _clip(front, count, planes[plane], back)
        for i in range(count):
            front[i] = back[i]
        if count == 0:
            break
    return count


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _draw_outline(
    polygon: Float, T_camera_laser: Float, view: View, tilt: Any, distorted: bool, blur: float, left: Int, right: Int
) -> tuple[int, int]:
    """First and last row of a polygon's outline, (n, 3) in laser coordinates; left, right (h,): its columns there.

    Rows in between that it does not touch are empty: their right is before their left. The polygon is overwritten.
    """
    p, margin, height, count = np.empty(3), MARGIN_PX, len(left), len(polygon)
    for i in range(count):
        for axis in range(3):
            m = T_camera_laser[axis]
            p[axis] = m[0] * polygon[i, 0] + m[1] * polygon[i, 1] + m[2] * polygon[i, 2] + m[3]
        polygon[i] = p
    top, bottom = height, -1
    for i in range(count):
        e, f = polygon[i], polygon[(i + 1) % count]
        u0, v0 = project_point(e, view, tilt, False)
        u1, v1 = project_point(f, view, tilt, False)
        steps = int(min(1e5, math.ceil(math.hypot(u1 - u0, v1 - v0)))) + 1
        for s in range(steps + 1):
            # equal steps in the image: the depth of an image point on a 3D line is harmonic
            q = s / steps
            r = q * e[2] / ((1.0 - q) * f[2] + q * e[2])
            for axis in range(3):
                p[axis] = e[axis] + r * (f[axis] - e[axis])
            u, v = project_point(p, view, tilt, distorted)
            if not (abs(u) < 1e6 and abs(v) < 1e6):
                continue
            column = int(math.floor(u + 0.5))
            row = int(math.floor(v + 0.5))
            if blur > 0.0:
                lens = view.lens
                off_focus = lens[1] - (lens[2] * p[0] + lens[3] * p[1] + 1.0) / p[2]
                margin = MARGIN_PX + int(min(1e4, math.ceil(blur * abs(off_focus))))
            for y in range(max(row - margin, 0), min(row + margin, height - 1) + 1):
                if y < top or y > bottom:
                    # widen the range of rows and empty the new ones
                    if bottom < 0:
                        top, bottom = y, y
                        left[y], right[y] = view.width, -1
                    while y < top:
                        top -= 1
                        left[top], right[top] = view.width, -1
                    while y > bottom:
                        bottom += 1
                        left[bottom], right[bottom] = view.width, -1
                left[y], right[y] = min(left[y], column - margin), max(right[y], column + margin)
    return top, bottom


@numba.njit(nogil=True, cache=True, error_model="numpy")
def triangle_spans(  # noqa: PLR0913
    start: int,
    stop: int,
    surface: Surface,
    view: View,
    T_laser_world: Float,
    T_camera_laser: Float,
    beam: Float,
    blur: float,
    height: int,
) -> Int:
    """(n, 3) row, first and last column of spans where triangles start..stop may show direct light of the laser.

    blur: as `blur_scale` gives it.
    """
    spans = np.empty((256, 3), dtype=np.int32)
    found = 0
    vertices, triangles, aperture = surface.vertices, surface.triangles, view.lens[0]
    camera_centre = np.empty(3)
    for axis in range(3):
        m, o = T_laser_world[axis], view.T_world_camera
        camera_centre[axis] = m[0] * o[0, 3] + m[1] * o[1, 3] + m[2] * o[2, 3] + m[3]
    tilt, distorted = tilt_matrix(view.distortion[12], view.distortion[13]), bool(np.any(view.distortion))
    corners, front, back, planes = np.empty((3, 3)), np.empty((12, 3)), np.empty((12, 3)), np.empty((6, 4))
    left, right = np.empty(height, dtype=np.int32), np.empty(height, dtype=np.int32)
    for t in range(start, stop):
        low, high, near, far = np.inf, -np.inf, np.inf, -np.inf
        for c in range(3):
            w = vertices[triangles[t, c]]
            for axis in range(3):
                m = T_laser_world[axis]
                corners[c, axis] = m[0] * w[0] + m[1] * w[1] + m[2] * w[2] + m[3]
            low, high = min(low, corners[c, 0]), max(high, corners[c, 0])
            near, far = min(near, corners[c, 2]), max(far, corners[c, 2])
        if far <= 0.0:
            continue
        near = max(near, 0.0)
        sigma_near, _ = sheet_sigma(near, beam)
        sigma_far, _ = sheet_sigma(far, beam)
        reach = SHEET_SIGMAS * max(sigma_near, sigma_far)
        if low > reach or high < -reach or not _faces_both(corners, camera_centre, aperture):
            continue
        # sigma(z) is convex, so the chord over the triangle's depths bounds it
        slope = (sigma_far - sigma_near) / (far - near) if far > near else 0.0
        offset = max(sigma_near - slope * near, sigma_far - slope * far)
        _slab(planes, T_camera_laser, beam[4], SHEET_SIGMAS * slope, SHEET_SIGMAS * offset)
        count = _clip_all(corners, planes, front, back)
        top, bottom = _draw_outline(front[:count], T_camera_laser, view, tilt, distorted, blur, left, right)
        for y in range(top, bottom + 1):
            first, last = max(left[y], 0), min(right[y], view.width - 1)
            if first > last:
                continue
            if found == len(spans):
                more = np.empty((2 * found, 3), dtype=np.int32)
                more[:found] = spans
                spans = more
            spans[found, 0], spans[found, 1], spans[found, 2] = y, first, last
            found += 1
    return spans[:found]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def blur_scale(view: View, height: int) -> float:
    """Upper bound over the image of the blur disc's radius, px per 1/m of difference in 1 / depth; 0 for a pinhole."""
    if view.lens[0] == 0.0:
        return 0.0
    k, tilt = view.distortion, tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(k))
    stretch = 1.0
    for i in range(17):
        for j in range(17):
            u, v = view.width * i / 16.0 - 0.5, height * j / 16.0 - 0.5
            x, y, ok = chief_ray(view, tilt, distorted, u, v)
            if ok and distorted:
                _, _, xx, xy, yx, yy = distort(x, y, k, tilt)
                stretch = max(stretch, math.sqrt(xx * xx + xy * xy + yx * yx + yy * yy))
    if distorted:
        # margin for maxima between the samples
        stretch *= 1.1
    # with a tilted plane of focus the disc's far side is a little larger
    far_side = 1.0 / max(0.1, 1.0 - view.lens[0] * math.hypot(view.lens[2], view.lens[3]))
    skew = 1.0 + abs(view.intrinsics[4]) / view.intrinsics[0]
    return view.lens[0] * max(view.intrinsics[0], view.intrinsics[1]) * stretch * far_side * skew


@numba.njit(nogil=True, cache=True, error_model="numpy")
def covered_pixels(spans: Int, height: int, width: int) -> Int:
    """(n, 3) spans, in any order -> ascending flat indices of the pixels that they cover.

    Row by row with flags for one row: clearing and reading flags for the whole image would cost more than all the rest.
    """
    n = len(spans)
    begin = np.zeros(height + 1, dtype=np.int64)
    most = 0
    for i in range(n):
        begin[spans[i, 0] + 1] += 1
        most += spans[i, 2] - spans[i, 1] + 1
    for y in range(height):
        begin[y + 1] += begin[y]
    order, place = np.empty(n, dtype=np.int64), begin[:height].copy()
    for i in range(n):
        y = spans[i, 0]
        order[place[y]] = i
        place[y] += 1
    out = np.empty(most, dtype=np.int32)
    flags = np.zeros(width, dtype=np.bool_)
    k = 0
    for y in range(height):
        first, last = width, -1
        for j in range(begin[y], begin[y + 1]):
            i = order[j]
            flags[spans[i, 1] : spans[i, 2] + 1] = True
            first, last = min(first, spans[i, 1]), max(last, spans[i, 2])
        for x in range(first, last + 1):
            if flags[x]:
                out[k] = y * width + x
                k += 1
                flags[x] = False
    return out[:k].copy()


def rasterise_sheet(
    world: World,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    threads: int | None = None,
) -> NDArray[np.int32]:
    """(n,) flat pixel indices v * width + u, ascending, that may see direct light of the laser."""
    T_laser_world, T_camera_laser = invert(T_world_laser), invert(T_world_camera) @ T_world_laser
    view, surface, beam = camera.view(T_world_camera), world.surface, laser.packed()
    blur = blur_scale(view, camera.height)

    height = camera.height
    # one entry a chunk, so that threads write apart
    spans = [np.zeros((0, 3), np.int32)] * -(-len(world.triangles) // TRIANGLES_A_CHUNK)

    def work(start: int, stop: int) -> None:
        found = triangle_spans(start, stop, surface, view, T_laser_world, T_camera_laser, beam, blur, height)
        spans[start // TRIANGLES_A_CHUNK] = found

    map_chunks(work, len(world.triangles), TRIANGLES_A_CHUNK, threads)
    if not spans:
        return np.zeros(0, np.int32)
    return covered_pixels(spans[0] if len(spans) == 1 else np.concatenate(spans), height, camera.width)
