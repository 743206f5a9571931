"""A project of the scanner that was calibrated, for the photographs that it takes from now on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from render.base.errors import InputError
from studio.calibration.solving import of_project
from studio.project.project import Project
from studio.project.templates import PROJECT_NAME

NEW = "plane"
"""The template that a project is made of where there is none: what stands before the scanner has no part in points."""


def into_project(path: Path, data: dict[str, Any]) -> Path:
    """Write what a calibration file holds into a project, a file or the one in a folder, or into a new one; its path.

    A scene whose camera has images of another size gets the camera that was found.
    InputError: the project is broken, or has other lasers or another motion.
    """
    file = path if path.suffix == ".json" else path / PROJECT_NAME
    project = Project.load(file if file.exists() else NEW)
    found, scene = of_project(data), project.scene
    rig, camera = scene.rig, scene.camera
    if found.camera is not None and (found.camera.width, found.camera.height) != (camera.width, camera.height):
        values = {name: getattr(found.camera, name) for name in type(found.camera).model_fields}
        rig = rig.model_copy(update={"camera": camera.model_copy(update=values | {"skew": 0.0})})
    scene = scene.model_copy(update={"rig": rig})
    project = project.model_copy(update={"scene": scene, "calibration": found})
    try:
        checked = Project.from_text(project.to_text(), str(file))
    except InputError as error:
        raise InputError("the calibration does not go with the project", where=str(file), found=str(error)) from None
    file.parent.mkdir(parents=True, exist_ok=True)
    checked.save(file)
    return file
