"""What `main.py budget` does: what makes a project's depth error, as a study of its effects."""

from __future__ import annotations

from pathlib import Path

from studio.commands.places import folder_name, load_project
from studio.commands.study import run_into
from studio.runtime.workers import Engine
from studio.study.cells import WHOLE
from studio.study.effects import WHOLE_IMAGE
from studio.study.study import Study, require_laser

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
            "laser": require_laser(project, laser, "--laser"),
            "repeats": repeats,
            "methods": [project.extraction.method],
            "set": {**WHOLE_IMAGE, SAMPLES: max(project.render.ambient_samples, WHOLE_IMAGE[SAMPLES])},
            "sweeps": [{"name": "Error budget", "sampling": "effects"}],
        }
    )
    folder = out if out is not None else Path("scan-output") / f"budget-{folder_name(project.name)}"
    run_into(folder, study, {"project": project}, WHOLE, Engine(workers), quiet=quiet, as_json=as_json)
