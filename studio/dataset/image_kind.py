"""What the images of a recipe are, before they are there: their size in pixels and their bits."""

from __future__ import annotations

from collections.abc import Sequence

from render.output.frame_files import black_in_viewers
from studio.dataset.recipe import Recipe
from studio.project.project import Project

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


def notes_of_depth(recipe: Recipe, base: Project) -> list[str]:
    """What a person is to know who opens the images."""
    depths = [8] if base.sensor.processing is not None else sorted(set(_values(recipe, BITS, base.sensor.bits)))
    return [note for bits in depths if (note := black_in_viewers(bits))]


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
