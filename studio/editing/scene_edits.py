"""Edits of the scene's lists: project and path in, new project and the path of what was made out. No state, no Qt."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel

from render.base.errors import InputError
from render.base.pose import Pose, invert, transform_points
from render.laser.laser import LineLaser
from render.material.lambertian import Lambertian
from render.scene.lights import PointLight, RectangleLight
from render.scene.motion import LinearStage, Motion, NoMotion, PoseList, Turntable
from render.scene.scene import SceneObject
from render.scene.shape import MeshFile, Parametric, Plane
from studio.editing.placement import (
    Array,
    across_the_line,
    field_of_view,
    light_pose,
    new_laser,
    object_pose,
    rounded,
    sized,
    target,
    vector,
)
from studio.editing.placing import aimed
from studio.project.document import FieldPath, replaced, value_at
from studio.project.mesh_import import ImportedMesh
from studio.project.project import Project

LASERS: FieldPath = ("scene", "rig", "lasers")
OBJECTS: FieldPath = ("scene", "objects")
LIGHTS: FieldPath = ("scene", "lights")
LISTS = (LASERS, OBJECTS, LIGHTS)
"""Where items can be added, removed and put in another order."""

SMOOTH_BELOW = rounded(math.radians(30.0))
"""Between facets of a part of a STEP file, whose true edges are sharper."""

Result = tuple[Project, FieldPath]
Kind = type[Parametric]


def in_list(path: FieldPath) -> bool:
    """The path is an item of one of the lists."""
    return path[:-1] in LISTS


def unique_name(name: str, taken: set[str]) -> str:
    """The name itself, or with the next free number: laser, laser 2, laser 3."""
    if name not in taken:
        return name
    stem = re.sub(r" \d+$", "", name)[:90]
    number = 2
    while f"{stem} {number}" in taken:
        number += 1
    return f"{stem} {number}"


def add_laser(project: Project) -> Result:
    """A laser aimed at the middle of the working range, on the first free side of the camera."""
    return _append(project, LASERS, new_laser(project.scene, unique_name("laser", _names(project, LASERS))))


def aim_laser(project: Project, laser: int, point: Array, step: int = 0) -> Result:
    """A laser turned where it stands until its axis meets a point (3,) of the world, at a step of the motion."""
    path: FieldPath = (*LASERS, laser)
    place = transform_points(invert(project.scene.T_world_rig(step)), point)
    pose = aimed(project.scene.lasers[laser].T_rig_laser, place)
    return replaced(project, (*path, "T_rig_laser"), pose), path


def add_primitive(project: Project, kind: type[Parametric]) -> Result:
    """A shape on the camera's axis in the middle of the working range, a quarter of the view wide."""
    from studio.editing.forms import kind_label

    shape = sized(kind, field_of_view(project.scene) / 4)
    name = unique_name(kind_label(kind).lower(), _names(project, OBJECTS))
    pose = object_pose(project.scene, flat=kind is Plane)
    return _append(project, OBJECTS, SceneObject(name=name, shape=shape, T_world_object=pose))


def add_mesh(
    project: Project, path: str, unit: str = "m", bounds: tuple[tuple[float, ...], tuple[float, ...]] | None = None
) -> Result:
    """An object of a mesh file (relative to the project), its middle at the middle of the working range.

    bounds: lowest and highest corner of the mesh in m, where known; else its origin is put there.
    """
    name = unique_name(_stem(path), _names(project, OBJECTS))
    place = target(project.scene)
    if bounds is not None:
        place = place - [(low + high) / 2 for low, high in zip(*bounds, strict=True)]
    shape = MeshFile.model_validate({"path": path, "unit": unit})
    return _append(
        project, OBJECTS, SceneObject(name=name, shape=shape, T_world_object=Pose(translation=vector(place)))
    )


