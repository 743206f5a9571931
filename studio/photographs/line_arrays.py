"""All arrays of a line changed alike, and lines side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import Line

NUMBERS = ("u", "sigma_u", "width", "amplitude", "background", "chi2", "length_apart", "shared_u")


def changed(line: Line, change: Callable[[NDArray[Any]], NDArray[Any]], flag: NDArray[np.uint8]) -> Line:
    """The line with all its numbers (n, k) changed alike, and other flags."""
    numbers: dict[str, Any] = {name: getattr(line, name) for name in NUMBERS}
    numbers = {name: None if values is None else change(values) for name, values in numbers.items()}
    return replace(line, **numbers, flag=flag)


def column(line: Line, k: int) -> Line:
    """The line (n, 1) of the peaks of one rank."""
    return changed(line, lambda values: values[:, k : k + 1], line.flag[:, k : k + 1])


def side_by_side(lines: Sequence[Line], candidates: Line) -> Line:
    """Lines (n, 1) of the candidates -> (n, k)."""
    if len(lines) == 1:
        return lines[0]
    together: dict[str, Any] = {}
    for name in (*NUMBERS, "flag"):
        values = [getattr(line, name) for line in lines]
        together[name] = None if values[0] is None else np.concatenate(values, axis=1)
    return replace(candidates, **together, candidates=candidates)
