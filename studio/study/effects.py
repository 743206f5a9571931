"""The effects that make a scan's error, each with the same project as it would be without it.

A state of a project says which effects are on: "total" all, "none" none, "without X" all but one, "only X" one alone.
What a project does not have changes nothing where it is switched off, so that such states are one and the same run.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from render.base.files import inside
from render.material.material import BumpMap, GreyTexture, Lambertian, NormalMap, Subsurface, Texture
from render.mesh.texture import load_texture
from render.scene.lights import Environment
from render.scene.shape import Cylinder, Sphere, WeldTee
from studio.project.project import Project

MOST_LIGHT = 1e4
"""Electrons where shot noise is off, over those where it is on: its variance is relatively so many times smaller."""
FINER = 3.0
"""The errors that a render without its own noise is asked for are so many times smaller."""
ROUNDER = 3
"""Facets where they are off: so many times as many a direction."""


def without_shot_noise(project: Project) -> Project:
    """Every electron becomes many, of light, of full well and of the other noises, with a gain that is as much less."""
    sensor = project.sensor
    room = (
        1e9 / sensor.full_well,
        1e5 / max(sensor.read_noise, 1e-9),
        1e5 / max(sensor.dsnu, 1e-9),
        1e4 / sensor.exposure_time,
    )
    more = max(1.0, min(MOST_LIGHT, *room))
    update: dict[str, Any] = {
        name: getattr(sensor, name) * more for name in ("exposure_time", "full_well", "read_noise", "dsnu")
    }
    if sensor.gain is not None:
        update["gain"] = sensor.gain / more
    return project.model_copy(update={"sensor": sensor.model_copy(update=update)})


def without_read_noise(project: Project) -> Project:
    return _sensor(project, read_noise=0.0, dark_current=0.0)


def without_fixed_pattern(project: Project) -> Project:
    return _sensor(project, prnu=0.0, dsnu=0.0)


def without_quantisation(project: Project) -> Project:
    """16 bits, of the same full well."""
    sensor = project.sensor
    finer = 2.0 ** (16 - sensor.bits)
    gain = None if sensor.gain is None else sensor.gain * finer
    return _sensor(project, bits=16, gain=gain, black_level=sensor.black_level * finer)


def without_speckle(project: Project) -> Project:
    return _sensor(project, speckle="off")


def without_blur(project: Project) -> Project:
    """All is in focus, through a lens without blur."""
    scene = project.scene
    lens = scene.camera.lens.model_copy(update={"model": "pinhole"})
    rig = scene.rig.model_copy(update={"camera": scene.camera.model_copy(update={"lens": lens})})
    sharp = project.model_copy(update={"scene": scene.model_copy(update={"rig": rig})})
    return _sensor(sharp, defocus=False, blur_sigma=0.0, halo=0.0)


def without_texture(project: Project) -> Project:
    """Every image of a material gives way to its mean, and relief to a plain surface."""
    objects = tuple(
        item.model_copy(update={"material": _plain(item.material, project.folder)}) for item in project.scene.objects
    )
    return project.model_copy(update={"scene": project.scene.model_copy(update={"objects": objects})})


def without_interreflection(project: Project) -> Project:
    """Laser light by way of one surface. Below surfaces none would come out again: such projects stay as they are."""
    if any(isinstance(item.material, Subsurface) for item in project.scene.visible_objects):
        return project
    return _render(project, transport="direct")


def without_subsurface(project: Project) -> Project:
    """Light leaves where it enters, and about as much of it. Source: van de Hulst (1980), Multiple Light Scattering."""
    objects = tuple(
        item.model_copy(update={"material": Lambertian(albedo=_diffuse(item.material))})
        if isinstance(item.material, Subsurface)
        else item
        for item in project.scene.objects
    )
    return project.model_copy(update={"scene": project.scene.model_copy(update={"objects": objects})})


def without_ambient(project: Project) -> Project:
    scene = project.scene.model_copy(update={"lights": (), "environment": Environment()})
    return project.model_copy(update={"scene": scene})


def without_facets(project: Project) -> Project:
    """Rounder shapes, of those that are made of numbers."""
    objects = []
    for item in project.scene.objects:
        shape = item.shape
        if isinstance(shape, Sphere):
            shape = shape.model_copy(update={"segments": min(ROUNDER * shape.segments, 2048)})
        elif isinstance(shape, Cylinder):
            shape = shape.model_copy(update={"segments": min(ROUNDER * shape.segments, 65536)})
        elif isinstance(shape, WeldTee):
            shape = shape.model_copy(update={"triangles": min(ROUNDER**2 * shape.triangles, 5_000_000)})
        objects.append(item.model_copy(update={"shape": shape}))
    return project.model_copy(update={"scene": project.scene.model_copy(update={"objects": tuple(objects)})})


def without_render_noise(project: Project) -> Project:
    """Light that is known better, by more samples."""
    render, more = project.render, FINER**2
    return _render(
        project,
        laser_error=max(render.laser_error / FINER, 1.01e-6),
        indirect_error=max(render.indirect_error / FINER, 1.01e-4),
        ambient_error=max(render.ambient_error / FINER, 1.01e-4),
        light_paths=min(int(render.light_paths * more), 1 << 40),
        ambient_samples=min(int(render.ambient_samples * more), 65536),
    )


EFFECTS: dict[str, Callable[[Project], Project]] = {
    "shot noise": without_shot_noise,
    "read noise": without_read_noise,
    "fixed pattern": without_fixed_pattern,
    "quantisation": without_quantisation,
    "speckle": without_speckle,
    "texture": without_texture,
    "defocus and blur": without_blur,
    "interreflection": without_interreflection,
    "subsurface": without_subsurface,
    "ambient light": without_ambient,
    "facets": without_facets,
    "render noise": without_render_noise,
}
"""What switches each of them off."""
OF_SIMULATION = ("facets", "render noise")
"""What no real scanner has."""
WHOLE_IMAGE: dict[str, Any] = {"render.goal": None, "render.ambient_samples": 16}
"""Fields of a project for its budget: states that differ in the sensor share a render, which knows the light so well
that the render's own noise is no large term. A project with a goal may have few samples, as they are spent by the line.
"""
TOTAL, NONE, WITHOUT, ONLY = "total", "none", "without ", "only "
STATES = (TOTAL, NONE, *(WITHOUT + name for name in EFFECTS), *(ONLY + name for name in EFFECTS))


def in_state(project: Project, state: str) -> Project:
    """The project with only the effects of a state. InputError: a texture cannot be read."""
    kept = {TOTAL: set(EFFECTS), NONE: set()}.get(state)
    if kept is None:
        name = state.removeprefix(WITHOUT).removeprefix(ONLY)
        kept = {name} if state.startswith(ONLY) else EFFECTS.keys() - {name}
    for name, switched_off in EFFECTS.items():
        if name not in kept:
            project = switched_off(project).in_folder(project.folder)
    return project


def effects_of(project: Project) -> list[str]:
    """Those that the project has."""
    return [name for name, switched_off in EFFECTS.items() if switched_off(project) != project]


def _sensor(project: Project, **update: Any) -> Project:
    return project.model_copy(update={"sensor": project.sensor.model_copy(update=update)})


def _render(project: Project, **update: Any) -> Project:
    return project.model_copy(update={"render": project.render.model_copy(update=update)})


def _plain(material: Any, folder: Path) -> Any:
    """A material without images, however deep; the mask of a blend stays, which says where what is."""
    update: dict[str, Any] = {}
    for name in type(material).model_fields:
        value = getattr(material, name)
        if isinstance(value, NormalMap | BumpMap):
            update[name] = None
        elif isinstance(value, Texture) and name != "mask":
            update[name] = _mean(folder, value.path, value.srgb, value.scale)
        elif isinstance(value, GreyTexture):
            update[name] = _mean(folder, value.path, False, value.scale)[0]
        elif isinstance(value, BaseModel) and name in ("base", "over"):
            update[name] = _plain(value, folder)
    return material.model_copy(update=update) if update else material


@lru_cache(maxsize=64)
def _mean(folder: Path, path: str, srgb: bool, scale: float) -> tuple[float, float, float]:
    image = load_texture(inside(folder, path, "texture"), srgb=srgb, scale=scale, where=path)
    red, green, blue = np.broadcast_to(np.atleast_1d(image.reshape(-1, image.shape[-1]).mean(axis=0)), 3)
    return float(red), float(green), float(blue)


def _diffuse(material: Subsurface) -> Any:
    """Reflectance of a half-space, eq. 14.3 of that book: s is the similarity parameter."""
    one = material.scattering_albedo
    values = []
    for albedo in one if isinstance(one, tuple) else (one,) * 3:
        s = ((1.0 - albedo) / (1.0 - albedo * material.anisotropy)) ** 0.5
        values.append((1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s))
    return tuple(values)
