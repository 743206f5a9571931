"""What the 3D view draws: shadows cut from sheets, joined curves, the volume that is both lit and seen."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from render.base.pose import Pose, transform_points
from render.scene.motion import Turntable
from render.scene.scene import SceneObject
from render.scene.shape import Plane
from studio.editing.placement import working_distance
from studio.preview.preview import Look, Preview
from studio.preview.rig_drawing import (
    fan_points,
    focus_corners,
    glyph_size,
    grid,
    hidden_line,
    image_corners,
    joined,
    reach_of,
    turning,
    working_volume,
)
from studio.project.document import replaced
from studio.project.project import Project

PROJECTS = Path(__file__).parents[3] / "assets/projects"


def look_at(name: str, *more: SceneObject) -> Look:
    project = Project.load(PROJECTS / name / "project.json")
    project = replaced(project, ("scene", "objects"), (*project.scene.objects, *more))
    return Preview(1).look(project, PROJECTS / name)


def card(look: Look) -> SceneObject:
    """A small card that stands in the sheet, half way to the part."""
    T = look.scene.T_world_laser(0)
    pose = Pose.from_matrix(T) @ Pose(translation=(0.0, 0.05, 0.4))
    return SceneObject(name="card", shape=Plane(width=0.02, height=0.05), T_world_object=pose)


def test_a_sheet_that_is_aimed_past_everything_leaves_the_rig_as_large_as_it_was() -> None:
    """The boxes of camera and laser were hundreds of pixels wide, and the part was a speck."""
    scene = look_at("plane").scene
    (laser,) = scene.lasers
    turned = Rotation.from_rotvec(laser.T_rig_laser.rotation) * Rotation.from_rotvec((0.0, math.radians(12.0), 0.0))
    pose = laser.T_rig_laser.model_copy(update={"rotation": tuple(turned.as_rotvec())})
    project = Project.load(PROJECTS / "plane" / "project.json")
    aimed = replaced(project, ("scene", "rig", "lasers", 0, "T_rig_laser"), pose).scene
    assert working_distance(aimed) > 10.0 * working_distance(scene)
    assert glyph_size(scene) < glyph_size(aimed) < 2.5 * glyph_size(scene)


def test_the_sheet_ends_at_what_it_meets_first() -> None:
    free = look_at("plane")
    shaded = look_at("plane", card(free))
    before, after = (fan_points(look.fan(0), 2.0) for look in (free, shaded))
    assert before.shape == after.shape == (513, 3)
    np.testing.assert_array_equal(before[0], free.scene.T_world_laser(0)[:3, 3])
    local = transform_points(np.linalg.inv(shaded.scene.T_world_laser(0)), after[1:])
    stopped = np.abs(local[:, 2] - 0.4) < 1e-9
    # the card covers y from 0.025 to 0.075 of the sheet at z = 0.4
    y = np.tan(np.linspace(-0.5, 0.5, 512) * shaded.scene.lasers[0].fan_angle) * 0.4
    np.testing.assert_array_equal(stopped, (y > 0.025) & (y < 0.075))
    np.testing.assert_array_equal(before[1:][~stopped], after[1:][~stopped])


def test_a_curve_is_joined_where_it_goes_on_and_broken_where_it_jumps() -> None:
    look = look_at("plane")
    shaded = look_at("plane", card(look))
    whole, broken = look.lit_curve(0), shaded.lit_curve(0)
    assert len(joined(whole)) == len(whole.index) - 1
    pairs = joined(broken)
    lengths = np.linalg.norm(broken.point[pairs[:, 1]] - broken.point[pairs[:, 0]], axis=1)
    assert lengths.max() < 5 * np.median(lengths)
    assert len(pairs) < len(broken.index) - 1
    assert set(np.unique(pairs)) == set(range(len(broken.index)))


def test_the_line_that_the_camera_does_not_see_is_drawn_apart() -> None:
    look = look_at("weld_seam")
    points, pairs = hidden_line(look.fan(0))
    fan = look.fan(0)
    assert not fan.seen[pairs].any() and np.isfinite(points).all()


def test_the_working_volume_is_lit_and_in_the_image() -> None:
    look = look_at("plane")
    scene = look.scene
    reach = reach_of(scene, [look.fan(0)])
    polygon = working_volume(scene.camera, scene.lasers[0], scene.T_camera_laser(0), reach)
    assert len(polygon) >= 3
    local = transform_points(np.linalg.inv(scene.T_camera_laser(0)), polygon)
    np.testing.assert_allclose(local[:, 0], 0.0, atol=1e-12)
    assert (np.abs(local[:, 1]) <= local[:, 2] * scene.lasers[0].tan_half_fan + 1e-12).all()
    pixels, valid = scene.camera.project(polygon)
    assert valid.all()
    assert (pixels > -0.5 - 1e-6).all()
    assert (pixels < np.array([scene.camera.width, scene.camera.height]) - 0.5 + 1e-6).all()
    # and it is all of it: a point of the line that is in the image lies within
    nearest = polygon[:, 2].min()
    assert nearest == pytest.approx(0.3433, abs=0.003)


def test_the_frustums_corners_are_the_images() -> None:
    camera = look_at("plane").scene.camera
    pixels, _ = camera.project(image_corners(camera, 0.5))
    w, h = camera.width - 0.5, camera.height - 0.5
    np.testing.assert_allclose(pixels, [[-0.5, -0.5], [w, -0.5], [w, h], [-0.5, h]], atol=1e-6)


def test_the_frustum_ends_on_the_plane_of_focus_which_tilts_with_the_sensor() -> None:
    scene = look_at("plane").scene
    straight = focus_corners(scene)
    np.testing.assert_allclose(straight[:, 2], scene.camera.lens.focus_distance)
    distortion = (0.0,) * 12 + (np.radians(0.3), np.radians(0.6))
    camera = scene.camera.model_copy(update={"distortion": distortion})
    tilted = focus_corners(scene.model_copy(update={"rig": scene.rig.model_copy(update={"camera": camera})}))
    np.testing.assert_allclose(tilted @ camera.focus_plane[:3], 1.0)
    assert np.ptp(tilted[:, 2]) > 0.1
    # where nothing is in focus the edges end somewhere
    away = camera.model_copy(update={"distortion": (0.0,) * 13 + (1.3,)})
    far = focus_corners(scene.model_copy(update={"rig": scene.rig.model_copy(update={"camera": away})}))
    assert np.isfinite(far).all() and 0.0 < far[:, 2].max() < 20.0


def test_the_grid_has_round_steps_and_covers_the_scene() -> None:
    for size in (0.013, 0.4, 7.0, 300.0):
        step, lines = grid(np.array([-size, -size / 3, 0.0]), np.array([size / 2, size, 1.0]))
        assert round(step / 10.0 ** np.floor(np.log10(step) + 1e-9), 6) in (1, 2, 5)
        assert lines[..., 0].min() < -size and lines[..., 1].max() > size
        assert 10 <= len(lines) <= 60


@pytest.mark.parametrize("step", [0.2, -0.2])
def test_a_turntable_s_axis_goes_through_the_part_and_its_arrow_the_way_of_a_step(step: float) -> None:
    motion = Turntable(centre=(0.1, 0.2, 0.05), axis=(1.0, -2.0, 5.0), angle_step=step, steps=9)
    low, high = np.array([-0.1, 0.0, 0.0]), np.array([0.3, 0.4, 0.2])
    points, lines = turning(motion, low, high, 0.01)
    (first, last), axis = points[:2], np.array(motion.axis) / np.linalg.norm(motion.axis)
    assert np.linalg.norm(np.cross(last - first, axis)) < 1e-12
    assert np.linalg.norm(np.cross(first - np.array(motion.centre), axis)) < 1e-12
    corners = np.array(np.meshgrid(*np.stack([low, high]).T)).reshape(3, -1).T @ axis
    assert first @ axis < corners.min() and last @ axis > corners.max()
    # every chord of the arc goes on as the motion's own step moves its beginning
    for begin, end in lines[1:-2]:
        moved = transform_points(motion.displacement(1), points[begin : begin + 1])[0] - points[begin]
        assert moved @ (points[end] - points[begin]) > 0.0
    tip, ends = points[lines[-1][0]], points[[line[1] for line in lines[-2:]]]
    onward = transform_points(motion.displacement(1), tip[None])[0] - tip
    assert np.all((ends - tip) @ onward < 0.0), "an arrow's head lies behind its tip"
    assert len(turning(motion.model_copy(update={"angle_step": 0.0}), low, high, 0.01)[1]) == 1
