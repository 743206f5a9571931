"""The bias of the line's centre by the sheet's own width: where the surface is curved, the centroid of the light is not
the image of the sheet's middle.

A line is measured by the light of the whole sheet, but the truth is where the sheet's middle is. Along the scan line,
with q(u) = x / sigma in the laser's frame on the surface that pixel u sees, and A(u) all other factors of the
irradiance (distance, fan, angle, shadow), the light is A exp(-q^2 / 2), and to second order in the surface

    bias = A' / (A q'^2) - 3 q'' / (2 q'^3)

which is 0 on a plane but for the perspective. Here the Gaussian is integrated over the actual surface, by quadrature
nodes STEP sigma apart, so that edges and shadows across the sheet are included. Reflectance is not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.pose import invert, transform_points
from render.camera.camera import Camera
from render.frame import LaserCurve
from render.laser.irradiance import irradiance_at
from render.laser.laser import LineLaser
from render.truth.visibility import visible
from render.world.world import World

STEP, SAMPLED_SIGMAS = 0.5, 4.0
"""Sigmas of the line between nodes, and to the last node: the trapezoidal rule is exact for a Gaussian at this step."""
MAX_SIGMA_PX = 50.0
"""Upper limit of the line's sigma, px, where the sheet grazes the surface."""


def with_sheet_bias(
    curve: LaserCurve,
    world: World,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    threads: int | None = None,
) -> LaserCurve:
    """The curve with the distance, px along the scan line, from each crossing to the centroid of its light.

    Poses (4, 4). 0 where nothing is lit. Neighbouring crossings on a scan line are separated halfway between them.
    """
    nodes = np.arange(-SAMPLED_SIGMAS, SAMPLED_SIGMAS + STEP / 2, STEP)
    count = len(curve.index)
    if count == 0 or len(world.triangles) == 0:
        return replace(curve, sheet_bias=np.zeros(count))
    sigma = _line_sigma(world, curve, camera, laser, T_world_camera, T_world_laser)
    half = np.minimum(SAMPLED_SIGMAS * sigma, _half_gap(curve))
    offsets = (half / SAMPLED_SIGMAS)[:, None] * nodes
    along = (curve.position[:, None] + offsets).ravel()
    points, normals, hit = _seen(world, camera, T_world_camera, _pixels(curve, along, len(nodes)))
    to_laser = T_world_laser[:3, 3] - points
    lit = hit & (np.einsum("ij,ij->i", normals, to_laser) > 0.0)
    lit[lit] = visible(world.rays, points[lit], normals[lit], to_laser[lit], threads)
    T_laser_world = invert(T_world_laser)
    light = np.zeros(len(points))
    light[lit] = irradiance_at(
        np.ascontiguousarray(transform_points(T_laser_world, points[lit])),
        np.ascontiguousarray(normals[lit] @ T_laser_world[:3, :3].T),
        laser.packed(),
    )
    light = light.reshape(offsets.shape)
    total = light.sum(axis=1)
    bias = np.where(total > 0.0, (light * offsets).sum(axis=1) / np.where(total > 0.0, total, 1.0), 0.0)
    return replace(curve, sheet_bias=bias)


def _line_sigma(
    world: World, curve: LaserCurve, camera: Camera, laser: LineLaser, T_world_camera: Float, T_world_laser: Float
) -> Float:
    """(n,) sigma of the line along the scan line, px, with the surface continued as the plane of its facet."""
    T_laser_world = invert(T_world_laser)
    points, normals, hit = _seen(world, camera, T_world_camera, _pixels(curve, curve.position, 1))
    middle = transform_points(T_laser_world, points)
    across = np.zeros(len(points))
    for side in (-0.5, 0.5):
        rays = _directions(camera, T_world_camera, _pixels(curve, curve.position + side, 1))
        facing = np.einsum("ij,ij->i", normals, rays)
        depth = np.einsum("ij,ij->i", normals, points - T_world_camera[:3, 3]) / np.where(facing == 0.0, np.nan, facing)
        points_beside = T_world_camera[:3, 3] + depth[:, None] * rays
        across += np.sign(side) * transform_points(T_laser_world, points_beside)[:, 0]
    sheet = laser.sigma(np.maximum(middle[:, 2], 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        sigma = np.where(hit, sheet / np.abs(across), MAX_SIGMA_PX)
    return np.asarray(np.nan_to_num(np.minimum(sigma, MAX_SIGMA_PX), nan=MAX_SIGMA_PX))


def _half_gap(curve: LaserCurve) -> Float:
    """(n,) half the distance to the nearest other crossing on the scan line, px; infinite where there is none."""
    gap = np.where(np.diff(curve.index) == 0, np.diff(curve.position), np.inf)
    return 0.5 * np.minimum(np.append(gap, np.inf), np.insert(gap, 0, np.inf))


def _pixels(curve: LaserCurve, along: Float, each: int) -> Float:
    """(m, 2) pixels (u, v) at the positions along (m,) of the crossings' scan lines, `each` of them a crossing."""
    line = np.repeat(curve.index.astype(np.float64), each)
    return np.stack([along, line] if curve.axis == "rows" else [line, along], axis=1)


def _directions(camera: Camera, T_world_camera: Float, pixels: Float) -> Float:
    """(m, 3) ray directions, world, of length 1 along the camera's axis; NaN where the distortion has no inverse."""
    normalised, valid = camera.normalise(pixels)
    rays = np.column_stack([np.where(valid[:, None], normalised, np.nan), np.ones(len(pixels))])
    return np.asarray(rays @ T_world_camera[:3, :3].T)


def _seen(world: World, camera: Camera, T_world_camera: Float, pixels: Float) -> tuple[Float, Float, NDArray[np.bool_]]:
    """What (m, 2) pixels see, world: points (m, 3), unit normals towards the camera (m, 3), (m,) hit or not."""
    centre = T_world_camera[:3, 3]
    rays = _directions(camera, T_world_camera, pixels)
    known = np.isfinite(rays[:, 0])
    triangle = np.full(len(rays), -1, np.int32)
    triangle[known] = world.rays.from_point(centre, rays[known].astype(np.float32))
    hit = triangle >= 0
    corners = world.vertices[world.triangles[triangle]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    facing = np.einsum("ij,ij->i", normals, rays)
    hit &= np.abs(facing) > 0.0
    depth = np.einsum("ij,ij->i", normals, corners[:, 0] - centre) / np.where(hit, facing, 1.0)
    points = centre + depth[:, None] * np.where(hit[:, None], rays, 0.0)
    return points, normals * -np.sign(np.where(hit, facing, -1.0))[:, None], hit
