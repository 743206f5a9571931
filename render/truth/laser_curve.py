"""The exact laser line: the plane of the sheet cut with the triangles, in float64, and where it crosses each scan line.

A triangle counts only if camera and laser are on the same side of it. The cut of an edge is always interpolated from
its end behind the sheet to its end in front, so that two triangles that share the edge give the same bits, and a scan
line through their common point is counted once.
"""

from __future__ import annotations

from collections.abc import Callable

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Int
from render.base.pose import invert, transform_points
from render.camera.camera import Camera
from render.camera.distortion import tilt_matrix
from render.camera.projection import NEAR, project_point
from render.camera.view import View
from render.frame import Axis, LaserCurve
from render.laser.irradiance import irradiance_at
from render.laser.laser import LineLaser
from render.truth.visibility import visible
from render.world.world import World

PIECE_PX = 8.0
"""With distortion a segment is solved in pieces of this length, over which the scan line is assumed to be monotonic."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sheet_side(vertices: Float, T_laser_world: Float) -> Float:
    """(v, 3) world -> (v,) signed distance to the sheet's plane, m."""
    out = np.empty(vertices.shape[0])
    a, b, c, d = T_laser_world[0, 0], T_laser_world[0, 1], T_laser_world[0, 2], T_laser_world[0, 3]
    for i in range(vertices.shape[0]):
        out[i] = a * vertices[i, 0] + b * vertices[i, 1] + c * vertices[i, 2] + d
    return out


@numba.njit(nogil=True, cache=True, error_model="numpy")
def crossing_triangles(side: Float, triangles: Int) -> Int:
    """(v,) sides, (t, 3) -> (m,) triangles with vertices on both sides."""
    out = np.empty(triangles.shape[0], dtype=np.int32)
    count = 0
    for t in range(triangles.shape[0]):
        first = side[triangles[t, 0]] >= 0.0
        if (side[triangles[t, 1]] >= 0.0) != first or (side[triangles[t, 2]] >= 0.0) != first:
            out[count] = t
            count += 1
    return out[:count].copy()


@numba.njit(nogil=True, cache=True, error_model="numpy")
def cut_triangles(
    vertices: Float, triangles: Int, side: Float, crossing: Int, camera: Float, laser: Float
) -> tuple[Float, Int]:
    """Cut segments (m, 2, 3), world, of the crossing triangles that face both camera and laser, and their triangle."""
    segments = np.empty((crossing.shape[0], 2, 3))
    owner = np.empty(crossing.shape[0], dtype=np.int32)
    count = 0
    for k in range(crossing.shape[0]):
        t = crossing[k]
        a, b, c = vertices[triangles[t, 0]], vertices[triangles[t, 1]], vertices[triangles[t, 2]]
        nx = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
        ny = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
        nz = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        to_camera = nx * (camera[0] - a[0]) + ny * (camera[1] - a[1]) + nz * (camera[2] - a[2])
        to_laser = nx * (laser[0] - a[0]) + ny * (laser[1] - a[1]) + nz * (laser[2] - a[2])
        if not to_camera * to_laser > 0.0:
            continue
        end = 0
        for e in range(3):
            i, j = triangles[t, e], triangles[t, (e + 1) % 3]
            if (side[i] >= 0.0) == (side[j] >= 0.0):
                continue
            if side[i] >= 0.0:
                i, j = j, i
            f = side[i] / (side[i] - side[j])
            for axis in range(3):
                segments[count, end, axis] = vertices[i, axis] + f * (vertices[j, axis] - vertices[i, axis])
            end += 1
        owner[count] = t
        count += 1
    return segments[:count].copy(), owner[:count].copy()


