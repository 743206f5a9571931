"""What the project does not take is told in the window's words, with the way out."""

from __future__ import annotations

import pytest

from render.base.errors import InputError
from render.scene.motion import LinearStage
from studio.editing.refusals import WAY_OUT, refusal
from studio.editing.scene_edits import add_laser, set_motion
from studio.project.calibration import Calibration
from studio.project.document import replaced
from studio.project.found_motion import FoundTurntable
from studio.project.project import Project


def test_a_second_laser_that_the_calibration_lacks_is_told_with_the_way_out() -> None:
    project = replaced(Project.load("plane"), ("calibration",), Calibration(planes=((0.0, 0.6, 0.8, -0.1),)))
    with pytest.raises(InputError) as raised:
        add_laser(project)
    expected = f"the number of lasers of the calibration is 1, and the project would have 2: {WAY_OUT}"
    assert refusal(raised.value) == expected


def test_another_motion_than_the_calibrated_one_is_told_with_the_way_out() -> None:
    found = FoundTurntable.model_construct()
    project = replaced(Project.load("plane"), ("calibration",), Calibration.model_construct(motion=found))
    with pytest.raises(InputError) as raised:
        set_motion(project, LinearStage)
    told = refusal(raised.value)
    assert told.startswith("the motion of the calibration is of kind") and told.endswith(WAY_OUT)


def test_other_refusals_are_as_they_are() -> None:
    error = InputError("albedo is out of range", where="scene.objects[0]", allowed="0 to 1")
    assert refusal(error) == str(error)
