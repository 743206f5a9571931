"""All arrays of a line changed alike, and lines side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line import result
from analysis.line.result import NUMBERS, Line


def changed(line: Line, change: Callable[[NDArray[Any]], NDArray[Any]], flag: NDArray[np.uint8]) -> Line:
    """The line with all its numbers (n, k) changed alike, and other flags."""
    numbers: dict[str, Any] = {name: getattr(line, name) for name in NUMBERS}
    numbers = {name: None if values is None else change(values) for name, values in numbers.items()}
    return replace(line, **numbers, flag=flag)


def column(line: Line, k: int) -> Line:
    """The line (n, 1) of the peaks of one rank."""
    return changed(line, lambda values: values[:, k : k + 1], line.flag[:, k : k + 1])


def less_sure(line: Line, variance: NDArray[np.float64], alike: NDArray[np.float64] | float) -> Line:
    """The line with errors more in its sigmas, of a variance (n, k) px^2, of which so many neighbours err alike."""
    told = np.ones_like(line.u) if line.length_apart is None else line.length_apart
    own = line.variance_apart
    length = (own * told + variance * alike) / np.maximum(own + variance, 1e-300)
    return replace(line, sigma_u=np.sqrt(line.sigma_u**2 + variance), length_apart=length)


def side_by_side(lines: Sequence[Line], candidates: Line) -> Line:
    """Lines (n, 1) of the candidates -> (n, k)."""
    if len(lines) == 1:
        return lines[0]
    together = result.side_by_side(lines)
    numbers = {name: getattr(together, name) for name in (*NUMBERS, "flag")}
    return replace(candidates, **numbers, candidates=candidates)
