"""A focus that a person types keeps the lens's focal length, as its ring does; a project's own edit keeps fx."""

from __future__ import annotations

import pytest
from pydantic import BaseModel

from render.base.errors import InputError
from studio.editing.forms import FieldSpec, describe, edited
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.templates import template_folder

CAMERA = ("scene", "rig", "camera")


@pytest.fixture(scope="module")
def project() -> Project:
    return Project.load(template_folder("weld_seam") / "project.json")


def spec(model: BaseModel, name: str) -> FieldSpec:
    return next(field for field in describe(model) if field.name == name)


@pytest.mark.parametrize(
    ("focus", "image_distance", "fx"),
    [(0.4937, 16.536e-3, 4793.0), (0.3, 16.901e-3, 4899.0), (None, 16e-3, 4637.7)],
)
def test_a_typed_focus_keeps_the_focal_length(
    project: Project, focus: float | None, image_distance: float, fx: float
) -> None:
    """A lens of 16 mm focused at 0.49 m became one of 15.79 mm."""
    far = replaced(project, (*CAMERA, "lens", "focus_distance"), None)
    far = edited(far, CAMERA, spec(far.scene.camera, "image_distance"), 0.016)
    far = replaced(far, (*CAMERA, "cx"), 1202.3)
    own = spec(far.scene.camera.lens, "focus_distance")
    for start in (far, edited(far, (*CAMERA, "lens"), own, 0.8)):
        camera = edited(start, (*CAMERA, "lens"), own, focus).scene.camera
        assert camera.focal_length == pytest.approx(0.016, rel=1e-12)
        assert camera.image_distance == pytest.approx(image_distance, abs=1e-6)
        assert camera.fx == pytest.approx(fx, abs=1.0) and camera.fy == pytest.approx(camera.fx)
        assert (camera.cx, camera.distortion) == (1202.3, start.scene.camera.distortion)
        again = edited(start, (*CAMERA, "lens"), own, start.scene.camera.lens.focus_distance)
        assert again.scene.camera == start.scene.camera, "the same focus changes nothing"
    with pytest.raises(InputError, match="more than the focal length, 16 mm"):
        edited(far, (*CAMERA, "lens"), own, 0.015)


def test_a_camera_that_was_measured_keeps_its_principal_point_and_the_ratio_of_its_sides(project: Project) -> None:
    measured = replaced(
        project,
        CAMERA,
        {
            **{name: getattr(project.scene.camera, name) for name in type(project.scene.camera).model_fields},
            "fx": 3501.2,
            "fy": 3498.7,
            "cx": 1202.3,
            "cy": 1030.1,
            "distortion": (-0.1, 0.05, 1e-4, -2e-4),
        },
    )
    before = measured.scene.camera
    after = edited(measured, (*CAMERA, "lens"), spec(before.lens, "focus_distance"), 0.4).scene.camera
    assert after.fx > before.fx and after.focal_length == pytest.approx(before.focal_length, rel=1e-12)
    assert after.fy / after.fx == pytest.approx(before.fy / before.fx, rel=1e-12)
    kept = {"lens", "fx", "fy"}
    assert after.model_dump(exclude=kept) == before.model_dump(exclude=kept)
    plain = replaced(measured, (*CAMERA, "lens", "focus_distance"), 0.4).scene.camera
    assert plain.fx == before.fx, "a study, or an edit of the file, is taken as it is"
