"""Views to a calibration with all that is shown of it, and its way into a project."""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from analysis.calibration.board import Board
from analysis.calibration.calibrate import Calibrated, Request, calibrate
from analysis.calibration.estimate import Estimate
from render.base.errors import InputError
from studio.calibration.drawings import DepthMap, depth_map
from studio.calibration.in_silico import true_depth_error
from studio.calibration.material import Material
from studio.calibration.view_residuals import Residuals, ViewRow, view_rows
from studio.project.calibration import Calibration, from_file_data
from studio.project.validation_messages import input_error


@dataclass(frozen=True)
class Solved:
    """A calibration and its views. true: of each laser, the true depth error and the one told, m."""

    result: Calibrated
    rows: tuple[tuple[ViewRow, Residuals | None], ...]
    maps: tuple[DepthMap, ...]
    """Of `result.depth`."""
    true: tuple[tuple[float, float], ...] | None
    board: Board
    size: tuple[int, int]
    views: int
    """That it was made from, those left out as strays as well."""
    names: tuple[str, ...] = ()
    """Of the lasers, where they are those of a project."""


def solve(
    material: Material, dropped: Collection[str], board: Board, request: Request, truth: Estimate | None
) -> Solved:
    """From all views but those that are dropped. InputError: as `calibrate`."""
    kept = material.without(dropped)
    result = calibrate(kept.views, board.target, request)
    rows = view_rows(material.views, dropped, material.notes, result, board.target)
    true = None if truth is None else tuple(true_depth_error(result, truth))
    maps = tuple(depth_map(one, result.estimate) for one in result.depth)
    return Solved(result, tuple(rows), maps, true, board, material.size, len(kept.views), material.names)


def of_project(data: dict[str, Any]) -> Calibration:
    """A calibration file's data as a project holds it. InputError: a value that it does not take."""
    part = from_file_data(data)
    try:
        # through JSON text, because only there strict validation takes a list for a tuple
        return Calibration.model_validate_json(json.dumps(part), strict=True)
    except ValidationError as error:
        raise input_error(error, Calibration, part, "calibration") from None


def in_window(error: InputError) -> str:
    """An error as the window tells it, which has no options."""
    named = (
        (" (--nearest and --farthest)", ""),
        ("beyond --nearest", "beyond the nearest distance"),
        ("--farthest", "Range"),
        ("--lens so many", "so many numbers of the lens"),
        ("--paper", "Paper"),
        ("--board", "Board"),
        ("--out", "name"),
    )
    text = str(error)
    for option, name in named:
        text = text.replace(option, name)
    return text
