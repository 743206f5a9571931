"""A study as it is put together piece by piece: plain data that may be unfinished, and what a field offers to vary."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from studio.editing.forms import FieldSpec, describe, describe_item, field_path
from studio.editing.linked_fields import DERIVED
from studio.editing.units import Unit
from studio.project.document import FieldPath
from studio.project.project import Project
from studio.project.validation_messages import input_error
from studio.study.boards import PREFIX, Boards
from studio.study.study import Study, Value, parts_of

Data = dict[str, Any]
AXES = "xyz"
VALUES = ("number", "integer", "flag", "choice")
"""Kinds of field that one value fills."""
ELSEWHERE = ("extraction.method", "seed")
"""What a study varies by its methods and repeats."""
REPEATS, IMAGE_SCALE, COUNT = 4, 0.25, 5
DERIVED_BY = [one.assign for each in DERIVED.values() for one in each]
"""Of fields that are worked out from others, and stand in no file."""
ROTATION_HELP = "Turned about one axis alone, this is the inspector's angle; about several, the axis times the angle."
REACH = 0.01
"""m or rad, to either side of a position, and of any other quantity that is 0."""


def new_draft(base: str) -> Data:
    """A study that varies nothing yet."""
    return {
        "schema_version": 1,
        "name": "study",
        "base": base,
        "image_scale": IMAGE_SCALE,
        "repeats": REPEATS,
        "methods": ["likelihood"],
        "sweeps": [new_sweep("Sweep 1")],
    }


def new_sweep(name: str) -> Data:
    return {"name": name, "vary": [], "sampling": "grid", "chart": "sweep", "measure": "depth_p95"}


def finished(draft: Data) -> Study:
    """The study that a draft is. InputError: what is missing, or does not fit."""
    try:
        return Study.model_validate_json(json.dumps(draft), strict=True)
    except ValidationError as error:
        raise input_error(error, Study, draft, "study") from None


def varies_nothing(draft: Data) -> str:
    """The name of the first sweep without a field to vary; empty: there is none."""
    found = (one["name"] for one in draft["sweeps"] if not one["vary"] and one.get("sampling") != "effects")
    return next(found, "")


def by_names(text: str, draft: Data) -> str:
    """A message about a draft with its sweeps by their names, where a study's file counts them."""
    for number, sweep in enumerate(draft["sweeps"]):
        text = text.replace(f"study: sweeps[{number}]", sweep["name"])
    return text


def path_text(path: FieldPath) -> str:
    """As a study's file names a field: scene.rig.lasers[0].power."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")


def suggested(field: str, spec: FieldSpec) -> Data:
    """A parameter of a field: all values of a choice, a range about the present value of a number."""
    if spec.kind == "flag":
        return {"field": field, "values": [False, True]}
    if spec.kind == "choice":
        return {"field": field, "values": list(spec.choices)}
    if spec.kind == "integer":
        now = spec.value if spec.value is not None else 1
        near = sorted({max(int(spec.clamped(value)), int(now > 0)) for value in (now // 2, now, 2 * now)})
        return {"field": field, "values": near if len(near) > 1 else [now, now + 1]}
    now = float(spec.value) if spec.value is not None else 1.0
    signed = spec.low is None or spec.low < 0.0
    if now > 0.0 and not signed:
        low, high, spacing = spec.clamped(now / 2.0), spec.clamped(now * 2.0), "logarithmic"
    else:
        low, high, spacing = spec.clamped(now - REACH), spec.clamped(now + REACH), "linear"
    return {"field": field, "low": _short(low), "high": _short(high), "count": COUNT, "spacing": spacing}


def spec_of(project: Project, field: str) -> FieldSpec | None:
    """What a field of the project is: label, unit, limits and present value. None: no field of one value is there."""
    path = tuple(parts_of(field))
    if field.startswith(PREFIX):
        return dict(board_fields()).get(path)
    for above in range(1, 4):  # a part of a pose stands three below what has it
        try:
            found = dict(fields_of(project, path[:-above]))
        except (KeyError, IndexError, TypeError, AttributeError):
            continue
        if path in found:
            return found[path]
    return None


def board_fields() -> list[tuple[FieldPath, FieldSpec]]:
    """What a study can vary of its calibration, beside the fields of the project."""
    owner = PREFIX.removesuffix(".")
    return [((owner, spec.name), spec) for spec in describe(Boards()) if spec.kind in VALUES]


def varying(path: FieldPath, spec: FieldSpec) -> list[tuple[FieldPath, FieldSpec]]:
    """What a study can vary of a field of a form: itself, or each of its parts; empty: nothing."""
    if path_text(path) in ELSEWHERE or spec.assign in DERIVED_BY:
        return []
    if spec.kind in VALUES:
        return [(path, spec)]
    if spec.kind == "pose":
        parts = (("translation", "Position", "m", ""), ("rotation", "Rotation vector", "rad", ROTATION_HELP))
        return [
            (
                (*path, name, i),
                replace(
                    spec,
                    kind="number",
                    unit=Unit.of(unit),
                    default=0.0,
                    help=help,
                    name=str(i),
                    label=f"{label} {axis}",
                    value=value,
                ),
            )
            for name, label, unit, help in parts
            for i, (axis, value) in enumerate(zip(AXES, getattr(spec.value, name), strict=True))
        ]
    if spec.kind == "numbers" and spec.length is not None:
        return [
            ((*path, i), replace(spec, kind="number", name=str(i), label=f"{spec.label} {i + 1}", value=value))
            for i, value in enumerate(spec.value)
        ]
    return []


def fields_of(project: Project, item: FieldPath) -> list[tuple[FieldPath, FieldSpec]]:
    """Every field below an item of the scene that a study can vary, with its path."""
    return list(_below(item, describe_item(project, item)))


def _below(owner: FieldPath, spec: FieldSpec) -> Iterator[tuple[FieldPath, FieldSpec]]:
    for one in spec.fields:
        path = field_path(owner, one)
        if one.kind in ("model", "union", "list"):
            yield from _below(path, one)
        else:  # the only value of a choice of kinds is called as the choice is
            yield from varying(path, one if one.name else replace(one, label=spec.label))


def _short(value: float) -> float:
    return float(f"{value:.4g}")


def values_text(values: list[Value], spec: FieldSpec | None) -> str:
    """Values as they are typed, in the unit shown."""
    return ", ".join(
        spec.unit.format(value)
        if spec is not None and isinstance(value, int | float) and not isinstance(value, bool)
        else str(value)
        for value in values
    )
