"""A recipe of a person's own project: nothing is drawn yet; and what to draw of a field that joins a recipe."""

from __future__ import annotations

from pathlib import Path

from render.base.errors import InputError
from studio.dataset.recipe import Draw, Recipe
from studio.editing.forms import FieldSpec
from studio.project.templates import DESCRIPTIONS
from studio.study.draft import suggested


def recipe_of(file: Path, name: str) -> tuple[Recipe, Path]:
    """A recipe of the project in a file, and the folder that its paths start from."""
    return Recipe(name=name[:100] or "dataset", base=file.name), file.parent


def suggested_draw(field: str, spec: FieldSpec) -> Draw:
    """All values of a choice, a range about the present value of a number, as a study would vary it."""
    found = suggested(field, spec)
    if "values" not in found:
        kind = "logarithmic" if found["spacing"] == "logarithmic" else "uniform"
        return Draw(field=field, kind=kind, low=found["low"], high=found["high"])
    values = found["values"]
    if spec.kind == "integer":
        return Draw(field=field, kind="integer", low=float(values[0]), high=float(values[-1]))
    return Draw(field=field, kind="choice", values=tuple(values))


def check_place(recipe: Recipe, root: Path, folder: Path) -> None:
    """InputError: the recipe names files beside it, by paths that lead nowhere from this folder."""
    named = [] if recipe.base in DESCRIPTIONS else [recipe.base]
    named += [draw.folder for draw in recipe.draw if draw.folder is not None]
    if named and folder.resolve() != root.resolve():
        raise InputError(
            "the recipe names files beside it",
            where="Save the recipe",
            found=f"{', '.join(named)}, not in {folder}",
            allowed=str(root),
            cure="save it there",
        )
