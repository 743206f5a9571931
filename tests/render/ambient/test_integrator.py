import numpy as np
import pytest

from render.ambient.integrator import ambient_image
from render.base.pose import Pose
from render.mesh.primitives import primitive_mesh
from render.run import Run
from render.scene.lights import Environment, PointLight, RectangleLight
from render.scene.shape import Box
from tests.render.scenes import moved, paper_camera, plane_mesh, scene_of, world_of


def image_of(meshes, samples=16, **parts):
    scene = scene_of(paper_camera(0.05), objects=len(meshes), **parts)
    world = world_of(scene, *meshes)
    return scene, ambient_image(world, scene, scene.camera, scene.T_world_camera(), samples=samples)


def test_an_unshadowed_wall_under_a_constant_sky_has_radiance_albedo_times_sky():
    _, image = image_of([plane_mesh((0.2, 0.1, 1), 0.9)], environment=Environment(radiance=(1.0, 2.0, 0.5)))
    assert image == pytest.approx(np.broadcast_to([0.5, 1.0, 0.25], image.shape), rel=1e-5)


def test_the_sky_itself_is_seen_past_the_objects():
    box = moved(primitive_mesh(Box(size_x=0.01, size_y=0.01, size_z=0.01)), (0, 0, 0.9))
    _, image = image_of([box], environment=Environment(radiance=(1.0, 2.0, 0.5)))
    assert image[0, 0] == pytest.approx([1.0, 2.0, 0.5], rel=1e-5)


def test_a_point_light_falls_off_with_distance_and_cosine():
    light = PointLight(intensity=(3.0, 2.0, 1.0), T_world_light=Pose(translation=(0.3, 0.1, 0.1)))
    scene, image = image_of([plane_mesh((0, 0, 1), 0.9)], lights=(light,))
    v, u = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
    rays, _ = scene.camera.rays(np.stack([u, v], axis=-1))
    towards = np.array([0.3, 0.1, 0.1]) - rays * (0.9 / rays[..., 2:])
    distance = np.linalg.norm(towards, axis=-1)
    expected = 3.0 * (0.8 / distance) / distance**2 * 0.5 / np.pi
    assert image[..., 0] == pytest.approx(expected, rel=2e-3)
    assert image[..., 1] * 1.5 == pytest.approx(image[..., 0], rel=1e-5)


def test_a_rectangle_has_the_form_factor_of_a_parallel_rectangle():
    # differential area below the corner of a parallel rectangle a x b at c (Howell, A catalog of radiation
    # configuration factors, B-3); four corners make the centred one
    half, height = 0.25, 0.8
    light = RectangleLight(
        radiance=(1.0, 1.0, 1.0), width=2 * half, height=2 * half, T_world_light=Pose(translation=(0, 0, 0.1))
    )
    x = half / height
    root = np.sqrt(1 + x * x)
    factor = 4 * (2 * x / root * np.arctan(x / root)) / (2 * np.pi)
    _, image = image_of([plane_mesh((0, 0, 1), 0.9)], samples=1024, lights=(light,))
    # the lamp faces away from the camera behind it, and is not seen
    middle = image[image.shape[0] // 2, image.shape[1] // 2, 0]
    assert middle == pytest.approx(0.5 * factor, rel=3e-3)


def test_a_rectangle_facing_the_camera_is_seen_and_one_facing_away_is_not():
    towards = RectangleLight(
        radiance=(5.0, 4.0, 3.0),
        width=0.1,
        height=0.1,
        T_world_light=Pose(translation=(0, 0, 0.5), rotation=(np.pi, 0, 0)),
    )
    _, image = image_of([plane_mesh((0, 0, 1), 0.9)], lights=(towards,))
    assert image[image.shape[0] // 2, image.shape[1] // 2] == pytest.approx([5.0, 4.0, 3.0])


def test_a_box_throws_a_shadow():
    light = PointLight(intensity=(1.0, 1.0, 1.0), T_world_light=Pose(translation=(0.3, 0.0, 0.1)))
    box = moved(primitive_mesh(Box(size_x=0.05, size_y=0.05, size_z=0.01)), (0.0, 0.0, 0.5))
    scene, image = image_of([plane_mesh((0, 0, 1), 0.9), box], lights=(light,))
    # the box is half way between light and wall: its middle falls at x = -0.3 m; x = +0.3 m is free
    middle = (image.shape[0] - 1) // 2
    shadow, free = (round(scene.camera.fx * x / 0.9 + scene.camera.cx) for x in (-0.3, 0.3))
    assert image[middle, shadow, 0] == 0.0
    assert image[middle, free, 0] > 0.0


def test_ambient_light_does_not_depend_on_threads():
    scene = scene_of(paper_camera(0.05), lights=(RectangleLight(),), environment=Environment(radiance=(0.1, 0.1, 0.1)))
    world = world_of(scene, moved(primitive_mesh(Box()), (0, 0, 0.9), (0.5, 0.5, 0)))
    one, three = (
        ambient_image(world, scene, scene.camera, scene.T_world_camera(), run=Run(threads=n, seed=4)) for n in (1, 3)
    )
    assert np.array_equal(one, three)
