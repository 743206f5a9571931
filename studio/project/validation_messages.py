"""What pydantic found wrong with a project, told in the project's own words: field, found, allowed, nearest name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationError

from render.base.errors import InputError
from studio.project.strict_json import brief

MAX_LISTED = 5
MAX_ERRORS = 1000
LONGEST_NAME = 60
Location = tuple[int | str, ...]


@dataclass(frozen=True)
class Problem:
    """One thing wrong at one field."""

    field: str
    what: str
    found: str | None
    allowed: str
    cure: str = ""

    def __str__(self) -> str:
        return str(InputError(self.what, where=self.field, found=self.found, allowed=self.allowed, cure=self.cure))


def input_error(error: ValidationError, model: type[BaseModel], data: Any, where: str) -> InputError:
    """One message for everything wrong in `data`, up to five problems, the rest counted."""
    if error.error_count() > MAX_ERRORS:  # each takes a kilobyte and a search for the name that was meant
        allowed = "keys and values as in a project that `new` writes"
        found_errors = f"{error.error_count()} problems"
        return InputError("this is hardly a project", where=where, found=found_errors, allowed=allowed)
    found = problems(error, model, data)
    if len(found) == 1:
        only = found[0]
        place = f"{where}: {only.field}" if only.field else where
        return InputError(only.what, where=place, found=only.found, allowed=only.allowed, cure=only.cure)
    listed = [f"  {problem}" for problem in found[:MAX_LISTED]]
    if len(found) > MAX_LISTED:
        listed.append(f"  and {len(found) - MAX_LISTED} more")
    return InputError(f"{len(found)} problems\n" + "\n".join(listed), where=where)


def problems(error: ValidationError, model: type[BaseModel], data: Any) -> list[Problem]:
    """The problems in the order of the file, one a field, with the branches of unions that cannot be meant left out."""
    entries: list[dict[str, Any]] = [dict(entry) for entry in error.errors(include_url=False)]
    for entry in entries:
        entry["path"], entry["union"] = _resolve(entry["loc"], data, entry["type"])
    result: dict[str, Problem] = {}
    for entry in _meant(entries):
        problem = _problem(entry, model)
        known = result.get(problem.field)
        if known is None:
            result[problem.field] = problem
        elif problem.allowed and problem.allowed not in known.allowed and known.what == problem.what:
            allowed = f"{known.allowed} or {problem.allowed}"
            result[problem.field] = Problem(known.field, known.what, known.found, allowed, known.cure)
    return list(result.values())


def _resolve(location: Location, data: Any, kind: str) -> tuple[Location, tuple[int, str] | None]:
    """The part of a location that exists in the file, and where and by which label an union's branch was entered."""
    path: list[int | str] = []
    branch: tuple[int, str] | None = None
    for i, part in enumerate(location):
        if isinstance(data, dict) and data.get("kind") == part:
            continue  # the file itself says which branch is meant
        here, data = _child(data, part)
        if not here and not (kind == "missing" and i == len(location) - 1):
            branch = branch or (len(path), str(part))
            continue
        path.append(part)
    return tuple(path), branch


def _child(data: Any, part: int | str) -> tuple[bool, Any]:
    """Whether a JSON value has such a part, and the part or else the value itself."""
    if isinstance(data, dict) and part in data:
        return True, data[part]
    if isinstance(data, list) and isinstance(part, int) and part < len(data):
        return True, data[part]
    return False, data


def _meant(entries: list[dict[str, Any]]) -> Iterable[dict[str, Any]]:
    """Of every union, only the branches that the file comes nearest to."""
    unions: dict[Location, dict[str, list[dict[str, Any]]]] = {}
    for entry in entries:
        if entry["union"] is not None:
            depth, label = entry["union"]
            unions.setdefault(entry["path"][:depth], {}).setdefault(label, []).append(entry)
    best = {at: min(_distance(at, group) for group in branches.values()) for at, branches in unions.items()}
    for entry in entries:
        if entry["union"] is None:
            yield entry
            continue
        depth, label = entry["union"]
        at = entry["path"][:depth]
        if _distance(at, unions[at][label]) == best[at]:
            yield entry


def _distance(at: Location, group: Sequence[dict[str, Any]]) -> tuple[bool, int]:
    wrong_type = any(entry["path"] == at and entry["type"].endswith("_type") for entry in group)
    return wrong_type, len(group)


