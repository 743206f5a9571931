"""Cases of broken input: a kind and a seed decide files and command line. Seed 0 is whole, and must be accepted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random

from tests.mutations.calibration_cases import calibration
from tests.mutations.image_cases import image
from tests.mutations.option_cases import option, preferences, recovery
from tests.mutations.place_cases import place_of_file
from tests.mutations.project_cases import mesh, project, texture
from tests.mutations.scan_cases import frame, manifest, report, sidecar
from tests.mutations.sources import Sources, furnish
from tests.mutations.window_cases import expression, step

KINDS: dict[str, Callable[[Sources, Path, Random, bool], list[str]]] = {
    "project": project,
    "mesh": mesh,
    "texture": texture,
    "image": image,
    "frame": frame,
    "sidecar": sidecar,
    "manifest": manifest,
    "place": place_of_file,
    "option": option,
    "preferences": preferences,
    "recovery": recovery,
    "report": report,
    "calibration": calibration,
    "step": step,
    "expression": expression,
}
WEIGHTS = {
    "project": 24, "mesh": 16, "texture": 7, "image": 11, "frame": 6, "sidecar": 8, "manifest": 6, "place": 5,
    "option": 9, "preferences": 2, "recovery": 1.5, "report": 0.5, "calibration": 4,
    "step": 0.5, "expression": 2,
}  # fmt: skip
"""Percent of the cases."""


@dataclass(frozen=True)
class Case:
    """argv: of the program, run in `folder`; or one of FUNCTIONS in `fork.py`, without a command."""

    kind: str
    seed: int
    folder: Path
    argv: list[str]
    rewrites: tuple[str, ...]
    """What the command may change of the files that were there: beginnings of names relative to `folder`."""


def make(kind: str, seed: int, sources: Sources, folder: Path) -> Case:
    """Write a case's files below `folder`, which is made."""
    rng = Random(f"{kind} {seed}")
    place = folder / "work"
    furnish(place, sources)
    argv = KINDS[kind](sources, place, rng, seed > 0)
    rewrites = {"preferences": ("preferences.json",), "recovery": ("recovery/",)}.get(argv[0], ())
    if "--force" in argv:
        rewrites = ("",)
    elif "--resume" in argv or "--out" not in argv:
        rewrites += ("scan/",)
    return Case(kind, seed, place, argv, rewrites)
