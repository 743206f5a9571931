"""How much of the light of the environment and of a lamp a surface sends to the camera, where nothing shadows it."""

from __future__ import annotations

import math

import numba
import numpy as np

from render.base.arrays import Float, Int
from render.base.vectors import Vector, divided, dot, length, minus, negative, rotated, vector
from render.material.bsdf import sample
from render.material.record import ALPHA_X, ALPHA_Y, KIND, SUBSURFACE
from render.world.preview_shading import bsdf_bands
from render.world.surface_interaction import interaction
from render.world.triangles import Surface, plane_of


@numba.njit(nogil=True, cache=True, error_model="numpy")
def of_environment(
    surface: Surface, triangle: Int, points: Float, camera: Float, numbers: Float, below: Float
) -> Float:
    """(n,) triangles, (n, 3) points on them, (3,) where the camera is, m -> (n, 3) radiance towards it, of 1 around.

    numbers (m, 4), in [0, 1): of the directions that are looked along. below (3,): reflectance of what scatters below
    the surface, as of a diffuse one.
    """
    out = np.zeros((triangle.shape[0], 3)) + below
    rgb, alpha, frame, weight = np.empty(3), np.empty(2), np.empty((3, 3)), np.empty(3)
    row = np.empty(surface.rows.shape[1])
    for i in range(triangle.shape[0]):
        point = vector(points[i])
        normal, to_camera = _seen(surface, triangle[i], point, camera)
        for j in range(numbers.shape[0]):
            slot = interaction(surface, triangle[i], point, normal, numbers[j, 0], rgb, alpha, frame)
            row[:] = surface.rows[slot]
            row[ALPHA_X], row[ALPHA_Y] = alpha[0], alpha[1]
            drawn = numbers[j, 1], numbers[j, 2], numbers[j, 3]
            wi, _ = sample(row, (rgb[0], rgb[1], rgb[2]), rotated(frame, to_camera), drawn, weight)
            if row[KIND] == SUBSURFACE and wi[2] < 0.0:
                continue
            for band in range(3):
                out[i, band] += weight[band] / numbers.shape[0]
    return out


@numba.njit(nogil=True, cache=True, error_model="numpy")
def of_lamp(
    surface: Surface, triangle: Int, points: Float, camera: Float, lamp: Float, choices: Float, below: Float
) -> Float:
    """(n,) triangles, (n, 3) points on them, (3,) where camera and lamp are, m -> (n, 3) f cos, 1/sr; 0 behind.

    choices (m,), in [0, 1): of the materials of a blend. below: as of `of_environment`.
    """
    out = np.zeros((triangle.shape[0], 3))
    for i in range(triangle.shape[0]):
        point = vector(points[i])
        normal, to_camera = _seen(surface, triangle[i], point, camera)
        to_lamp = minus(vector(lamp), point)
        to_lamp = divided(to_lamp, length(to_lamp))
        facing = dot(normal, to_lamp)
        if facing <= 0.0:
            continue
        for band in range(3):
            out[i, band] = below[band] * facing / math.pi
        for j in range(choices.shape[0]):
            f = bsdf_bands(surface, triangle[i], point, normal, to_camera, to_lamp, choices[j])
            for band in range(3):
                out[i, band] += facing * f[band] / choices.shape[0]
    return out


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _seen(surface: Surface, t: int, point: Vector, camera: Float) -> tuple[Vector, Vector]:
    """The facet's unit normal on the camera's side, and the unit direction to the camera."""
    to_camera = minus(vector(camera), point)
    _, _, _, n0, n1, n2 = plane_of(surface, t)
    normal = (n0, n1, n2)
    return normal if dot(normal, to_camera) >= 0.0 else negative(normal), divided(to_camera, length(to_camera))
