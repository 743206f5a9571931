"""What a field that is drawn is called, and how a person reads its values: "step block: Rise", 30 mm."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from render.base.errors import InputError
from studio.editing.forms import PLAIN, FieldSpec, describe, words
from studio.editing.units import Unit
from studio.project.project import Project
from studio.study.draft import spec_of
from studio.study.study import parts_of


def field_name(base: Project, field: str) -> tuple[str, Unit]:
    """Label with the name of the object, laser or light that has the field; unit."""
    parts, place, owner = parts_of(field), base, ""
    for part in parts[:-1]:
        place = _inside(place, part)
        owner = str(getattr(place, "name", owner)) if isinstance(part, int) else owner
    spec = spec_of(base, field)
    unit = PLAIN if spec is None else spec.unit
    if spec is not None:
        label = spec.label
    elif len(parts) > 1 and parts[-2] == "rotation":  # of a pose, which forms show as angles
        label, unit = f"Rotation vector {'xyz'[int(parts[-1])]}", Unit.of("rad")
    else:
        label = words(str(parts[-1]))
    return f"{owner}: {label}" if owner else label, unit


def value_name(base: Project | None, field: str, value: Any, unit: Unit) -> str:
    """A value of a choice: "sphere, radius 30 mm", "405 nm", "polarised". base: None: it cannot be read."""
    if isinstance(value, dict):
        specs = {} if base is None else _specs(base, field, value)
        own = [
            _part(specs.get(name), name, one)
            for name, one in value.items()
            if name != "kind" and not isinstance(one, dict | list)
        ]
        return ", ".join([words(str(value.get("kind", ""))).lower(), *own])
    if isinstance(value, list):
        return "(" + ", ".join(f"{one:g}" if isinstance(one, int | float) else str(one) for one in value) + ")"
    if isinstance(value, int | float) and not isinstance(value, bool):
        return unit.with_unit(value)
    return "none" if value is None else str(value)


def _specs(base: Project, field: str, value: dict[str, Any]) -> dict[str, FieldSpec]:
    """What the fields of the shape, the material or whatever is chosen are; empty: it does not fit, told elsewhere."""
    try:
        place: Any = base.replaced({field: value})
    except InputError:
        return {}
    for part in parts_of(field):
        place = _inside(place, part)
    return {spec.name: spec for spec in describe(place)} if isinstance(place, BaseModel) else {}


def _part(spec: FieldSpec | None, name: str, value: Any) -> str:
    label = words(name).lower() if spec is None else spec.label.lower()
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{label} {spec.unit.with_unit(value) if spec is not None and number else value}"


def _inside(place: Any, part: str | int) -> Any:
    if isinstance(part, int):
        return place[part] if isinstance(place, list | tuple) and part < len(place) else None
    return getattr(place, part, None)
