"""The preview answers as the renderer does, and moves without rebuilding anything."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from render.base.errors import InputError
from render.base.pose import Pose
from render.laser.laser import LineLaser
from render.laser_direct.integrator import direct_image
from render.material.material import Lambertian, Texture
from render.scene.motion import LinearStage
from render.scene.scene import SceneObject
from render.scene.shape import Box, MeshFile, Plane, Sphere
from render.truth.laser_curve import laser_curve
from render.truth.pixel_truth import truth_images
from render.world.world import build_world
from studio.preview.preview import Look, Preview
from studio.preview.problem_fields import problem_fields
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.templates import DESCRIPTIONS

PROJECTS = Path(__file__).parents[3] / "assets/projects"
SCENE = ("scene",)
OBJECTS = (*SCENE, "objects")


def sample(name: str) -> tuple[Project, Path]:
    folder = PROJECTS / name
    return Project.load(folder / "project.json"), folder


@pytest.fixture(scope="module")
def crowded() -> tuple[Project, Path]:
    """A plate, and before it a tilted box and a ball that throw shadows on it and hide parts of the line."""
    project, root = sample("plane")
    camera = project.scene.T_world_camera()

    def before_camera(x: float, y: float, z: float, turn: float) -> Pose:
        return Pose.from_matrix(camera) @ Pose(translation=(x, y, z), rotation=(0.3, turn, 0.2))

    objects = (
        SceneObject(name="plate", shape=Plane(width=0.8, height=0.8), T_world_object=before_camera(0, 0, 0.95, 0.1)),
        SceneObject(name="box", shape=Box(size_x=0.12, size_y=0.05, size_z=0.1), scale=0.8,
                    T_world_object=before_camera(0.0, -0.06, 0.85, 0.5)),
        SceneObject(name="ball", shape=Sphere(radius=0.04, segments=96),
                    T_world_object=before_camera(0.01, 0.08, 0.87, 0.0)),
    )  # fmt: skip
    return replaced(project, OBJECTS, objects), root


@pytest.mark.parametrize("name", DESCRIPTIONS)
def test_every_template_is_shown_whole(name: str) -> None:
    project, root = sample(name)
    preview = Preview(1)
    look = preview.look(project, root)
    assert not preview.errors and len(look.placed) == len(project.scene.visible_objects)
    assert sum(len(look.lit_curve(i).index) for i in range(len(project.scene.lasers))) > 100


def both_curves(project: Project, root: Path, step: int = 0, laser: int = 0):
    scene = project.scene
    world = build_world(scene, root, step)
    axis = project.extraction.axis
    poses = scene.T_world_camera(step), scene.T_world_laser(laser, step)
    exact = laser_curve(world, scene.camera, scene.lasers[laser], *poses, axis)
    return Preview(1).look(project, root, step).lit_curve(laser), exact


def assert_same_curve(project: Project, root: Path, step: int = 0) -> None:
    preview, exact = both_curves(project, root, step)
    assert len(exact.index) > 100
    np.testing.assert_array_equal(preview.index, exact.index)
    np.testing.assert_array_equal(preview.object_id, exact.object_id)
    np.testing.assert_allclose(preview.position, exact.position, rtol=0, atol=1e-6)
    np.testing.assert_allclose(preview.point, exact.point, rtol=0, atol=1e-9)
    np.testing.assert_allclose(preview.irradiance, exact.irradiance, rtol=1e-6)
    np.testing.assert_allclose(preview.camera_angle, exact.camera_angle, rtol=0, atol=1e-6)
    np.testing.assert_allclose(preview.laser_angle, exact.laser_angle, rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", ["weld_seam", "shiny_weld_seam", "sphere", "step_block", "v_groove"])
def test_the_lit_curve_is_that_of_the_merged_world(name: str) -> None:
    assert_same_curve(*sample(name))


def test_objects_hide_and_shadow_one_another_as_in_the_merged_world(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    assert_same_curve(project, root)
    objects = np.unique(Preview(1).look(project, root).lit_curve(0).object_id)
    assert objects.tolist() == [0, 1, 2]


def test_distortion_and_columns_are_followed(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    project = replaced(project, (*SCENE, "rig", "camera", "distortion"), (-0.2, 0.1, 0.001, -0.001))
    assert_same_curve(project, root)
    # a laser above the camera, its sheet across the image
    pose = Pose(translation=(0.0, -0.2, 0.0)) @ Pose(rotation=(-math.radians(13), 0, 0))
    pose = pose @ Pose(rotation=(0, 0, math.pi / 2))
    project = replaced(project, (*SCENE, "rig", "lasers", 0, "T_rig_laser"), pose)
    assert_same_curve(replaced(project, ("extraction", "axis"), "columns"), root)


def test_moving_objects_stand_where_the_step_puts_them(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    motion = LinearStage(moves="objects", step=(0.001, 0.004, 0.002), steps=10)
    assert_same_curve(replaced(project, (*SCENE, "motion"), motion), root, step=7)


def test_random_poses_give_the_merged_worlds_curve(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    random = np.random.default_rng(5)
    for _ in range(6):
        for i in (1, 2):
            path = (*OBJECTS, i, "T_world_object")
            pose = project.scene.objects[i].T_world_object @ Pose(
                translation=tuple(random.normal(0, 0.005, 3).tolist()),
                rotation=tuple(random.normal(0, 0.2, 3).tolist()),
            )
            project = replaced(project, path, pose)
        assert_same_curve(project, root)


def test_a_move_rebuilds_nothing(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    preview = Preview(1)
    before = preview.look(project, root)
    moved = replaced(project, (*OBJECTS, 1, "T_world_object", "translation"), (0.0, 0.01, 0.02))
    assert preview.missing(moved, root) == []
    after = preview.look(moved, root)
    assert [item.body for item in after.placed] == [item.body for item in before.placed]
    painted = replaced(project, (*OBJECTS, 1, "material", "albedo"), 0.2)
    assert [item.name for item in preview.missing(painted, root)] == ["box"]
    assert preview.look(painted, root).placed[1].body.rays is before.placed[1].body.rays


def test_albedo_and_normals_along_the_curve_are_the_surfaces(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    project = replaced(project, (*OBJECTS, 2, "material", "albedo"), (0.9, 0.5, 0.1))
    project = replaced(project, (*SCENE, "environment", "radiance"), (1.0, 1.0, 1.0))
    project = replaced(project, (*SCENE, "lights"), ())
    lit = Preview(1).look(project, root).lit(0)
    ball, plate = lit.curve.object_id == 2, lit.curve.object_id == 0
    np.testing.assert_allclose(lit.unshadowed[ball], np.broadcast_to((0.9, 0.5, 0.1), (ball.sum(), 3)))
    np.testing.assert_allclose(lit.unshadowed[plate], 0.5)
    to_camera = -lit.curve.point / lit.curve.depth_range[:, None]
    cosine = np.einsum("ij,ij->i", lit.normal, to_camera)
    np.testing.assert_allclose(np.arccos(cosine), lit.curve.camera_angle, atol=1e-7)
    T_camera_plate = np.linalg.inv(project.scene.T_world_camera()) @ project.scene.objects[0].T_world_object.matrix
    np.testing.assert_allclose(np.abs(lit.normal[plate] @ T_camera_plate[:3, 2]), 1.0, atol=1e-12)


def test_the_picture_shows_the_surfaces_that_the_truth_names(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    image = Preview(2).look(project, root).image(0.125)
    world = build_world(project.scene, root)
    truth = truth_images(world, project.scene.camera.scaled(0.125), project.scene.T_world_camera())
    assert np.mean(image.object_id == truth.object_id) > 0.9999
    same = (image.object_id == truth.object_id) & (image.object_id >= 0)
    np.testing.assert_allclose(image.depth_z[same], truth.depth_z[same], rtol=3e-6)
    assert np.isnan(image.depth_z[image.object_id < 0]).all()
    assert (image.shade[image.object_id < 0] == 0.0).all()
    # the box's faces differ in shade, and nothing is brighter than its albedo
    assert 0.0 < image.shade.max() <= 0.5 + 1e-6


def test_the_pictures_laser_light_is_that_of_a_render(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    scene = project.scene
    preview = Preview(1).look(project, root).image(0.25).laser[0].astype(np.float64)
    world = build_world(scene, root)
    exact = direct_image(
        world, scene.camera.scaled(0.25), scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0), target=0.01
    ).radiance.astype(np.float64)
    rows = exact.sum(axis=1)
    # one ray a pixel misses what happens inside of it, at the edges; whole rows agree in the mean
    ratio = preview.sum(axis=1)[rows > 0] / rows[rows > 0]
    assert abs(np.median(ratio) - 1.0) < 0.01
    assert preview.sum() == pytest.approx(exact.sum(), rel=0.005)


def test_a_laser_that_only_grazes_the_scene_has_an_empty_curve(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    away = LineLaser(T_rig_laser=Pose(rotation=(0, math.pi, 0), translation=(0.2, 0, 0)))
    look = Preview(1).look(replaced(project, (*SCENE, "rig", "lasers"), (away,)), root)
    assert len(look.lit_curve(0).index) == 0 and look.lit(0).unshadowed.shape == (0, 3)
    fan = look.fan(0)
    assert not np.isfinite(fan.distance).any() and fan.occluded is None
    assert look.image(1 / 16).laser[0].max() == 0.0


def test_an_empty_scene_can_be_looked_at() -> None:
    project, root = sample("plane")
    look = Preview(1).look(replaced(project, OBJECTS, ()), root)
    assert len(look.lit_curve(0).index) == 0
    assert (look.image(1 / 16).object_id == -1).all()


def test_a_missing_mesh_is_named_and_the_rest_still_shown(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    lost = SceneObject(name="lost", shape=MeshFile(path="nowhere.ply"))
    preview = Preview(1)
    look = preview.look(replaced(project, OBJECTS, (*project.scene.objects, lost)), root)
    assert len(look.placed) == 3 and len(look.lit_curve(0).index) > 100
    assert list(preview.errors) == ["lost"] and isinstance(preview.errors["lost"], InputError)
    preview.look(project, root)
    assert preview.errors == {}


def test_a_part_of_an_impossible_material_stays_in_grey_and_is_named(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    lost = Lambertian(albedo=Texture(path="nowhere.png"))
    preview = Preview(1)
    whole = preview.look(project, root)
    for i, item in enumerate(project.scene.objects):
        look = preview.look(replaced(project, (*OBJECTS, i, "material"), lost), root)
        assert [one.index for one in look.placed] == [one.index for one in whole.placed]
        assert list(preview.errors) == [item.name]
        assert np.array_equal(look.lit_curve(0).point, whole.lit_curve(0).point)
        assert [path[:4] for path in problem_fields(look, preview.errors)] == [(*OBJECTS, i, "material")]


def test_an_error_is_put_down_to_the_field_it_names() -> None:
    project, root = sample("plane")
    preview = Preview(1)
    item = project.scene.objects[0]
    for where, field in (
        (f"object {item.name!r}: material.base.albedo.path", ("material", "base", "albedo", "path")),
        (f"object {item.name!r}: material/plane.stl", ("material",)),
        (f"object {item.name!r}", ("material",)),
    ):
        look = preview.look(project, root)
        told = problem_fields(look, {item.name: InputError("it cannot be", where=where, cure="choose another")})
        assert told == {(*OBJECTS, 0, *field): f"{', '.join(field).capitalize()}: it cannot be; choose another"}
    empty = preview.look(replaced(project, (*OBJECTS, 0, "visible"), False), root)
    assert list(problem_fields(empty, {item.name: InputError("lost")})) == [(*OBJECTS, 0, "shape")]


def test_nothing_is_loaded_when_the_caller_cannot_wait(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    preview = Preview(1)
    assert preview.look(project, root, wait=False).placed == ()
    assert [item.name for item in preview.missing(project, root)] == ["plate", "box", "ball"]


def fan_of(project: Project, root: Path) -> tuple[Look, np.ndarray]:
    look = Preview(1).look(project, root)
    return look, look.fan(0).distance


def test_the_fan_ends_where_the_first_surface_is(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    look, distance = fan_of(project, root)
    fan = look.fan(0)
    assert np.isfinite(distance).mean() > 0.5
    # a hit on the plate lies in its plane, and some rays are stopped before it
    T = np.linalg.inv(project.scene.objects[0].T_world_object.matrix)
    local = (fan.origin + fan.distance[:, None] * fan.direction)[np.isfinite(distance)] @ T[:3, :3].T + T[:3, 3]
    assert np.sum(np.abs(local[:, 2]) < 1e-9) > 100
    assert np.sum(local[:, 2] > 0.02) > 20 or np.sum(local[:, 2] < -0.02) > 20


def test_the_occluded_share_grows_when_something_stands_before_the_line() -> None:
    project, root = sample("plane")
    camera = project.scene.T_world_camera()
    free = Preview(1).look(project, root).fan(0)
    assert free.occluded == pytest.approx(0.0, abs=1e-12)
    # a card near the camera that covers the upper half of its view, away from the sheet
    pose = Pose.from_matrix(camera) @ Pose(translation=(0.0, -0.1, 0.2))
    card = SceneObject(name="card", shape=Plane(width=0.05, height=0.2), T_world_object=pose)
    hidden = Preview(1).look(replaced(project, OBJECTS, (*project.scene.objects, card)), root).fan(0)
    assert hidden.occluded is not None and 0.3 < hidden.occluded < 0.7


def test_the_picture_shrinks_when_time_is_short(crowded: tuple[Project, Path]) -> None:
    project, root = crowded
    look = Preview(1).look(project, root)
    large, small = look.image(seconds=0.2), None
    preview = Preview(1)
    preview.speed.pixels_per_second = 1e6
    small = preview.look(project, root).image(seconds=0.005)
    assert small.camera.width * small.camera.height <= 5000 < large.camera.width * large.camera.height
