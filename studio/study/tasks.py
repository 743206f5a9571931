"""What a worker is handed: a render and the cells that share it. Light to import, as a driver needs no more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from render.base.model import Model
from studio.study.cells import Cell


@dataclass(frozen=True)
class Work:
    """One cell, as text: its key, its project, boards and assumed sensor in JSON, and what of it is kept.

    Empty where there is none.
    """

    key: str
    project: str
    boards: str
    assumed: str
    kept: str


@dataclass(frozen=True)
class Task:
    """A render and the cells that share it, as text, so that any process or machine can take it."""

    folder: str
    """Where the base project's meshes and textures are."""
    image_scale: float
    laser: int
    cells: tuple[Work, ...]
    again: str = ""
    """What the render is kept by for later tasks; empty: it is not."""


def tasks(cells: Sequence[Cell], image_scale: float, laser: int) -> list[Task]:
    """Cells grouped by render, in the order of their first."""
    groups: dict[str, list[Cell]] = {}
    for cell in cells:
        groups.setdefault(cell.render_key, []).append(cell)
    return [
        Task(
            str(group[0].project.folder.resolve()),
            image_scale,
            laser,
            tuple(
                Work(cell.key, cell.project.to_text(), _text(cell.boards), _text(cell.assumed), cell.kept)
                for cell in group
            ),
            group[0].render_key if group[0].again else "",
        )
        for group in groups.values()
    ]


def _text(given: Model | None) -> str:
    return "" if given is None else given.model_dump_json()
