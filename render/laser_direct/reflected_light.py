"""How much of a laser's light the surface sends to the camera from points of its line, as a diffuse surface would."""

from __future__ import annotations

import math

import numba
import numpy as np

from render.base.arrays import Float, Int
from render.base.vectors import divided, dot, length, minus, scaled
from render.laser_direct.shading import eval_bsdf
from render.world.triangles import Surface, plane_of


@numba.njit(nogil=True, cache=True, error_model="numpy")
def reflected_at(surface: Surface, triangle: Int, points: Float, camera: Float, laser: Float, weights: Float) -> Float:
    """(n,) triangles, (n, 3) points on them, (3,) where camera and laser are, m -> (n,) reflectance of the diffuse
    surface that would be as bright: pi f, of the BSDF f (1/sr) from the laser to the camera; 0 where it is behind.

    surface: with its materials at the laser's wavelength; weights (3,): of R, G and B in a reflectance there.
    """
    out = np.zeros(triangle.shape[0])
    eye, source = (camera[0], camera[1], camera[2]), (laser[0], laser[1], laser[2])
    for i in range(triangle.shape[0]):
        point = (points[i, 0], points[i, 1], points[i, 2])
        to_camera, to_light = minus(eye, point), minus(source, point)
        to_camera, to_light = divided(to_camera, length(to_camera)), divided(to_light, length(to_light))
        _, _, _, n0, n1, n2 = plane_of(surface, triangle[i])
        normal = (n0, n1, n2)
        if dot(normal, to_camera) < 0.0:
            normal = scaled(-1.0, normal)
        if dot(normal, to_light) > 0.0:
            out[i] = math.pi * eval_bsdf(surface, triangle[i], point, normal, to_camera, to_light, weights)
    return out