@numba.njit(nogil=True, cache=True, error_model="numpy")
def clip_to_fan(segments: Float, T_laser_world: Float, tan_half_fan: float) -> Float:
    """(m, 2, 3) world -> (m, 2) range of each segment's parameter inside the fan; (1, 0) where it is outside."""
    spans = np.empty((segments.shape[0], 2))
    for k in range(segments.shape[0]):
        low, high = 0.0, 1.0
        for half in range(3):
            values = np.empty(2)
            for end in range(2):
                p = segments[k, end]
                y = T_laser_world[1, 0] * p[0] + T_laser_world[1, 1] * p[1] + T_laser_world[1, 2] * p[2]
                z = T_laser_world[2, 0] * p[0] + T_laser_world[2, 1] * p[1] + T_laser_world[2, 2] * p[2]
                y, z = y + T_laser_world[1, 3], z + T_laser_world[2, 3]
                if half == 0:
                    values[end] = z * tan_half_fan - y
                elif half == 1:
                    values[end] = z * tan_half_fan + y
                else:
                    values[end] = z - NEAR
            if values[0] < 0.0 and values[1] < 0.0:
                low, high = 1.0, 0.0
                break
            if values[0] < 0.0:
                low = max(low, values[0] / (values[0] - values[1]))
            elif values[1] < 0.0:
                high = min(high, values[0] / (values[0] - values[1]))
        spans[k, 0], spans[k, 1] = low, high
    return spans


@numba.njit(nogil=True, cache=True, error_model="numpy")
def scan_line_crossings(  # noqa: PLR0915
    segments: Float, spans: Float, view: View, height: int, along_rows: bool
) -> tuple[Float, Int, Int]:
    """Solve for the points of camera-frame segments (m, 2, 3) that fall on the centre of a scan line.

    Returns (n, 4) position along the scan line and point, (n,) scan line, (n,) segment.
    """
    tilt = tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    lines, across = (height, view.width) if along_rows else (view.width, height)
    capacity = 4096
    values = np.empty((capacity, 4))
    index, owner = np.empty(capacity, dtype=np.int32), np.empty(capacity, dtype=np.int32)
    count = 0
    point = np.empty(3)
    for s in range(segments.shape[0]):
        if spans[s, 0] >= spans[s, 1]:
            continue
        a, step = segments[s, 0], segments[s, 1] - segments[s, 0]
        t0, t1 = spans[s, 0], spans[s, 1]
        # clip to what is in front of the camera
        z0, z1 = a[2] + t0 * step[2], a[2] + t1 * step[2]
        if z0 <= NEAR and z1 <= NEAR:
            continue
        near = 1e-6
        if z0 < near:
            t0 = (near - a[2]) / step[2]
        elif z1 < near:
            t1 = (near - a[2]) / step[2]
        pieces = 1
        if distorted:
            u0, v0 = project_point(a + t0 * step, view, tilt, False)
            u1, v1 = project_point(a + t1 * step, view, tilt, False)
            pieces = int(min(1e5, max(abs(u1 - u0), abs(v1 - v0)) / PIECE_PX)) + 1
        u, v = project_point(a + t0 * step, view, tilt, distorted)
        line_a = v if along_rows else u
        ta = t0
        for piece in range(pieces):
            tb = t1 if piece == pieces - 1 else t0 + (t1 - t0) * (piece + 1) / pieces
            u, v = project_point(a + tb * step, view, tilt, distorted)
            line_b = v if along_rows else u
            low, high = min(line_a, line_b), max(line_a, line_b)
            if low <= high and high >= 0.0 and low <= lines - 1.0:
                first, last = int(np.ceil(max(low, 0.0))), int(np.ceil(min(high, float(lines)))) - 1
                for line in range(first, min(last, lines - 1) + 1):
                    # Illinois variant of regula falsi on line(t) - line = 0
                    p0, p1, f0, f1 = ta, tb, line_a - line, line_b - line
                    t, position = ta, 0.0
                    for _ in range(100):
                        t = p0 if f0 == 0.0 else p1 - f1 * (p1 - p0) / (f1 - f0)
                        for axis in range(3):
                            point[axis] = a[axis] + t * step[axis]
                        u, v = project_point(point, view, tilt, distorted)
                        f = (v if along_rows else u) - line
                        position = u if along_rows else v
                        if abs(f) < 1e-10 or abs(p1 - p0) < 1e-15:
                            break
                        if (f < 0.0) == (f1 < 0.0):
                            f0 *= 0.5
                        else:
                            p0, f0 = p1, f1
                        p1, f1 = t, f
                    if position < -0.5 or position > across - 0.5:
                        continue
                    if count == capacity:
                        capacity *= 2
                        values_more = np.empty((capacity, 4))
                        index_more, owner_more = np.empty(capacity, dtype=np.int32), np.empty(capacity, dtype=np.int32)
                        for i in range(count):
                            index_more[i], owner_more[i] = index[i], owner[i]
                            for axis in range(4):
                                values_more[i, axis] = values[i, axis]
                        values, index, owner = values_more, index_more, owner_more
                    values[count, 0] = position
                    for axis in range(3):
                        values[count, 1 + axis] = point[axis]
                    index[count], owner[count] = line, s
                    count += 1
            ta, line_a = tb, line_b
    return values[:count].copy(), index[:count].copy(), owner[:count].copy()


