"""A line that all scan lines see at one place between two pixels is no sample of a method's error, and it is told."""

from __future__ import annotations

from pathlib import Path

from studio.study.one_phase import one_phase_doubts
from studio.study.study import Parameter, Study, Sweep, base_project, ready_made

ROLL = "scene.rig.camera.T_rig_camera.rotation[2]"
SWEEP = Sweep(name="light", vary=(Parameter(field="sensor.exposure_time", values=(0.001,)),))


def doubts(base: str, **fixed: float) -> tuple[str, ...]:
    study = Study(base=base, set=fixed, sweeps=(SWEEP,), image_scale=0.25)
    return one_phase_doubts(study, study.bases(Path()))


def test_a_line_along_the_columns_is_told_and_a_rolled_camera_cures_it() -> None:
    (told,) = doubts("plane")
    assert "one place between two pixels" in told and base_project("plane", Path()).name in told
    assert not doubts("plane", **{ROLL: 0.03})


def test_a_line_that_bends_over_the_part_meets_the_pixels_everywhere() -> None:
    assert not doubts("weld_seam")


def test_no_ready_made_study_asks_a_method_at_one_place_between_two_pixels() -> None:
    for name in ready_made():
        study, root = Study.load(name)
        assert not one_phase_doubts(study, study.bases(root)), name
