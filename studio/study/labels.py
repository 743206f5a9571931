"""Names of a project's fields for charts, from the schema: "Exposure time (s)"."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel

from studio.project.project import Project
from studio.study.boards import PREFIX, Boards
from studio.study.study import parts_of


def field_labels(bases: Iterable[Project], fields: Iterable[str]) -> dict[str, str]:
    """Label and unit of each field by its path; what no project has keeps its path."""
    projects, found = list(bases), dict[str, str]()
    for path in fields:
        boards = path.startswith(PREFIX)
        owners: list[BaseModel] = [Boards()] if boards else list(projects)
        inside = path.removeprefix(PREFIX)
        labels = [label for owner in owners if (label := _label(owner, inside))]
        found[path] = labels[0] if labels else path
    return found


def _label(owner: BaseModel, path: str) -> str:
    place: Any = owner
    label = ""
    for part in parts_of(path):
        if isinstance(place, BaseModel) and part in type(place).model_fields:
            field = type(place).model_fields[str(part)]
            extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
            unit = f" ({extra['unit']})" if extra.get("unit") else ""
            label = f"{field.title or str(part).replace('_', ' ')}{unit}"
            place = getattr(place, str(part))
        elif isinstance(place, list | tuple) and isinstance(part, int) and part < len(place):
            place = place[part]
        else:
            return ""
    return label
