"""What the images of a recipe are, before they are there; those of a folder, small, with the lines of their labels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from render.base.errors import InputError
from render.base.files import read_bytes
from render.base.threads import Cancel
from render.run import never
from studio.dataset.contact_sheet import SIDE, Curve, Picture
from studio.dataset.folder import label_record
from studio.dataset.images import IMAGES, name_of
from studio.dataset.recipe import Recipe
from studio.project.project import Project

MOST_BYTES = 2**30
"""Of an image's file."""
WIDTH, HEIGHT, BITS = "scene.rig.camera.width", "scene.rig.camera.height", "sensor.bits"


def image_kind(recipe: Recipe, base: Project) -> str:
    """Size and bits of the images that are written: "612 x 512 px, 12 bit"; drawn ones by their ends."""
    camera, scale = base.scene.camera, recipe.image_scale
    width, height = (
        _range([max(1, round(side * scale)) for side in _values(recipe, field, now)])
        for field, now in ((WIDTH, camera.width), (HEIGHT, camera.height))
    )
    photograph = base.sensor.processing is not None
    bits = "8" if photograph else _range(_values(recipe, BITS, base.sensor.bits))
    return f"{width} x {height} px, {bits} bit"


def depths(recipe: Recipe, base: Project) -> list[int]:
    """Bits that its images have, in order."""
    return [8] if base.sensor.processing is not None else sorted(set(_values(recipe, BITS, base.sensor.bits)))


def _values(recipe: Recipe, field: str, now: int) -> list[int]:
    """What a whole number may be drawn as: all of a choice, or its ends."""
    for one in recipe.draw:
        if one.field == field:
            ends = one.values or (one.low, one.high)
            return [round(value) for value in ends if isinstance(value, (int, float))] or [now]
    return [now]


def _range(values: Sequence[int]) -> str:
    low, high = min(values), max(values)
    return f"{low}" if low == high else f"{low} to {high}"


def written_pictures(folder: Path, images: Sequence[int], cancelled: Cancel = never) -> Iterator[Picture]:
    """Images of a folder, as they lie there; one that cannot be read is left out."""
    for image in images:
        if cancelled():
            return
        try:
            yield _written(folder, image)
        except (InputError, KeyError, TypeError, ValueError, cv2.error):
            continue  # who goes on with the folder, or reads it, is told


def _written(folder: Path, image: int) -> Picture:
    record = label_record(folder, image)
    data = read_bytes(folder / IMAGES / f"{name_of(image)}.png", MOST_BYTES, "image")
    pixels = np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED))
    height, width = pixels.shape[:2]
    scale = min(1.0, SIDE / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    small = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA).astype(np.float64)
    if small.ndim == 3:
        small = small.mean(axis=2)
    lasers = [laser for k, laser in enumerate(record["lasers"]) if record["fired"] in (None, k)]
    curves = [[(np.array(one[key], np.float64) + 0.5) * scale - 0.5 for key in ("index", "position")] for one in lasers]
    return Picture(
        image,
        np.sqrt(small / max(float(small.max()), 1.0)),
        tuple(Curve(record["scan_lines"], index, position) for index, position in curves),
        tuple(record["rejected"]),
    )
