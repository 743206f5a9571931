"""Older project files, brought up to date by one small function a version.

`STEPS[n]` turns the JSON object of version n into that of version n + 1. A step never changes once it is released, and
one file of every version ever released stays in tests/studio/project/projects.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from render.base.errors import InputError

Data = dict[str, Any]


def _lens_model(data: Data) -> Data:
    """1 to 2: the lens says how it is rendered; until then every camera was a pinhole."""
    part: Any = data
    for name in ("scene", "rig", "camera", "lens"):
        part = part.get(name) if isinstance(part, dict) else None
    if isinstance(part, dict):
        part.setdefault("model", "pinhole")
    return data | {"schema_version": 2}


STEPS: dict[int, Callable[[Data], Data]] = {1: _lens_model}
OLDEST = 1
CURRENT = OLDEST + len(STEPS)


def migrate(data: Data, where: str = "") -> Data:
    """The same project at the current version. InputError: version missing, not a number, or newer than known."""
    version = data.get("schema_version")
    place = f"{where}: schema_version" if where else "schema_version"
    understood = str(CURRENT) if CURRENT == OLDEST else f"{OLDEST} to {CURRENT}"
    if "schema_version" not in data:
        raise InputError("the field is missing", where=place, allowed=understood)
    if type(version) is not int or version < OLDEST:
        raise InputError("not a version of the project file", where=place, found=repr(version), allowed=understood)
    if version > CURRENT:
        raise InputError(
            "the project was saved by a newer Blazer Studio",
            where=place,
            found=version,
            allowed=understood,
            cure="update Blazer Studio, or save the project in the older format",
        )
    for step in range(version, CURRENT):
        data = STEPS[step](data)
    return data
