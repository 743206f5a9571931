"""In what the project is another than a scan that was begun: only what frames and points are made by."""

from __future__ import annotations

from render.scene.motion import LinearStage, NoMotion, Turntable
from studio.project.document import replaced
from studio.project.project import Project
from studio.study.scan_apart import frames_of, scan_apart

MOTION = ("scene", "motion")


def begun() -> Project:
    return replaced(Project.load("sphere"), MOTION, LinearStage(step=(0.0, 0.005, 0.0), steps=20))


def test_each_field_is_told_as_it_was_and_as_it_is() -> None:
    now = replaced(begun(), MOTION, LinearStage(step=(0.0, 0.01, 0.0), steps=9))
    now = replaced(now, ("sensor", "exposure_time"), 0.004)
    assert scan_apart(begun(), now) == (
        "Motion: Step: 0, 5, 0 mm → 0, 10, 0 mm",
        "Motion: Frames: 20 → 9",
        "Sensor: Exposure time: 3.3 ms → 4 ms",
    )


def test_names_and_what_nobody_sees_are_no_other_scan() -> None:
    one = replaced(begun(), ("scene", "objects", 0, "visible"), False)
    now = replaced(replaced(one, ("name",), "another"), ("scene", "objects", 0, "name"), "hidden")
    assert scan_apart(one, now) == ()


def test_frames_are_told_with_their_step() -> None:
    assert frames_of(begun().scene.motion) == "20 frames of 5 mm"
    assert frames_of(Turntable(steps=1, angle_step=0.5)).startswith("1 frame of 28.6")
    assert frames_of(NoMotion()) == "1 frame"
