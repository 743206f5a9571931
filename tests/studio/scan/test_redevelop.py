"""Redevelopment: what makes a render stale, and developing it again agrees with rendering it again."""

from __future__ import annotations

import math

import numpy as np
import pytest

from render.base.pose import Pose
from render.frame import Frame
from render.render import render_world
from render.scene.motion import LinearStage, PoseList
from render.scene.scene import SceneObject
from render.scene.shape import MeshFile
from render.world.world import World, build_world
from studio.project.calibration import Calibration
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.redevelop import develop_again, development, is_stale, measure_again
from studio.scan.stages import scaled

SCALE = 0.1


@pytest.fixture(scope="module")
def project() -> Project:
    return Project.load(template_folder("sphere") / "project.json")


@pytest.fixture(scope="module")
def rendered(project: Project) -> tuple[Project, World, Frame]:
    small = scaled(project, SCALE)
    world = build_world(small.scene, template_folder("sphere"))
    return small, world, render_world(world, small.scene, settings=small.render, axis=small.extraction.axis)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("sensor", "exposure_time"), 3e-3),
        (("sensor", "bits"), 8),
        (("scene", "rig", "lasers", 0, "power"), 0.005),
        (("scene", "rig", "lasers", 0, "name"), "blue"),
        (("scene", "rig", "camera", "lens", "f_number"), 4.0),
        (("scene", "objects", 0, "name"), "ball"),
        (("extraction", "method"), "gaussian"),
        (("extraction", "threshold"), 7.0),
    ],
)
def test_what_developing_decides_leaves_a_render_valid(project, path, value):
    assert not is_stale(project, replaced(project, path, value))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("scene", "objects", 0, "scale"), 1.1),
        (("scene", "objects", 0, "visible"), False),
        (("scene", "rig", "camera", "fx"), 3000.0),
        (("scene", "rig", "lasers", 0, "fan_angle"), math.radians(30)),
        (("scene", "rig", "lasers", 0, "wavelength_nm"), 650.0),
        (("scene", "rig", "lasers"), ()),
        (("extraction", "axis"), "columns"),
    ],
)
def test_what_light_meets_makes_it_stale(project, path, value):
    assert is_stale(project, replaced(project, path, value))


def test_a_motion_leaves_a_still_of_its_beginning_as_it_was(project):
    """A scan was set up after the first picture, which was then called one of another scene."""
    moving = replaced(project, ("scene", "motion"), LinearStage(step=(0.0, 0.001, 0.0)))
    assert is_stale(project, moving) and not is_stale(project, moving, still=True)
    assert not is_stale(moving, project, still=True)
    displaced = replaced(project, ("scene", "motion"), PoseList(poses=(Pose(translation=(0.0, 0.01, 0.0)),)))
    assert is_stale(project, displaced, still=True)
    assert is_stale(project, replaced(moving, ("scene", "objects", 0, "scale"), 1.1), still=True)


def test_an_aperture_that_was_rendered_stays_in_its_frame(project):
    f_number = ("scene", "rig", "camera", "lens", "f_number")
    thin = replaced(project, ("scene", "rig", "camera", "lens", "model"), "thin-lens")
    assert is_stale(project, thin) and is_stale(thin, project)
    wider = replaced(thin, f_number, 2.0)
    assert is_stale(thin, wider)
    assert not is_stale(thin, replaced(thin, ("scene", "rig", "camera", "lens", "transmission"), 0.5))
    # what is developed meanwhile is the frame as it is, with the light of its own aperture
    assert development(thin, wider).project.scene.camera.lens == thin.scene.camera.lens
    assert development(project, replaced(thin, f_number, 2.0)).project.scene.camera.lens.model == "pinhole"
    assert development(project, replaced(thin, f_number, 2.0)).project.scene.camera.lens.f_number == 2.0


def test_a_hidden_object_may_change_unseen(project):
    hidden = replaced(project, ("scene", "objects", 0, "visible"), False)
    assert not is_stale(hidden, replaced(hidden, ("scene", "objects", 0, "scale"), 2.0))


