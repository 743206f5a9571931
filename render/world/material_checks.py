"""Checks of materials and light before any ray is traced: errors for what cannot be rendered, and warnings."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from render.base.arrays import Float
from render.base.errors import InputError
from render.base.pose import invert, transform_points
from render.laser.irradiance import SHEET_SIGMAS
from render.laser.laser import LineLaser
from render.material.material import Emitter
from render.scene.scene import Scene, SceneObject
from render.world.overlaps import MOST_BODIES, priority_of
from render.world.world import World

VISIBLE_PX = 0.1
VISIBLE_ANGLE = math.radians(5.0)
"""Deviations of smooth shading from the facets, in px of the line and as an angle, above which a warning is given."""


def check_materials(world: World, scene: Scene) -> None:
    """InputError: an object's material has no data at the wavelength of a laser or of the ambient light, or two
    transparent bodies touch, or overlap without priorities.
    """
    _check_overlaps(world, scene)
    for i, laser in enumerate(scene.lasers):
        try:
            world.surface_at((laser.wavelength_nm,) * 3)
        except InputError as error:
            found = f"{error.found}, the wavelength of scene.rig.lasers[{i}] ({laser.name})"
            raise InputError(
                error.what, where=error.where, found=found, allowed=error.allowed, cure=error.cure
            ) from error
    if has_ambient_source(scene):
        _ = world.surface


def _check_overlaps(world: World, scene: Scene) -> None:
    nesting, names = world.nesting, [item.name for item in scene.visible_objects]
    for a, b in nesting.touching:
        raise InputError(
            "two transparent bodies touch, and rounding decides which of them light meets first",
            where=f"object {names[a]!r}: shape",
            found=f"facets of {names[a]!r} lie on facets of {names[b]!r}",
            allowed=f"a gap, or an overlap with priorities, of more than {world.rays.surface_offset * 1e6:.2g} um",
            cure="move them apart, or draw one a little into the other and give them priorities",
        )
    for a, b in nesting.overlapping:
        priority = priority_of(world, a)
        if priority == priority_of(world, b):
            raise InputError(
                "two transparent bodies overlap, and nothing says which of them is there",
                where=f"object {names[a]!r}: material.priority",
                found=f"{names[a]!r} and {names[b]!r} have priority {priority}",
                allowed="bodies apart, or of different priorities",
                cure="raise the priority of the one that is there: of the glass, not of the water in it",
            )
    if len(nesting.ranked) > MOST_BODIES:
        raise InputError(
            "too many transparent bodies overlap others",
            where="scene.objects",
            found=f"{len(nesting.ranked)} of them",
            allowed=f"at most {MOST_BODIES}",
            cure="join bodies of the same substance in one mesh, or keep some apart",
        )


def scene_warnings(world: World, scene: Scene, step: int = 0) -> tuple[str, ...]:
    """Likely mistakes in a scene that renders without an error: one sentence each, naming the object."""
    return (*_light_warnings(world, scene, step), *_shading_warnings(world, scene, step))


def has_ambient_source(scene: Scene) -> bool:
    """There is a lamp, an environment or an emitter."""
    shining = any(isinstance(item.material, Emitter) for item in scene.visible_objects)
    return bool(scene.lights) or any(scene.environment.radiance) or shining


def _light_warnings(world: World, scene: Scene, step: int) -> list[str]:
    found = []
    for i, laser in enumerate(scene.lasers):
        if not sheet_meets(world, laser, scene.T_world_laser(i, step)):
            found.append(
                f"scene.rig.lasers[{i}] ({laser.name}): its light meets no object; move or turn the laser or an object"
            )
    if not has_ambient_source(scene) and len(found) == len(scene.lasers):
        found.append("no light reaches the scene: every image is black; add a laser, a lamp or an environment")
    return found


def sheet_meets(world: World, laser: LineLaser, T_world_laser: Float) -> bool:
    """Whether a triangle may lie in a laser's sheet, out to `SHEET_SIGMAS`, and fan; conservative: False is certain."""
    x, y, z = transform_points(invert(T_world_laser), world.vertices).T
    _, waist, focus, rayleigh, edge = laser.packed()[:5]
    reach = SHEET_SIGMAS * (rayleigh * z if waist == 0.0 else waist * np.sqrt(1.0 + ((z - focus) / rayleigh) ** 2))
    # each of these regions is convex: a triangle with all corners in one lies in it
    outside = np.zeros(len(z), np.uint8)
    for bit, beyond in enumerate((z <= 0.0, x > reach, x < -reach, y > edge * z, y < -edge * z)):
        outside |= np.left_shift(beyond.view(np.uint8), np.uint8(bit))
    a, b, c = outside[world.triangles].T
    return bool(np.any(a & b & c == 0))


