"""What `main.py budget` does: what makes a project's depth error, as a study of its effects."""

from __future__ import annotations

from pathlib import Path

from render.base.errors import InputError
from studio.commands.commands import folder_name, load_project
from studio.commands.study import run_into
from studio.project.project import Project
from studio.runtime.workers import Engine
from studio.study.cells import WHOLE
from studio.study.effects import WHOLE_IMAGE
from studio.study.study import Study

SAMPLES = "render.ambient_samples"


def budget_project(
    path: Path | None,
    *,
    out: Path | None,
    repeats: int,
    scale: float,
    laser: int,
    workers: int | None,
    quiet: bool,
    as_json: bool,
) -> None:
    """InputError: as `Project.load`, and as a study's run."""
    project, _ = load_project(path)
    study = Study.model_validate(
        {
            "name": f"Error budget of {project.name}"[:100],
            "question": "What makes the depth error, and how much of it.",
            "base": "project",
            "image_scale": scale,
            "laser": check_laser(project, laser),
            "repeats": repeats,
            "methods": [project.extraction.method],
            "set": {**WHOLE_IMAGE, SAMPLES: max(project.render.ambient_samples, WHOLE_IMAGE[SAMPLES])},
            "sweeps": [{"name": "Error budget", "sampling": "effects"}],
        }
    )
    folder = out if out is not None else Path("scan-output") / f"budget-{folder_name(project.name)}"
    run_into(folder, study, {"project": project}, WHOLE, Engine(workers), quiet=quiet, as_json=as_json)


def check_laser(project: Project, laser: int) -> int:
    """The laser's index. InputError: the rig has no such laser."""
    count = len(project.scene.lasers)
    if laser >= count:
        allowed = f"0 to {count - 1}" if count else "none: the rig has no laser"
        raise InputError("there is no such laser in the project", where="--laser", found=laser, allowed=allowed)
    return laser