def add_parts(project: Project, parts: Sequence[ImportedMesh]) -> Result:
    """An object for each part of an assembly, where the assembly has it, its middle as of `add_mesh`.

    Each in its colour, as far as the file tells it, and shaded as the curved surface that its facets stand for.
    """
    path: FieldPath = OBJECTS
    for part in parts:
        project, path = add_mesh(project, part.path, part.unit, part.bounds)
        name = unique_name(part.name or "part", _names(project, OBJECTS) - {value_at(project, path).name})
        material = Lambertian() if part.colour is None else Lambertian(albedo=part.colour)
        changed = {"name": name, "material": material, "crease_angle": _smooth_below(part)}
        project = replaced(project, path, value_at(project, path).model_copy(update=changed))
    return project, path


def replace_mesh_of(project: Project, path: FieldPath, mesh: ImportedMesh) -> Project:
    """An object of another mesh, in its own unit and shaded as an import of it is; pose, scale and material stay.

    A name that is that of the former file, as an import gives it, becomes that of the new one. KeyError: no object.
    """
    item = value_at(project, path)
    of_file = isinstance(item.shape, MeshFile) and re.sub(r" \d+$", "", item.name) == _stem(item.shape.path)
    changed = {"shape": MeshFile(path=mesh.path, unit=mesh.unit), "crease_angle": _smooth_below(mesh)}
    project = replaced(project, path, item.model_copy(update=changed))
    if not of_file:
        return project
    return rename(project, path, unique_name(mesh.name or _stem(mesh.path), _names(project, OBJECTS) - {item.name}))


def _smooth_below(mesh: ImportedMesh) -> float:
    """Facets of a STEP file stand for the curved surfaces that it has; those of a mesh may be all that there is."""
    return 0.0 if mesh.closed is None else SMOOTH_BELOW


def _stem(path: str) -> str:
    return path.replace("\\", "/").rsplit("/", 1)[-1].rsplit(".", 1)[0][:100] or "mesh"


def add_light(project: Project, kind: type[PointLight] | type[RectangleLight]) -> Result:
    """A lamp or a panel beside the camera that faces the working range, as bright as a well-lit bench."""
    pose, distance = light_pose(project.scene)
    names = _names(project, LIGHTS)
    if kind is PointLight:
        value = rounded(0.4 * distance**2)
        lamp = PointLight(name=unique_name("lamp", names), intensity=(value,) * 3, T_world_light=pose)
        return _append(project, LIGHTS, lamp)
    side = rounded(distance / 3)
    panel = RectangleLight(
        name=unique_name("panel", names), radiance=(4.0, 4.0, 4.0), width=side, height=side, T_world_light=pose
    )
    return _append(project, LIGHTS, panel)


def remove(project: Project, path: FieldPath) -> Result:
    """Without an item; the path is the neighbour's that takes its place, or the list's owner."""
    order = list(range(len(_items(project, path))))
    del order[_index(path)]
    result, items = _rearranged(project, path, order), order
    if items:
        return result, (*path[:-1], min(_index(path), len(items) - 1))
    return result, path[:-1]


def duplicate(project: Project, path: FieldPath) -> Result:
    """A copy of an item right after it, under a new name, moved a little so that both can be seen."""
    item = value_at(project, path)
    name = unique_name(item.name, _names(project, path[:-1]))
    field = next(name for name in type(item).model_fields if name.startswith("T_"))
    shift = field_of_view(project.scene) / 10
    pose: Pose = getattr(item, field)
    x, y, z = pose.translation
    moved = pose.model_copy(update={"translation": (x, round(y + shift, 9), z)})
    after = (*path[:-1], _index(path) + 1)
    order = list(range(len(_items(project, path))))
    order.insert(_index(after), _index(path))
    copied = item.model_copy(update={"name": name, field: moved})
    return _rearranged(project, path, order, (_index(after), copied)), after


def remove_all(project: Project, paths: Sequence[FieldPath]) -> Result:
    """Without several items; the path is that of who takes the last one's place, or the list's owner."""
    for path in sorted(paths, key=lambda path: -_index(path)):
        project, _ = remove(project, path)
    items = value_at(project, paths[-1][:-1])
    if not items:
        return project, paths[-1][:-1]
    place = min(_index(paths[-1]) - _before(paths[-1], paths), len(items) - 1)
    return project, (*paths[-1][:-1], place)