def _problem(entry: dict[str, Any], model: type[BaseModel]) -> Problem:
    field = _dotted(entry["path"])
    kind, found, context = entry["type"], brief(entry["input"]), entry.get("ctx", {})
    if kind == "missing":
        return Problem(field, "the field is missing", None, "")
    if kind == "extra_forbidden":
        names = _field_names(model, entry["loc"][:-1])
        near = difflib.get_close_matches(str(entry["loc"][-1])[:LONGEST_NAME], names, n=1, cutoff=0.5)
        cure = f"did you mean {near[0]}?" if near else ""
        return Problem(field, "unknown key", None, "" if near else ", ".join(names), cure)
    if kind == "union_tag_not_found":
        return Problem(field, "the field kind is missing", found, ", ".join(_kinds(model, entry["loc"])))
    if kind == "union_tag_invalid":
        expected = str(context.get("expected_tags", ""))
        near = difflib.get_close_matches(
            str(context.get("tag"))[:LONGEST_NAME], [tag.strip("'") for tag in expected.split(", ")], 1
        )
        place = f"{field}.kind" if field else "kind"
        cure = f"did you mean {near[0]}?" if near else ""
        return Problem(place, "unknown kind", brief(context.get("tag")), expected.replace("'", ""), cure)
    if kind in ("value_error", "assertion_error"):
        return Problem(field, str(context.get("error", entry["msg"])), None, "")
    message = entry["msg"].removeprefix("Input should be ").removeprefix("a valid ")
    if kind.startswith(("greater_than", "less_than")):
        limit = next(iter(context.values()))
        number = f"{limit:.10g}" if isinstance(limit, float) else str(limit)
        message = f"{message.rsplit(' ', 1)[0]} {number} {_unit(model, entry['loc'])}".rstrip()
    return Problem(field, "the value is not allowed", found, message)


def _unit(model: type[BaseModel], location: Location) -> str:
    """Of the number at a location, or of the tuple or union that it is part of."""
    for i, name in reversed(list(enumerate(location))):
        for owner in _models_at(model, location[:i]):
            if name in owner.model_fields:
                extra = owner.model_fields[str(name)].json_schema_extra
                return str(extra.get("unit", "")) if isinstance(extra, dict) else ""
    return ""


def _dotted(path: Location) -> str:
    text = ""
    for part in path:
        name = part if isinstance(part, int) or len(part) <= LONGEST_NAME else part[: LONGEST_NAME - 3] + "..."
        text += f"[{name}]" if isinstance(name, int) else f".{name}" if text else name
    return text


def _field_names(model: type[BaseModel], location: Location) -> list[str]:
    return sorted({name for found in _models_at(model, location) for name in found.model_fields})


def _kinds(model: type[BaseModel], location: Location) -> list[str]:
    return sorted({str(tag) for found in _models_at(model, location) for tag in _tags(found)})


def _models_at(model: type[BaseModel], location: Location) -> list[type[BaseModel]]:
    """The model classes that may stand at a location: fields, list items and union branches followed."""
    candidates: list[Any] = [model]
    for part in location:
        step: list[Any] = []
        for candidate in _alternatives(candidates):
            if isinstance(candidate, type) and issubclass(candidate, BaseModel):
                if part in candidate.model_fields:
                    step.append(candidate.model_fields[str(part)].annotation)
                elif part == candidate.__name__ or part in _tags(candidate):
                    step.append(candidate)
            elif isinstance(part, int) and get_origin(candidate) is tuple:
                step.extend(item for item in get_args(candidate) if item is not Ellipsis)
        candidates = step
    return [item for item in _alternatives(candidates) if isinstance(item, type) and issubclass(item, BaseModel)]


def _tags(model: type[BaseModel]) -> tuple[Any, ...]:
    kind = model.model_fields.get("kind")
    return get_args(kind.annotation) if kind is not None else ()


def _alternatives(types: Iterable[Any]) -> Iterable[Any]:
    """Unions and Annotated opened."""
    for item in types:
        if isinstance(item, type):
            yield item
        elif hasattr(item, "__metadata__"):  # Annotated
            yield from _alternatives(get_args(item)[:1])
        elif get_origin(item) in (tuple, Literal):
            yield item
        else:
            yield from _alternatives(get_args(item))