def laser_curve(
    world: World,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    axis: Axis = "rows",
    threads: int | None = None,
) -> LaserCurve:
    """The part of one laser's line that is lit and visible to the camera, without `sheet_bias`. Poses (4, 4)."""
    side = sheet_side(world.vertices, invert(T_world_laser))
    crossing = crossing_triangles(side, world.triangles)
    segments, triangle = cut_triangles(
        world.vertices, world.triangles, side, crossing, T_world_camera[:3, 3].copy(), T_world_laser[:3, 3].copy()
    )
    corners = world.vertices[world.triangles[triangle]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])

    def sees(points: Float, facing: Float, towards: Float) -> NDArray[np.bool_]:
        return visible(world.rays, points, facing, towards, threads)

    return curve_of_cut(
        segments, normals, world.object_id[triangle], camera, laser, T_world_camera, T_world_laser, axis, sees
    )


def curve_of_cut(  # noqa: PLR0913
    segments: Float,
    normals: Float,
    object_id: Int,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    axis: Axis,
    sees: Callable[[Float, Float, Float], NDArray[np.bool_]],
) -> LaserCurve:
    """The line of (m, 2, 3) cut segments with their (m, 3) facet normals (any length) and (m,) objects, world frame.

    sees(points, normals, towards) returns, as `visible` does, which points see a target.
    """
    T_laser_world, T_camera_world = invert(T_world_laser), invert(T_world_camera)
    spans = clip_to_fan(segments, T_laser_world, laser.tan_half_fan)
    values, index, owner = scan_line_crossings(
        transform_points(T_camera_world, segments),
        spans,
        camera.view(T_world_camera),
        camera.height,
        axis == "rows",
    )
    points = transform_points(T_world_camera, values[:, 1:])
    facing = normals[owner]
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    to_camera, to_laser = T_world_camera[:3, 3] - points, T_world_laser[:3, 3] - points
    facing *= np.sign(np.einsum("ij,ij->i", facing, to_camera))[:, None]
    seen = sees(points, facing, to_camera) & sees(points, facing, to_laser)
    order = np.flatnonzero(seen)
    order = order[np.lexsort((values[order, 0], index[order]))]
    inside = spans[:, 0] < spans[:, 1]
    kept = segments[inside]
    ends = kept[:, :1] + spans[inside][:, :, None] * (kept[:, 1:] - kept[:, :1])
    point = np.ascontiguousarray(values[order, 1:])
    normal = facing[order]
    return LaserCurve(
        axis=axis,
        index=index[order],
        position=values[order, 0].copy(),
        point=point,
        depth_z=point[:, 2].copy(),
        depth_range=np.linalg.norm(point, axis=1),
        object_id=object_id[owner[order]],
        camera_angle=_angle(normal, to_camera[order]),
        laser_angle=_angle(normal, to_laser[order]),
        irradiance=irradiance_at(
            np.ascontiguousarray(transform_points(T_laser_world, points[order]) * [0.0, 1.0, 1.0]),
            np.ascontiguousarray(normal @ T_laser_world[:3, :3].T),
            laser.packed(),
        ),
        segments=ends,
        sheet_bias=np.full(len(order), np.nan),
    )


def _angle(normals: Float, towards: Float) -> Float:
    cosine = np.einsum("ij,ij->i", normals, towards) / np.linalg.norm(towards, axis=1)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))
