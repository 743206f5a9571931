"""What a field that is drawn is called, and the unit that a person reads it in: "step block: Rise", mm."""

from __future__ import annotations

from typing import Any

from studio.editing.forms import PLAIN, words
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


def _inside(place: Any, part: str | int) -> Any:
    if isinstance(part, int):
        return place[part] if isinstance(place, list | tuple) and part < len(place) else None
    return getattr(place, part, None)
