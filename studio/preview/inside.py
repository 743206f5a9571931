"""Whether camera or lasers are inside an imported mesh: mostly one that was read in another unit than it was made in.

A hint and no error, as a mesh may be the room that they stand in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from render.base.arrays import Float, Float32
from render.base.pose import transform_points
from render.material.material import Glass
from render.scene.shape import MeshFile
from studio.preview.preview import Look, Placed

ENCLOSED = 0.75
"""Share of all directions in which a mesh is met from inside it; from the corner of an open room it is half."""
DIRECTIONS = 512
CURE = "is its unit or scale another?"


@dataclass(frozen=True)
class Inside:
    """What stands within the box of an object of a mesh file."""

    index: int
    """Of the object, in `scene.visible_objects`."""
    name: str
    who: tuple[str, ...]
    """The camera, and lasers by their names."""
    enclosed: bool
    """The mesh is around them; otherwise its box is, and they may well see it from outside."""
    sees: str
    """What they do then."""

    @property
    def told(self) -> str:
        """In a sentence, with a question."""
        return f"{self.of(self.name)}; unless that is the room, {CURE}"

    def of(self, mesh: str) -> str:
        """Where they are of it: "the camera is inside the part". mesh: what it is called."""
        who = " and ".join(filter(None, (", ".join(self.who[:-1]), self.who[-1])))
        are = "are" if len(self.who) > 1 else "is"
        if self.enclosed:
            return f"{who} {are} inside {mesh}: {self.sees} nothing but its inner side"
        return f"{who} {are} within the box around {mesh}"


def inside(look: Look) -> list[Inside]:
    """One for each mesh file whose box camera or lasers are in. A body of glass is left out: it may be water."""
    scene, found = look.scene, []
    camera = scene.T_world_camera(look.step)[:3, 3]
    lasers = [(laser.name, scene.T_world_laser(i, look.step)[:3, 3]) for i, laser in enumerate(scene.lasers)]
    for item in look.placed:
        part = scene.visible_objects[item.index]
        if not isinstance(part.shape, MeshFile) or isinstance(part.material, Glass):
            continue
        boxed = [(name, point) for name, point in (("the camera", camera), *lasers) if _in_box(item, point)]
        around = [name for name, point in boxed if _share_around(item, point) >= ENCLOSED]
        if boxed:
            who = tuple(around or (name for name, _ in boxed))
            sees = "it sees" if who == ("the camera",) else "it lights" if len(who) == 1 else "they see and light"
            found.append(Inside(item.index, part.name, who, bool(around), sees))
    return found


def _in_box(item: Placed, point: Float) -> bool:
    low, high = item.body.bounds
    local = transform_points(item.T_object_world, point)
    return bool(np.all((low < local) & (local < high)))


def _share_around(item: Placed, point: Float) -> float:
    """Of all directions from a point (3,) of the world, those in which the object is met."""
    hit = item.body.rays.from_point(transform_points(item.T_object_world, point), all_directions(DIRECTIONS))
    return float(np.mean(hit >= 0))


def all_directions(count: int) -> Float32:
    """(count, 3) unit vectors that share the sphere evenly, on a spiral of the golden angle."""
    k = np.arange(count)
    z = 1.0 - (2.0 * k + 1.0) / count
    turn = k * math.pi * (3.0 - math.sqrt(5.0))
    across = np.sqrt(1.0 - z**2)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1).astype(np.float32)
