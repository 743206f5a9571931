"""How bright the light around makes the line's place, in closed form: as if nothing shadowed it or reflected more."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from render.ambient.unshadowed import of_environment, of_lamp
from render.base.arrays import Float, Int
from render.base.pose import transform_points
from render.material.material import Blend, Lambertian, Material, Subsurface
from render.material.spectrum import BAND_CENTRES_NM
from render.scene.lights import Light, PointLight
from render.scene.scene import Scene
from render.world.triangles import Surface
from studio.preview.reflected_light import from_below

DIRECTIONS = 32
"""That the environment is looked at in, within a few hundredths of what a metal shows of it."""
PARTS = 4
"""Along each side of a lamp's rectangle."""


def unshadowed_light(
    scene: Scene,
    surface: Surface,
    material: Material,
    triangle: Int,
    points: Float,
    T_object_world: Float,
    camera: Float,
) -> Float:
    """(n,) triangles of a body, (n, 3) points on them, (3,) camera, in its frame -> (n, 3) `Lit.unshadowed`."""
    numbers = _numbers()[:1] if isinstance(material, Lambertian) else _numbers()
    below = np.zeros(3)
    if isinstance(material, Subsurface):
        below = np.array([from_below(material, band) for band in BAND_CENTRES_NM])
    found = np.zeros((len(triangle), 3))
    if any(scene.environment.radiance):
        share = of_environment(surface, triangle, points, camera, numbers, below)
        found += share * np.array(scene.environment.radiance)
    choices = np.ascontiguousarray(numbers[:, 0] if isinstance(material, Blend) else numbers[:1, 0])
    for light in scene.lights:
        for place, strength, axis in _parts(light):
            lamp = transform_points(T_object_world, place[None])[0]
            towards = lamp - points
            square = np.einsum("ij,ij->i", towards, towards)
            arrives = 1.0 / square
            if axis is not None:
                arrives *= np.maximum(-(towards @ T_object_world[:3, :3] @ axis), 0.0) / np.sqrt(square)
            found += of_lamp(surface, triangle, points, camera, lamp, choices, below) * arrives[:, None] * strength
    return found


def _parts(light: Light) -> list[tuple[Float, Float, Float | None]]:
    """Points that stand for a lamp, world frame: where, W/sr in RGB, and the axis of those that shine as a surface."""
    matrix = light.T_world_light.matrix
    if isinstance(light, PointLight):
        return [(matrix[:3, 3], np.array(light.intensity), None)]
    middles = (np.arange(PARTS) + 0.5) / PARTS - 0.5
    strength = np.array(light.radiance) * light.width * light.height / PARTS**2
    return [
        (matrix[:3, 3] + x * light.width * matrix[:3, 0] + y * light.height * matrix[:3, 1], strength, matrix[:3, 2])
        for x in middles
        for y in middles
    ]


@lru_cache(maxsize=1)
def _numbers() -> Float:
    """(DIRECTIONS, 4) evenly in [0, 1)."""
    from scipy.stats import qmc

    return np.asarray(qmc.Sobol(4, scramble=True, rng=1).random(DIRECTIONS))
