"""JSON as a person may have damaged it: every way it can be wrong has one message with a place."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, NoReturn

from render.base.errors import InputError
from render.base.files import read_bytes

MAX_BYTES = 64 * 2**20
MAX_DEPTH = 64


def read_object(path: Path, what: str = "project file") -> dict[str, Any]:
    """The JSON object in a file. InputError: no such file, a folder, too big, empty, not UTF-8, not strict JSON."""
    return parse_object(_read(path, what), str(path), what)


def parse_object(text: str, where: str, what: str = "project file") -> dict[str, Any]:
    """The JSON object in a text; `where` names its source. InputError: as `read_object`."""
    if not text.strip():
        raise InputError(f"the {what} is empty", where=where, allowed="a JSON object", cure="restore it from a copy")
    try:
        value = json.loads(text, object_pairs_hook=_no_duplicates, parse_constant=_no_constant, parse_float=_finite)
    except json.JSONDecodeError as error:
        ended = error.pos >= len(text.rstrip())
        problem = f"the {what} ends in the middle" if ended else f"the {what} is not JSON: {error.msg}"
        raise InputError(problem, where=f"{where}, line {error.lineno}, column {error.colno}") from None
    except RecursionError:
        raise InputError(f"the {what} is nested too deeply", where=where, allowed=f"{MAX_DEPTH} levels") from None
    except ValueError as error:  # of the hooks, and of integers too long to convert
        raise InputError(f"the {what} holds a value that is not allowed: {error}", where=where) from None
    if not isinstance(value, dict):
        raise InputError(f"the {what} is not a JSON object", where=where, found=brief(value), allowed="{ ... }")
    if _depth(value) > MAX_DEPTH:
        raise InputError(f"the {what} is nested too deeply", where=where, allowed=f"{MAX_DEPTH} levels")
    try:
        json.dumps(value, ensure_ascii=False).encode("utf-8")
    except UnicodeEncodeError as error:  # half of a pair, written as an escape
        half = f"\\u{ord(error.object[error.start]):04x}"
        raise InputError(
            f"the {what} holds half a character", where=where, found=half, allowed="Unicode text"
        ) from None
    return value


def pretty(value: Any, indent: str = "") -> str:
    """JSON text, two spaces a level, with lists of plain values on one line. No NaN, no infinity."""
    inner = indent + "  "
    if isinstance(value, dict) and value:
        items = [f"{inner}{json.dumps(key, ensure_ascii=False)}: {pretty(item, inner)}" for key, item in value.items()]
        return "{\n" + ",\n".join(items) + f"\n{indent}}}"
    if isinstance(value, list) and any(isinstance(item, dict | list) for item in value):
        return "[\n" + ",\n".join(inner + pretty(item, inner) for item in value) + f"\n{indent}]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def brief(value: Any, length: int = 60) -> str:
    """A value as JSON, cut to a length that fits a message."""
    if isinstance(value, dict | list) and len(value) > length:
        return f"{'an object' if isinstance(value, dict) else 'a list'} of {len(value)} items"
    value = value[:length] if isinstance(value, str) else value
    text = json.dumps(value, default=str)
    return text if len(text) <= length else text[: length - 3] + "..."


def _read(path: Path, what: str) -> str:
    where = str(path)
    if path.is_dir():
        raise InputError(f"a folder, not a {what}", where=where, cure="give the .json file in it")
    data = read_bytes(path, MAX_BYTES, what)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"the {what} is not UTF-8 text",
            where=f"{where}, byte {error.start}",
            found=f"0x{data[error.start]:02x}",
            cure="save it as UTF-8" if path.suffix.lower() == ".json" else f"choose a {what}, whose name ends in .json",
        ) from None


def _no_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise ValueError(f"the key {brief(key)} appears twice in one object")
        result[key] = value
    return result


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name}; allowed: finite numbers")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:40]} is beyond the range of numbers")
    return value


def _depth(value: Any) -> int:
    """Levels of nesting, counted without recursion."""
    level, depth = [value], 0
    while level:
        depth += 1
        level = [
            child
            for item in level
            for child in (item.values() if isinstance(item, dict) else item)
            if isinstance(child, dict | list)
        ]
    return depth
