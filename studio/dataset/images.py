"""What one worker does: a scene drawn, rendered once, and each of its images written with its labels.

Of each image the labels are written last and name the other files with their SHA-256: where they are, all is.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.files import atomic_write
from render.base.threads import Cancel
from render.output.exr import encode_exr
from render.output.frame_files import encode_png
from studio.dataset.labels import labels, maps, object_ids
from studio.dataset.recipe import Recipe
from studio.dataset.scenes import Scene, drawn_scene
from studio.notebook.frame import RenderedFrame, render
from studio.preview.preview import Preview
from studio.project.project import Project
from studio.scan.exposure import expose

A_FOLDER = 1000
"""Images in one folder."""
IMAGES, LABELS, OBJECTS, MAPS = "images", "labels", "objects", "maps"


@dataclass(frozen=True)
class Task:
    """One scene, as text, so that any process or machine can take it."""

    recipe: str
    base: str
    root: str
    """Folder of the recipe."""
    base_folder: str
    out: str
    scene: int


@dataclass(frozen=True)
class Made:
    """What became of a scene."""

    scene: int
    images: int
    rejected: tuple[str, ...]
    """Why attempts before it were drawn anew."""


def images_of(recipe: Recipe, lasers: int) -> int:
    """Images of one scene."""
    return recipe.images * (lasers if recipe.lasers == "in turn" else 1)


def name_of(image: int) -> str:
    """An image's name below its kind's folder: 1,000 a folder, eight digits."""
    return f"{image // A_FOLDER:05d}/{image:08d}"


def make(task: Task, cancelled: Cancel = lambda: False) -> Made:
    """Draw, render and write one scene, on one thread. InputError: as `drawn_scene`, or a file cannot be written."""
    recipe, base = _recipe(task.recipe, task.base, task.base_folder)
    preview = _preview(task.base)
    scene = drawn_scene(recipe, base, Path(task.root), task.scene, preview)
    frame = rendered(scene, cancelled)
    count = len(base.scene.lasers)
    first = task.scene * images_of(recipe, count)
    number, shared = first, _shared(recipe, frame)
    for image, project in enumerate(scene.projects):
        said = labels(scene, image, frame)
        for fired in [None] if recipe.lasers == "together" else range(count):
            _write(Path(task.out), number, photograph(project, frame, fired), shared, said, fired)
            number += 1
    preview.drop_unused(base, base.folder)
    return Made(task.scene, number - first, scene.rejected)


def rendered(scene: Scene, cancelled: Cancel = lambda: False) -> RenderedFrame:
    """The light and the truth that all images of a scene share. Cancelled: so asked."""
    return render(scene.projects[0], threads=1, cancelled=cancelled)


def photograph(project: Project, frame: RenderedFrame, fired: int | None) -> NDArray[Any]:
    """(h, w) DN of one image of a scene. fired: the only laser that is on; None: all are."""
    powers = [one.power if fired in (None, k) else 0.0 for k, one in enumerate(project.scene.lasers)]
    return expose(project, frame, powers, fired or 0, threads=1).pixels


def _shared(recipe: Recipe, frame: RenderedFrame) -> dict[str, bytes | memoryview]:
    """The files that all images of a scene have alike, by kind and suffix, with {} for the image's name."""
    shared: dict[str, bytes | memoryview] = {}
    if "objects" in recipe.maps:
        shared[f"{OBJECTS}/{{}}.png"] = encode_png(object_ids(frame))
    layers = maps(recipe, frame)
    if layers:
        shared[f"{MAPS}/{{}}.exr"] = encode_exr(layers)
    return shared


def _write(
    out: Path,
    number: int,
    pixels: NDArray[Any],
    shared: Mapping[str, bytes | memoryview],
    said: Mapping[str, Any],
    fired: int | None,
) -> None:
    name = name_of(number)
    contents: dict[str, bytes | memoryview] = {f"{IMAGES}/{name}.png": encode_png(pixels)}
    contents |= {path.format(name): content for path, content in shared.items()}
    for path, content in contents.items():
        with atomic_write(out / path) as temporary:
            temporary.write_bytes(content)
    record = {
        "image": number,
        **said,
        "fired": fired,
        "files": {path: hashlib.sha256(content).hexdigest() for path, content in contents.items()},
    }
    with atomic_write(out / LABELS / f"{name}.json") as temporary:
        temporary.write_text(json.dumps(record, allow_nan=False, default=_plain) + "\n", encoding="utf-8")


def _plain(value: object) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(type(value).__name__)


@lru_cache(maxsize=2)
def _recipe(text: str, base: str, folder: str) -> tuple[Recipe, Project]:
    return Recipe.model_validate_json(text), Project.from_text(base).in_folder(Path(folder))


@lru_cache(maxsize=2)
def _preview(base: str) -> Preview:
    """The parts that scenes share are loaded once a process."""
    return Preview(1)
