"""Which field of an object an error is about, read from the place that the error names. Qt-free."""

from __future__ import annotations

import re

from render.base.errors import InputError
from studio.editing.scene_edits import OBJECTS
from studio.preview.preview import Look
from studio.project.document import FieldPath

FIELD = re.compile(r"(material|shape)(\.\w+|\[\d+\])*")


def problem_fields(look: Look, errors: dict[str, InputError]) -> dict[FieldPath, str]:
    """Texts of the errors, which come by the name of their object, by the path of the field that each is about."""
    shown = {look.scene.visible_objects[item.index].name for item in look.placed}
    found = {}
    for i, item in enumerate(look.scene.objects):
        error = errors.get(item.name)
        if error is not None:
            # what can be shown in another material has a good shape
            field = _field(error, item.name) or ("material" if item.name in shown else "shape",)
            found[(*OBJECTS, i, *field)] = _text(error, field)
    return found


def _field(error: InputError, name: str) -> FieldPath:
    place = error.where.removeprefix(f"object {name!r}: ")
    if not FIELD.fullmatch(place):
        return ()
    return tuple(int(part) if part.isdigit() else part for part in re.findall(r"\w+", place))


def _text(error: InputError, field: FieldPath) -> str:
    """Of the object, which is shown, no more than the field."""
    place = ", ".join(str(part).replace("_", " ") for part in field).capitalize()
    return str(InputError(error.what, where=place, found=error.found, allowed=error.allowed, cure=error.cure))