@dataclass(frozen=True)
class Departure:
    """Largest deviations of smooth shading from the facets of one object."""

    angle: float
    """Angle between a facet's normal and its shading normal, rad."""
    depth: float
    """Distance from the facet to the curved surface that the shading suggests, m."""
    pixels: float
    """Shift of the line by that distance, for the laser with the longest baseline, px."""


def departure(world: World, scene: Scene, index: int, step: int = 0) -> Departure | None:
    """Departure of the visible object `index`, over its facets that face the camera; None: it is flat-shaded."""
    mine = world.object_id == index
    if len(world.normals) == 0 or not mine.any() or not np.any(world.normals[mine][:1]):
        return None
    points = transform_points(invert(scene.T_world_camera(step)), world.vertices)
    corners = points[world.triangles[mine]]
    turned = world.normals[mine].astype(np.float64) @ scene.T_world_camera(step)[:3, :3]
    facet = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facet /= np.maximum(np.linalg.norm(facet, axis=1, keepdims=True), 1e-300)
    ahead = (corners[:, :, 2].min(axis=1) > 0.0) & (np.einsum("ij,ij->i", facet, corners[:, 0]) < 0.0)
    if not ahead.any():
        return None
    corners, turned, facet = corners[ahead], turned[ahead], facet[ahead]
    angle = np.arccos(np.clip(np.einsum("ijk,ik->ij", turned, facet), -1.0, 1.0)).max(axis=1)
    depth = _bulge(corners, turned, facet)
    baseline = max((float(np.linalg.norm(scene.T_camera_laser(i)[:3, 3])) for i in range(len(scene.lasers))), default=0)
    pixels = scene.camera.fx * baseline * depth / corners[:, :, 2].min(axis=1) ** 2
    return Departure(float(angle.max()), float(depth.max()), float(pixels.max()))


def _bulge(corners: Float, normals: Float, facet: Float) -> Float:
    """(t, 3, 3) corners, m, and their normals, (t, 3) of the facets -> (t,) how far curved surfaces with these normals
    are off the facets, m, at most: each edge as a cubic with the slopes of its ends (Vlachos et al. 2001).
    """
    edges = np.roll(corners, -1, axis=1) - corners
    across = np.maximum(np.einsum("ijk,ik->ij", normals, facet), 1e-3)
    start = np.abs(np.einsum("ijk,ijk->ij", normals, edges)) / across
    end = np.abs(np.einsum("ijk,ijk->ij", np.roll(normals, -1, axis=1), edges)) / np.roll(across, -1, axis=1)
    middle = (start + end) / 8.0
    # a quadratic with such middles of its edges has 4/9 of their sum at the middle of the facet
    return np.asarray(np.maximum(middle.max(axis=1), 4.0 / 9.0 * middle.sum(axis=1)))


def _shading_warnings(world: World, scene: Scene, step: int) -> list[str]:
    found, label = [], repr(SceneObject.model_fields["crease_angle"].title)
    for i, item in enumerate(scene.visible_objects):
        off = departure(world, scene, i, step)
        if off is not None and (off.pixels > VISIBLE_PX or off.angle > VISIBLE_ANGLE):
            found.append(
                f"object {item.name!r}: smooth shading shows a surface that is not there, up to "
                f"{math.degrees(off.angle):.1f} deg and {off.depth * 1e6:.3g} um ({off.pixels:.2g} px of the line) off "
                f"the facets that the truth is made of; use a finer mesh, or a smaller {label} (crease_angle)"
            )
    return found
