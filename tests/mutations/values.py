"""JSON gone wrong: wrong kinds and sizes of values, fields lost, added, moved and doubled, text that is no JSON."""

from __future__ import annotations

import copy
import json
import math
import re
from collections.abc import Mapping, Sequence
from random import Random
from typing import Any

from tests.mutations.damage import damaged

HOSTILE_TEXTS = (
    "", " ", "\0", "\x1b[31mred\x1b[0m", "\x1b]0;title\x07", "a\nerror: b", "a\r\tb", "[/red]", "[bold red]",
    "[link=x]", "{0}", "%s", "error probe", "bias_m", "<b>&amp;</b>", "\u202eesrever", "\u200b", "é" * 80,
    "\U0001f600", "x" * 101, "y" * 100_000, ".", "..", "../..", "../outside.ply", "/etc/passwd", "/dev/zero",
    "/dev/stdin", "~", "a/b", "a\\b", "C:\\a", "file:///etc/passwd", "con", "scan.json", "points.ply", "fifo.ply",
    "loop.ply", "folder.ply", "null.png", "n" * 300 + ".ply", "NaN", "1", "null", "mm", "auto", "mono", "2099-13-45",
)  # fmt: skip
EXTREMES = (
    0, -0.0, 1, -1, 2, 0.5, 5e-324, -5e-324, 1e-300, 1e-160, 1e-30, 1e-12, 1e20, 1e38, 3.5e38, 1e160, 1e300, 1e308,
    -1e308, 2**31 - 1, 2**31, 2**32, 2**53 + 1, 2**63 - 1, 2**63, 2**64, -(2**63), 10**30, 1.5, math.pi, -math.pi,
    1e6, -1e6,
)  # fmt: skip
ODD: tuple[Any, ...] = (
    None, True, False, 0, -1, 1.5, "", "1", "NaN", [], {}, [[]], [{}], [None], {"": None}, {"kind": None},
    {"kind": "file"}, [0.0] * 3, [1e308] * 3, [0] * 1000, ["a", 1, None], {"kind": "none"}, {"path": "texture.png"},
    {"a": {"a": {"a": {}}}},
)  # fmt: skip
NO_JSON = (
    "NaN", "Infinity", "-Infinity", "1e999", "-1e999", "9" * 5000, "01", "1.", ".5", "+1", "0x1F", "1_000", "'a'",
    "undefined", '"\\ud800"', '"\\udc00\\ud800"', '"\\u0000"', '"\\x"', '"\t"', '"', "", "{", "]", "[" * 100_000,
    '{"a":' * 100_000, "[[[[[]]]]]", "[" * 60 + "]" * 60, "[" * 70 + "]" * 70, "/* */ 1", "1 // one", "tru", "0e",
    "-", "1e-400", "1" + "0" * 400,
)  # fmt: skip
FAMILIES = (
    ("file", "plane", "box", "sphere", "cylinder", "step_block", "v_groove", "weld_tee"),
    ("lambertian", "conductor", "coated", "glass", "emitter", "subsurface", "blend", "phong"),
    ("none", "linear", "turntable", "poses"),
    ("point", "rectangle"),
    ("divergence", "waist"),
    ("normal_map", "bump_map"),
)
"""Values of `kind` that may stand in one place, with some that no program knows."""
PLACEHOLDER = "placeholder of what is no JSON"

Limits = Mapping[Any, Sequence[float]]
"""Least and most that the fields of a name may hold."""
Place = tuple[Any, Any]
"""A container and the key or index of one value in it."""


def mutated(data: Any, rng: Random, limits: Limits | None = None) -> bytes:
    """The bytes of a JSON file that was damaged in one to five ways.

    limits: of the field of a name, to try besides EXTREMES.
    """
    data = copy.deepcopy(data)
    ways = rng.choices(
        (_another_number, _another_text, _odd, _no_json, _delete, _add, _rename, _swap, _graft, _resize, _kind),
        (30, 10, 8, 5, 6, 4, 4, 4, 4, 6, 10),
        k=rng.choices((1, 2, 3, 5), (12, 4, 2, 1))[0],
    )
    raw: list[str] = []
    for way in ways:
        if isinstance(data, dict | list) and data:
            way(data, rng, limits or {}, raw)
    if rng.random() < 0.02:
        data = rng.choice(ODD)
    text = json.dumps(data, ensure_ascii=rng.random() < 0.5, indent=rng.choice((None, 2)))
    for token in raw:
        text = text.replace(json.dumps(PLACEHOLDER), token, 1)
    if rng.random() < 0.04:
        text = _doubled_key(text, rng)
    content = text.encode("utf-8", "surrogatepass")
    if rng.random() < 0.08:
        content = damaged(content, rng)
    if rng.random() < 0.03:
        content = rng.choice(
            (b"\xef\xbb\xbf" + content, text.encode("utf-16"), text.encode("latin-1", "replace"), b"\0" * 9)
        )
    return content


def extreme(data: Any, rng: Random, limits: Limits) -> bytes:
    """The bytes of a JSON file with one to four values that are extreme, though most of them allowed."""
    data = copy.deepcopy(data)
    for way in rng.choices((_limit, _kind), (5, 1), k=rng.choice((1, 1, 2, 4))):
        way(data, rng, limits, [])
    return json.dumps(data).encode()


