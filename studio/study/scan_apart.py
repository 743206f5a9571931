"""What a scan that was begun is of, and in what the project is another by now."""

from __future__ import annotations

import math

from render.scene.motion import LinearStage, Motion, Turntable
from studio.editing.units import Unit
from studio.project.project import READ_OFF, Project
from studio.study.as_begun import is_long
from studio.study.changes import Change, changes


def scan_apart(begun: Project, now: Project) -> tuple[str, ...]:
    """Each field that frames or points are made by and that is another now: "Motion: Frames: 20 → 9".

    Names, hidden objects and what is only read off the points are no part of it. Both projects at full scale.
    """
    if begun is now:
        return ()
    return tuple(_told(change) for change in changes(_made_by(begun), _made_by(now)))


def frames_of(motion: Motion) -> str:
    """How many frames of what step: "20 frames of 5 mm"."""
    count = motion.frame_count
    frames = "1 frame" if count == 1 else f"{count} frames"
    if isinstance(motion, LinearStage):
        return f"{frames} of {Unit.of('m').with_unit(math.hypot(*motion.step))}"
    return (
        f"{frames} of {Unit.of('rad').with_unit(abs(motion.angle_step))}" if isinstance(motion, Turntable) else frames
    )


def _made_by(project: Project) -> Project:
    scene = project.scene.model_copy(update={"objects": project.scene.visible_objects})
    read_off = {name: Project.model_fields[name].default for name in READ_OFF}
    return project.model_copy(update={"name": "project", "scene": scene, **read_off})


def _told(change: Change) -> str:
    label = change.label.removeprefix("Scene: ")
    if is_long(change.a) and is_long(change.b):
        return f"{label}: another one"
    then, now = ("one" if is_long(value) else value for value in (change.a, change.b))
    return f"{label}: {then} → {now}"