def test_a_laser_switched_on_needs_a_render(project):
    off = replaced(project, ("scene", "rig", "lasers", 0, "power"), 0.0)
    assert is_stale(off, project) and not is_stale(project, off)


def test_developing_again_is_what_a_new_render_would_give(project, rendered):
    small, world, frame = rendered
    now = replaced(project, ("scene", "rig", "lasers", 0, "power"), project.scene.lasers[0].power / 2)
    now = replaced(now, ("scene", "rig", "camera", "lens", "f_number"), 2.0)
    now = replaced(now, ("sensor", "exposure_time"), project.sensor.exposure_time * 3)
    again = develop_again(frame, development(small, now, SCALE), noise=False)[0]
    anew = scaled(now, SCALE)
    whole = render_world(world, anew.scene, settings=anew.render, axis=anew.extraction.axis)
    expected = develop_again(whole, development(anew, now, SCALE), noise=False)[0]
    # half the power is rounded once more in float32: a pixel may fall on the other side of a step
    assert np.abs(again.pixels.astype(int) - expected.pixels.astype(int)).max() <= 1
    assert np.mean(again.pixels != expected.pixels) < 1e-3


def test_a_stale_render_is_developed_with_its_own_geometry(project, rendered):
    small, _, frame = rendered
    now = replaced(project, ("scene", "rig", "camera", "width"), 1000)
    now = replaced(
        now, ("scene", "rig", "lasers"), (*now.scene.lasers, now.scene.lasers[0].model_copy(update={"name": "b"}))
    )
    images = develop_again(frame, development(small, now, SCALE))
    assert len(images) == 1 and images[0].pixels.shape == frame.shape


def test_points_of_a_render_are_made_with_the_present_calibration(project, rendered):
    """A plane 1 mm farther off than it is moves every point by the same share of its distance."""
    small, world, frame = rendered
    a, b, c, d = project.scene.laser_plane(0).tolist()
    now = replaced(project, ("calibration",), Calibration(planes=((a, b, c, d - 1e-3),)))
    assert not is_stale(project, now)
    depth = []
    for which in (project, now):
        how = development(small, which, SCALE)
        found = measure_again(
            frame, world, how, develop_again(frame, how, noise=False), ("likelihood",), cancelled=lambda: False
        )
        depth.append(found["likelihood"][0].points.depth_z)
    both = np.isfinite(depth[0]) & np.isfinite(depth[1])
    assert both.sum() > 20
    assert depth[1][both] / depth[0][both] == pytest.approx(1.0 + 1e-3 / abs(d), rel=1e-9)
    other = project.scene.lasers[0].model_copy(update={"name": "b"})
    more = replaced(project, ("scene", "rig", "lasers"), (*project.scene.lasers, other))
    assert development(small, more, SCALE).project.calibration == small.calibration


def test_every_method_measures_every_laser(project, rendered):
    small, world, frame = rendered
    how = development(small, project, SCALE)
    found = measure_again(
        frame, world, how, develop_again(frame, how), ("likelihood", "gaussian"), cancelled=lambda: False
    )
    assert [m.line.method for m in (found["likelihood"][0], found["gaussian"][0])] == ["likelihood", "gaussian"]
    assert found["likelihood"][0].errors.completeness > 0.9


def test_saving_which_signs_mesh_files_makes_no_render_stale_and_another_file_does():
    ball = Project.load(template_folder("sphere") / "project.json")

    def signed(digest: str | None) -> Project:
        part = SceneObject(name="part", shape=MeshFile(path="part.stl", sha256=digest))
        return replaced(ball, ("scene", "objects"), (*ball.scene.objects, part))

    unsigned, one, other = signed(None), signed("a" * 64), signed("b" * 64)
    assert not is_stale(unsigned, one) and not is_stale(one, unsigned)
    assert is_stale(one, other)
