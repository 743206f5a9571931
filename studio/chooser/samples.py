"""What the chooser learns from: the candidates of rendered photographs, each named by the exact truth.

The classes are those of `analysis.line.selection.learned`. From scenes of the test split frames are also made that are
unlike any other of a recipe: out of focus, shaken, with three lines.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.extract import CANDIDATES
from analysis.line.result import Line
from analysis.line.selection.learned import LINE, OTHER, REFLECTION
from render.base.threads import Cancel
from render.frame import Frame
from studio.dataset.images import Task, rendered
from studio.dataset.recipe import Recipe
from studio.dataset.scenes import drawn_scene, place
from studio.preview.preview import Preview
from studio.project.project import Project
from studio.scan.exposure import expose
from studio.scan.line_extraction import extract_line

Pixels = NDArray[Any]
ON_LINE = 2.0
"""px from a crossing within which a candidate is the line; beyond it, it is a wrong row."""
NONE = -1
"""No candidate."""


@dataclass(frozen=True)
class Sample:
    """A photograph of one laser: its candidates (n, k), what each is (n, k), and whether a row (n,) shows the line."""

    candidates: Line
    kind: NDArray[np.int8]
    crossed: NDArray[np.bool_]
    split: str
    scene: int
    unlike: Mapping[str, Line] = field(default_factory=dict)
    """Candidates of the same photograph made unlike a recipe's, by the name of what was done; of the test split."""


def samples_of(task: Task, cancelled: Cancel) -> list[Sample]:
    """The photographs of one scene, a laser each; nothing is written.

    InputError: as `drawn_scene`. Cancelled: so asked.
    """
    recipe = Recipe.model_validate_json(task.recipe)
    base = Project.from_text(task.base).in_folder(Path(task.base_folder))
    scene = drawn_scene(recipe, base, Path(task.root), task.scene, Preview(1))
    frame = rendered(scene, cancelled)
    samples = []
    for number, project in enumerate(scene.projects):
        settings = {"peaks": CANDIDATES, "select": "strongest", "geometry": False, "exposures": 1}
        asked = project.replaced({f"extraction.{name}": value for name, value in settings.items()})
        for laser in range(len(project.scene.lasers)):
            powers = [one.power if k == laser else 0.0 for k, one in enumerate(project.scene.lasers)]
            image = expose(asked, frame, powers, laser, threads=1)

            def measured(pixels: Pixels, asked=asked, image=image, laser=laser) -> Line:  # type: ignore[no-untyped-def]
                return extract_line(asked, replace(image, pixels=pixels), laser, threads=1)

            line = measured(image.pixels)
            seed = int(place(recipe.seed, task.scene, number, laser, "unlike") * 2**32)
            axis = 1 if line.axis == "rows" else 0
            made = unlike(image.pixels, axis, seed) if scene.split == "test" else {}
            crossed = np.zeros(len(line.u), np.bool_)
            crossed[frame.curves[laser].index] = True
            kind = kinds(line, frame, laser)
            odd = {name: measured(pixels) for name, pixels in made.items()}
            samples.append(Sample(line, kind, crossed, scene.split, task.scene, odd))
    return samples


def kinds(candidates: Line, frame: Frame, laser: int) -> NDArray[np.int8]:
    """(n, k): LINE within `ON_LINE` of a crossing, REFLECTION where more light came by a detour, OTHER, or NONE."""
    curve = frame.curves[laser]
    distance = np.full(candidates.u.shape, np.inf)
    for row, position in zip(curve.index, curve.position, strict=True):
        distance[row] = np.fmin(distance[row], np.abs(candidates.u[row] - position))
    direct = frame.laser_direct[laser]
    reflected = frame.laser_indirect[laser] if frame.laser_indirect else np.zeros_like(direct)
    if candidates.axis == "columns":
        direct, reflected = direct.T, reflected.T
    at = np.clip(np.rint(np.nan_to_num(candidates.u)).astype(int), 0, direct.shape[1] - 1)
    rows = np.arange(len(at))[:, None]
    other = np.where(reflected[rows, at] > direct[rows, at], REFLECTION, OTHER)
    return np.where(candidates.valid, np.where(distance <= ON_LINE, LINE, other), NONE).astype(np.int8)


def unlike(pixels: Pixels, axis: int, seed: int) -> dict[str, Pixels]:
    """A photograph (h, w) as no recipe makes it: out of focus, every scan line shaken, three lines for one."""
    import cv2

    rng = np.random.default_rng(seed)
    apart = pixels.shape[axis] // 8
    upright = pixels if axis == 1 else pixels.T
    shaken = np.stack([np.roll(row, by) for row, by in zip(upright, rng.integers(-10, 11, len(upright)), strict=True)])
    three = np.maximum.reduce([pixels, np.roll(pixels, apart, axis), np.roll(pixels, -apart, axis)])
    blurred = cv2.GaussianBlur(pixels.astype(np.float32), (0, 0), 4.0)
    return {
        "out of focus by 4 px": np.rint(blurred).astype(pixels.dtype),
        "scan lines shaken by 10 px": np.ascontiguousarray(shaken if axis == 1 else shaken.T),
        "three lines for one": three,
    }
