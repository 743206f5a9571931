"""What differs between two set-ups, field by field, in the words and units that people read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from studio.editing.forms import LABELS
from studio.editing.units import Unit
from studio.project.strict_json import brief

ONE = "one"
"""What is there, or is not, and has no kind that people know."""
LEFT_OUT = {"schema_version", "sha256"}
"""Of the file's form, and of files, whose hashes are compared as such."""


@dataclass(frozen=True)
class Change:
    """field: its path in the project file; label: in words, from the outside in; a, b: values as shown."""

    field: str
    label: str
    a: str
    b: str


def changes(a: BaseModel, b: BaseModel, field: str = "", label: str = "") -> Iterator[Change]:
    """Every field that differs, the innermost ones."""
    for name, info in type(a).model_fields.items():
        if name in LEFT_OUT:
            continue
        place = f"{field}.{name}".lstrip(".")
        words = ": ".join(filter(None, (label, LABELS.get(name) or info.title or _words(name))))
        then, now = getattr(a, name), getattr(b, name)
        if then != now:
            yield from _changed(then, now, place, words, info)


def _words(name: str) -> str:
    return name[:1].upper() + name[1:].replace("_", " ")


def _changed(a: Any, b: Any, field: str, label: str, info: FieldInfo) -> Iterator[Change]:
    if isinstance(a, BaseModel) and type(a) is type(b):
        yield from changes(a, b, field, label)
    elif _are_models(a) and _are_models(b):
        first, second = _named(a), _named(b)
        for name in dict.fromkeys((*first, *second)):
            words, place = f"{label}: {name}", f"{field}[{name}]"
            if name in first and name in second:
                if first[name] != second[name]:
                    yield from _changed(first[name], second[name], place, words, info)
            else:
                yield Change(place, words, *("there" if name in one else "not there" for one in (first, second)))
    else:
        extra = info.json_schema_extra if isinstance(info.json_schema_extra, dict) else {}
        unit = Unit.of(str(extra.get("unit", "") or _unit_of(field)))
        yield Change(field, label, _shown(a, unit), _shown(b, unit))


def _are_models(value: Any) -> bool:
    return isinstance(value, tuple) and all(isinstance(one, BaseModel) for one in value)


def _named(items: tuple[BaseModel, ...]) -> dict[str, BaseModel]:
    """By their names, and where these do not tell them apart by their numbers."""
    names = [str(getattr(item, "name", i)) for i, item in enumerate(items)]
    return dict(zip(names if len(set(names)) == len(names) else map(str, range(len(items))), items, strict=True))


def _unit_of(field: str) -> str:
    """Poses hold plain numbers."""
    return {"translation": "m", "rotation": "rad"}.get(field.rsplit(".", 1)[-1], "")


def _shown(value: Any, unit: Unit) -> str:
    if value is None or value == ():
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return unit.with_unit(value)
    if isinstance(value, tuple) and all(isinstance(one, int | float) for one in value) and len(value) <= 4:
        return f"{', '.join(unit.format(one) for one in value)} {unit.shown}".rstrip()
    if isinstance(value, BaseModel):
        return str(getattr(value, "kind", ONE)).replace("_", " ")
    return value if isinstance(value, str) else brief(value if not _are_models(value) else len(value))