def place(data: Any, rng: Random, kind: type | tuple[type, ...] = object) -> Place | None:
    """Where a value of a kind is, found by descent, so that a long list counts no more than one field beside it."""
    for _ in range(40):
        container = data
        while True:
            keys = list(container) if isinstance(container, dict) else range(len(container))
            key = rng.choice(keys)
            value = container[key]
            deeper = isinstance(value, dict | list) and len(value) > 0
            if isinstance(value, kind) and not (deeper and rng.random() < 0.8):
                return container, key
            if not deeper:
                break
            container = value
    return None


def _another_number(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    found = place(data, rng, (int, float))
    if found is None:
        return
    container, key = found
    old = container[key]
    limit = rng.choice(limits.get(key) or EXTREMES)
    container[key] = rng.choice(
        (
            lambda: rng.choice(EXTREMES),
            lambda: limit,
            lambda: limit,
            lambda: math.nextafter(limit, rng.choice((-math.inf, math.inf))),
            lambda: limit * 10.0 ** rng.randint(-3, 3) if abs(limit) < 1e300 else limit,
            lambda: min(max(old * 10.0 ** rng.randint(-12, 12), -1e308), 1e308),
            lambda: -old,
            lambda: old + rng.choice((-1, 1, 0.5)),
            lambda: float(old),
            lambda: int(min(max(old, -(2**70)), 2**70)),
        )
    )()


def _limit(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    """A number at the least or most that its field allows, or between; without a limit, any number."""
    found = place(data, rng, (int, float))
    if found is None or isinstance(found[0][found[1]], bool):
        return
    container, key = found
    own = limits.get(key)
    low, high = (min(own), max(own)) if own else (-1e3, 1e3)
    between = low + (high - low) * 10.0 ** rng.uniform(-12, 0)
    value = rng.choice((low, high, between, between)) if own else rng.choice((rng.choice(EXTREMES), between))
    container[key] = round(value) if isinstance(container[key], int) and math.isfinite(value) else value


def _another_text(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    found = place(data, rng, str)
    if found is not None:
        container, key = found
        odd = rng.choice(HOSTILE_TEXTS)
        container[key] = rng.choice((odd, odd, container[key] + odd, container[key].upper(), container[key][:-1]))


def _odd(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    container, key = place(data, rng) or (data, next(iter(data), 0))
    container[key] = copy.deepcopy(rng.choice(ODD))


def _no_json(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    found = place(data, rng)
    if found is not None:
        found[0][found[1]] = PLACEHOLDER
        raw.append(rng.choice(NO_JSON))


def _delete(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    found = place(data, rng)
    if found is not None:
        del found[0][found[1]]


def _add(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    found = place(data, rng, dict) if rng.random() < 0.8 else None
    target = data if found is None else found[0][found[1]]
    if isinstance(target, dict):
        count = rng.choices((1, 30, 3000), (12, 2, 1))[0]
        for number in range(count):
            name = rng.choice((*HOSTILE_TEXTS, *target, "nmae", "x")) if count == 1 else f"unknown {number}"
            target[name] = copy.deepcopy(rng.choice(ODD))


def _rename(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    found = place(data, rng)
    if found is not None and isinstance(found[0], dict):
        container, key = found
        container[rng.choice((key[:-1], key.upper(), key + "s", " " + key))] = container.pop(key)


def _swap(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    first, second = place(data, rng), place(data, rng)
    if first is not None and second is not None:
        a, b = copy.deepcopy(first[0][first[1]]), copy.deepcopy(second[0][second[1]])
        first[0][first[1]] = b
        second[0][second[1]] = a


def _graft(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    source, target = place(data, rng), place(data, rng)
    if source is not None and target is not None:
        target[0][target[1]] = copy.deepcopy(source[0][source[1]])


def _resize(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    found = place(data, rng, list)
    if found is not None:
        values = found[0][found[1]]
        change = rng.choice(("drop", "double", "reverse", "many", "empty"))
        if change == "drop" and values:
            del values[rng.randrange(len(values))]
        elif change == "double" and values:
            values.append(copy.deepcopy(rng.choice(values)))
        elif change == "reverse":
            values.reverse()
        elif change == "many":
            values[:] = [copy.deepcopy(value) for value in values * (2000 // max(len(values), 1))][:2000]
        elif change == "empty":
            values.clear()


def _kind(data: Any, rng: Random, limits: Limits, raw: list[str]) -> None:
    """Another kind of the same thing, with its defaults or with the old one's fields."""
    found = []

    def look(value: Any) -> None:
        if isinstance(value, dict):
            if isinstance(value.get("kind"), str):
                found.append(value)
            for child in value.values():
                look(child)
        elif isinstance(value, list):
            for child in value:
                look(child)

    look(data)
    if found:
        chosen = rng.choice(found)
        family = next((names for names in FAMILIES if chosen["kind"] in names), sum(FAMILIES, ()))
        if rng.random() < 0.75:
            kept = {name: value for name, value in chosen.items() if name in ("name", "T_world_light")}
            chosen.clear()
            chosen.update(kept)
        chosen["kind"] = rng.choice(family)


def _doubled_key(text: str, rng: Random) -> str:
    keys = list(re.finditer(r'"(\w+)": ', text))
    if not keys:
        return text
    chosen = rng.choice(keys)
    return f"{text[: chosen.start()]}{chosen[0]}{rng.choice((*NO_JSON[:3], '0', 'null'))}, {text[chosen.start() :]}"
