"""Whatever a form lets a person choose can be looked at, told and developed: no value ends in a fault."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import BaseModel

from render.base.errors import InputError
from render.products import expected_plan
from studio.editing.forms import FieldSpec, describe, edited, field_path, start_value
from studio.notebook.frame import RenderedFrame, render
from studio.preview.preview import Preview
from studio.preview.readout_rows import rows
from studio.preview.readouts import readouts
from studio.project.document import FieldPath, value_at
from studio.project.project import Project
from studio.scan.frame_views import live_picture
from studio.scan.redevelop import develop_again, development, is_stale, measure_again
from studio.scan.stages import scaled

ITEMS: tuple[FieldPath, ...] = (
    ("scene", "rig", "camera"),
    ("scene", "rig", "lasers", 0),
    ("scene", "objects", 0),
    ("scene", "lights", 0),
    ("scene",),
    ("sensor",),
    ("render",),
    ("extraction",),
    ("delivery",),
)
MOST = 1e4
"""Larger counts of pixels and triangles are allowed, and take their time."""
NO_SUCH_CHANNEL = "the image has no such channel"


@pytest.fixture(scope="module")
def frame() -> RenderedFrame:
    """The plane, defocused and speckled, so that developing does all that it can."""
    project = Project.load("plane")
    changed = {
        "render.goal": None,
        "render.transport": "direct",
        "render.ambient_samples": 1,
        "scene.rig.camera.lens.focus_distance": 0.7,
        "sensor.defocus": True,
        "sensor.speckle": "polarised",
    }
    return render(scaled(project.replaced(changed), 0.05).in_folder(project.folder))


def all_fields(project: Project, path: FieldPath) -> Iterator[tuple[FieldPath, FieldSpec]]:
    """Of an item and of the models within it."""
    for spec in describe(value_at(project, path)):
        yield path, spec
        if isinstance(spec.value, BaseModel) and spec.assign is None:
            yield from all_fields(project, field_path(path, spec))


def values_of(spec: FieldSpec) -> Iterator[Any]:
    """Every choice, and the ends of a number's range with a half and the double of what it is."""
    if spec.kind == "flag":
        yield not spec.value
    elif spec.kind == "choice":
        yield from (value for value in spec.choices if value != spec.value)
    elif spec.kind == "union":
        others = (one for i, one in enumerate(spec.alternatives) if i != spec.chosen and not one.file)
        yield from (start_value(one, spec.value) for one in others)
    elif spec.kind in ("number", "integer"):
        number = float if spec.kind == "number" else int
        near = (0.5 * spec.value, 2.0 * spec.value) if spec.value else (1.0,)
        ends = (spec.clamped(end) for end in (spec.low, spec.high) if end is not None and (abs(end) <= MOST))
        yield from (number(value) for value in (*(spec.clamped(value) for value in near), *ends))
    if spec.optional and spec.value is not None:
        yield None


@pytest.mark.parametrize("item", ITEMS, ids=lambda path: str(path[-1] or path[-2]))
def test_every_value_is_looked_at_and_developed(item: FieldPath, frame: RenderedFrame) -> None:
    before, preview, tried = frame.project, Preview(1), 0
    for owner, spec in all_fields(before, item):
        for value in values_of(spec):
            try:
                project = edited(before, owner, spec, value).in_folder(before.folder)
            except InputError:
                continue  # refused, with its reason, before anything is done
            look = preview.look(project, project.folder)
            live_picture(project, look.image(0.5), True)
            rows(readouts(look, 0))
            expected_plan(project.scene, project.render_settings)
            if not is_stale(before, project):
                measured(frame, project)
            tried += 1
    assert tried


def measured(frame: RenderedFrame, project: Project) -> None:
    """The frame developed and measured as the project says."""
    how = development(frame.project, project)
    images = develop_again(frame, how)
    try:
        measure_again(frame, frame.world, how, images, ("likelihood",), cancelled=lambda: False)
    except InputError as error:
        assert NO_SUCH_CHANNEL in str(error)
