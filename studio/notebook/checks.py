"""What a person may hand to the functions of this room, told apart before any work begins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any, TypeVar, cast

from render.base.errors import InputError
from render.scene.scene import Scene

T = TypeVar("T")
Made = TypeVar("Made")


def expect(value: object, kind: type[T], where: str, cure: str) -> T:
    """The value. InputError: it is of another kind."""
    if not isinstance(value, kind):
        raise InputError(
            "this is something else than what is needed here",
            where=where,
            found=type(value).__name__,
            allowed=kind.__name__,
            cure=cure,
        )
    return value


def check_number(value: object, where: str, low: float, high: float) -> float:
    """The value. InputError: no finite number in the range."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or not low <= value <= high:  # type: ignore[arg-type,operator]
        raise InputError("the number is out of range", where=where, found=value, allowed=f"{low:g} to {high:g}")
    return float(value)  # type: ignore[arg-type]


def check_whole(value: object, where: str, low: int, high: int) -> int:
    """The value. InputError: no whole number in the range."""
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise InputError("the whole number is out of range", where=where, found=value, allowed=f"{low} to {high}")
    return value


def check_threads(threads: int | None) -> int | None:
    """The value. InputError: neither None nor a number of threads."""
    return None if threads is None else check_whole(threads, "threads", 1, 1024)


def check_laser(laser: object, scene: Scene) -> int:
    """The index. InputError: the scene has no such laser, or none."""
    if not scene.lasers:
        raise InputError("the rig has no laser, so there is no line to measure", where="scene.rig.lasers", found="none")
    return check_whole(laser, "laser", 0, len(scene.lasers) - 1)


def extended(kind: type[Made], base: Any, **more: Any) -> Made:
    """A dataclass of the kind, which adds fields to that of `base`."""
    return kind(**{one.name: getattr(base, one.name) for one in fields(base)}, **more)


def plain(kind: type[Made], value: Any) -> Made:
    """The dataclass of the kind, without what `extended` added."""
    return kind(**{one.name: getattr(value, one.name) for one in fields(kind)})  # type: ignore[arg-type]


def as_sequence(value: T | Sequence[T]) -> tuple[T, ...]:
    """One thing, or several, as a tuple."""
    return tuple(value) if isinstance(value, list | tuple) else (cast(T, value),)
