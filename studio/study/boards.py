"""Calibration as a study varies it: `boards.views` and its like, beside the fields of the project.

With any of them set every repeat calibrates the project anew, on virtual boards of its own seed, and makes its points
with what that found; without, camera and laser planes are those of the scene.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal, TypeVar

from pydantic import ValidationError, field_validator

from render.base.errors import InputError
from render.base.model import Model, quantity
from studio.calibration.board_text import parse_board
from studio.project.validation_messages import input_error

V = TypeVar("V")
PREFIX = "boards."
"""Of the paths in a study that are of the boards, and not of the project."""
RANGE = "None: about where the lines lie on the parts."


class Boards(Model):
    """Virtual boards before the project's camera, as `main.py calibrate PROJECT` has them."""

    board: str = quantity("checkerboard:13x9:25mm", label="Board", help="As calibrate has it.", max_length=100)
    views: int = quantity(20, label="Views of the board", ge=1, le=1000)
    corner_sigma: float = quantity(0.05, unit="px", label="Sigma of the corners", ge=1e-4, le=10.0)
    line_sigma: float = quantity(0.05, unit="px", label="Sigma of the line on the board", ge=1e-4, le=10.0)
    most_tilt: float = quantity(math.pi / 4, unit="rad", label="Largest tilt of the board", ge=1e-4, le=1.4)
    nearest: float | None = quantity(None, unit="m", label="Nearest board", help=RANGE, ge=1e-3, le=1e4)
    farthest: float | None = quantity(None, unit="m", label="Farthest board", help=RANGE, ge=1e-3, le=1e4)
    lens: Literal[0, 4, 5, 8, 12, 14] | None = quantity(0, label="Terms of distortion", help="None: chosen.")

    @field_validator("board")
    @classmethod
    def _is_a_board(cls, text: str) -> str:
        try:
            parse_board(text)
        except InputError as error:
            raise ValueError(str(error)) from None
        return text


def boards_of(values: Mapping[str, object], where: str) -> Boards | None:
    """Of a point's values by their paths; None: no calibration is asked for. InputError: not such a board."""
    given = {name.removeprefix(PREFIX): value for name, value in values.items() if name.startswith(PREFIX)}
    if not given:
        return None
    try:
        return Boards.model_validate(given)
    except ValidationError as error:
        raise input_error(error, Boards, given, f"{where}, {PREFIX[:-1]}") from None


def of_project(values: Mapping[str, V]) -> dict[str, V]:
    """The others, which are fields of the project."""
    return {name: value for name, value in values.items() if not name.startswith(PREFIX)}
