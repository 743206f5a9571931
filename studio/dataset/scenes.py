"""Scene k of a recipe: drawn from counters, so that it is the same however the work is split.

Every value is a hash of (seed, scene, attempt, image, field): to add a field to a recipe changes no other's value.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from render.base.arrays import Float, Int
from render.base.errors import InputError
from render.base.files import inside
from studio.dataset.recipe import MESHES, Draw, Recipe, Value
from studio.preview.preview import Look, Preview
from studio.project.project import Project
from studio.scan.stages import scaled

ATTEMPTS = 50
"""Scenes drawn in place of one that shows nothing."""
SPLITS = ("train", "validation", "test")
INSIDE = 0.5
"""Winding number at the camera from which it is in a closed part: 1 within, 0 outside."""


@dataclass(frozen=True)
class Scene:
    """What was drawn for one scene."""

    number: int
    projects: tuple[Project, ...]
    """Of each image, at the image scale."""
    drawn: tuple[Mapping[str, Value], ...]
    """The values of each image by their fields."""
    rejected: tuple[str, ...]
    """Why attempts before were drawn anew."""
    split: str
    look: Look
    """Where the first image's lines are."""


def place(seed: int, *counters: object) -> float:
    """A number in [0, 1), uniform, of 53 bits, decided by the counters."""
    text = "\0".join(str(one) for one in (seed, *counters))
    return (int.from_bytes(hashlib.sha256(text.encode()).digest()[:8]) >> 11) * 2.0**-53


def parts_of(draw: Draw, root: Path) -> list[str]:
    """The meshes of a draw's folder, by name. InputError: there is no such folder, or it is outside the recipe's, or
    holds none."""
    assert draw.folder is not None
    folder = inside(root, draw.folder, f"draw of {draw.field}: folder")
    if not folder.is_dir():
        cure = "make it beside the recipe, or correct its name"
        raise InputError("there is no such folder of meshes", where=str(folder), cure=cure)
    found = sorted(file.name for file in folder.glob("*") if file.suffix.lower() in MESHES and file.is_file())
    if not found:
        allowed = f"a folder with {', '.join(MESHES)}"
        raise InputError("the folder holds no meshes", where=str(folder), found="none", allowed=allowed)
    return [f"{draw.folder}/{name}" for name in found]


def drawn_scene(recipe: Recipe, base: Project, root: Path, number: int, preview: Preview) -> Scene:
    """The scene of a number. InputError: a drawn value is not allowed, or no attempt shows a line."""
    rejected: list[str] = []
    meshes = {one.field: parts_of(one, root) for one in recipe.draw if one.kind == "mesh"}
    for attempt in range(ATTEMPTS):
        common = {
            one.field: _value(one, recipe.seed, number, attempt, 0, meshes) for one in recipe.draw if not one.of_images
        }
        values = [
            {
                **common,
                **{
                    one.field: _value(one, recipe.seed, number, attempt, image, meshes)
                    for one in recipe.draw
                    if one.of_images
                },
            }
            for image in range(recipe.images)
        ]
        projects = tuple(
            scaled(_project(recipe, base, one, number, image), recipe.image_scale).in_folder(base.folder)
            for image, one in enumerate(values)
        )
        look = preview.look(projects[0], base.folder)
        reason = _why_not(look, preview, recipe.least_rows)
        if reason is None:
            share = place(recipe.seed, number, "split")
            split = SPLITS[sum(share >= edge for edge in np.cumsum(recipe.split)[:2])]
            return Scene(number, projects, tuple(values), tuple(rejected), split, look)
        rejected.append(reason)
        preview.drop_unused(base, base.folder)
    raise InputError(
        "the recipe draws scenes that show no line",
        where=f"scene {number}",
        found="; ".join(f"{rejected.count(one)} x {one}" for one in sorted(set(rejected))),
        allowed=f"one of {ATTEMPTS} attempts",
        cure="narrow the ranges of poses, or lower least_rows",
    )


def _value(draw: Draw, seed: int, scene: int, attempt: int, image: int, meshes: Mapping[str, list[str]]) -> Value:
    at = place(seed, scene, attempt, image, draw.field)
    if draw.kind != "mesh":
        return draw.at(at)
    files = meshes[draw.field]
    return {"kind": "file", "path": files[int(at * len(files))], "unit": draw.unit}


def _project(recipe: Recipe, base: Project, values: Mapping[str, Any], scene: int, image: int) -> Project:
    seed = int(place(recipe.seed, scene, image, "seed") * 2**53)
    try:
        return base.replaced({**values, "seed": seed})
    except InputError as error:
        found = "; ".join(f"{field} = {value!r}" for field, value in values.items())
        raise InputError(f"a drawn scene is not allowed: {error}", where=f"scene {scene}", found=found) from None


def _why_not(look: Look, preview: Preview, least_rows: float) -> str | None:
    """Why a scene is no use; None: it is."""
    for error in preview.errors.values():
        return str(error)
    lit = np.unique(np.concatenate([look.lit_curve(i).index for i in range(len(look.scene.lasers))]))
    camera = look.scene.camera
    lines = camera.height if look.project.extraction.axis == "rows" else camera.width
    if any(winding_number(*_placed(look, i)) > INSIDE for i in range(len(look.placed))):
        return "the camera is inside a part"
    return None if len(lit) >= max(least_rows * lines, 1) else "too little of the line is seen"


def _placed(look: Look, i: int) -> tuple[Float, Int, Float]:
    item = look.placed[i]
    eye = look.scene.T_world_camera(look.step)[:3, 3]
    surface = item.body.surface
    local = item.T_object_world[:3, :3] @ eye + item.T_object_world[:3, 3]
    return surface.vertices, surface.triangles, local


def winding_number(vertices: Float, triangles: Int, point: Float) -> float:
    """How often a surface (v, 3), (t, 3) winds round a point (3,): 1 inside a closed one, 0 outside it.

    Sum of the triangles' solid angles over 4 pi (Van Oosterom and Strackee 1983, eq. 8).
    """
    a, b, c = (vertices[triangles[:, k]] - point for k in range(3))
    x, y, z = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    ab, bc, ca = (np.einsum("ij,ij->i", one, other) for one, other in ((a, b), (b, c), (c, a)))
    below = x * y * z + ab * z + bc * x + ca * y
    return float(np.sum(2.0 * np.arctan2(triple, below)) / (4.0 * math.pi))