def duplicate_all(project: Project, paths: Sequence[FieldPath]) -> tuple[Project, list[FieldPath]]:
    """Copies of several items as of `duplicate`, and their paths, in the order of the items given."""
    for path in sorted(paths, key=lambda path: -_index(path)):
        project, _ = duplicate(project, path)
    return project, [(*path[:-1], _index(path) + _before(path, paths) + 1) for path in paths]


def rename(project: Project, path: FieldPath, name: str) -> Project:
    """InputError: empty, too long, or taken."""
    name = name.strip()
    if in_list(path) and name in _names(project, path[:-1]) - {value_at(project, path).name}:
        taken = f"another {str(path[-2]).removesuffix('s')} has this name"
        raise InputError(taken, found=name, allowed="one name each")
    return replaced(project, (*path, "name"), name)


def set_visible(project: Project, path: FieldPath, visible: bool) -> Project:
    """Show or hide an object."""
    return replaced(project, (*path, "visible"), visible)


def move(project: Project, path: FieldPath, index: int) -> Result:
    """An item to another place in its list."""
    order = list(range(len(_items(project, path))))
    index = max(0, min(index, len(order) - 1))
    order.insert(index, order.pop(_index(path)))
    return _rearranged(project, path, order), (*path[:-1], index)


def new_motion(project: Project, kind: type[BaseModel]) -> Motion:
    """Of another kind; what both kinds have in common stays.

    A new stage moves across the line, and a new turntable goes round once.
    """
    from studio.editing.forms import Alternative, start_value

    assert kind in (NoMotion, LinearStage, Turntable, PoseList)
    motion: Motion = start_value(Alternative("", "", kind), project.scene.motion)
    if isinstance(motion, LinearStage) and not isinstance(project.scene.motion, LinearStage):
        motion = motion.model_copy(update={"step": across_the_line(project.scene)})
    if isinstance(motion, Turntable) and not isinstance(project.scene.motion, Turntable):
        motion = motion.model_copy(update={"angle_step": min(2.0 * math.pi / motion.steps, math.pi)})
    return motion


def set_motion(project: Project, kind: type[BaseModel]) -> Result:
    """As of `new_motion`. InputError: something else of the project does not go with it."""
    return replaced(project, ("scene", "motion"), new_motion(project, kind)), ("scene", "motion")


def _append(project: Project, path: FieldPath, item: SceneObject | LineLaser | PointLight | RectangleLight) -> Result:
    items = value_at(project, path)
    return replaced(project, path, (*items, item)), (*path, len(items))


def _names(project: Project, path: FieldPath) -> set[str]:
    return {item.name for item in value_at(project, path)}


def _items(project: Project, path: FieldPath) -> tuple[Any, ...]:
    if not in_list(path):
        raise KeyError(path)
    return tuple(value_at(project, path[:-1]))


def _rearranged(project: Project, path: FieldPath, order: Sequence[int], new: tuple[int, Any] | None = None) -> Project:
    """The list of an item in another order, by the places that its items had; new: a place, and what takes it instead.

    Measures follow their laser: by its number alone they would be those of another. Those of one that is gone go.
    """
    before = _items(project, path)
    place, other = new or (-1, None)
    items = tuple(other if at == place else before[was] for at, was in enumerate(order))
    if path[:-1] != LASERS:
        return replaced(project, path[:-1], items)
    measures = tuple(
        gauge.model_copy(update={"laser": order.index(gauge.laser)})
        for gauge in project.measures
        if gauge.laser in order
    )
    edits = [(("measures",), measures), (path[:-1], items)]
    for at, value in edits if len(items) < len(before) else reversed(edits):  # no measure of a laser that is not there
        project = replaced(project, at, value)
    return project


def _index(path: FieldPath) -> int:
    return int(path[-1])


def _before(path: FieldPath, paths: Sequence[FieldPath]) -> int:
    """How many of the paths stand in the same list before one of them."""
    return sum(1 for other in paths if other[:-1] == path[:-1] and _index(other) < _index(path))
