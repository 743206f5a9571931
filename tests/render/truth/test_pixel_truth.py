import numpy as np
import pytest

from render.mesh.primitives import primitive_mesh
from render.run import Run
from render.scene.shape import Sphere
from render.truth.pixel_truth import truth_images
from tests.render.scenes import moved, paper_camera, plane_mesh, scene_of, world_of


def test_a_tilted_plane_gives_its_closed_form_depths():
    scene = scene_of(paper_camera(0.25, (-0.2, 0.05, 1e-3, 0)))
    truth = truth_images(world_of(scene, plane_mesh((0.3, -0.2, 0.9), 0.8)), scene.camera, scene.T_world_camera())
    v, u = np.mgrid[0 : scene.camera.height, 0 : scene.camera.width]
    rays, _ = scene.camera.rays(np.stack([u, v], axis=-1))
    n = np.array([0.3, -0.2, 0.9]) / np.linalg.norm((0.3, -0.2, 0.9))
    expected = 0.8 / (rays @ n)
    assert np.abs(truth.depth_range - expected).max() < 1e-7
    assert np.abs(truth.depth_z - expected * rays[..., 2]).max() < 1e-7
    assert np.abs(truth.position - rays * expected[..., None]).max() < 1e-7
    assert np.abs(truth.normal + n).max() < 1e-6
    assert (truth.object_id == 0).all()


def test_background_has_no_depth_and_no_object():
    scene = scene_of(paper_camera(0.1))
    mesh = moved(primitive_mesh(Sphere(radius=0.05)), (0.0, 0.0, 0.8))
    truth = truth_images(world_of(scene, mesh), scene.camera, scene.T_world_camera())
    hit = truth.object_id == 0
    assert 0.01 < hit.mean() < 0.2
    assert np.isnan(truth.depth_z[~hit]).all() and (truth.object_id[~hit] == -1).all()
    assert np.abs(np.linalg.norm(truth.position[hit] - (0, 0, 0.8), axis=1) - 0.05).max() < 1e-5
    assert (np.einsum("ij,ij->i", truth.normal[hit], truth.position[hit]) < 0).all()


def test_pixels_without_a_ray_are_background():
    camera = paper_camera(0.1, (-0.4, 0, 0, 0)).model_copy(update={"fx": 100.0, "fy": 100.0})
    scene = scene_of(camera)
    truth = truth_images(world_of(scene, plane_mesh((0, 0, 1), 0.8, 100.0)), camera, scene.T_world_camera())
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    _, valid = camera.rays(np.stack([u, v], axis=-1))
    assert 0 < np.count_nonzero(~valid) < valid.size
    assert np.array_equal(truth.object_id == -1, ~valid)


def test_truth_does_not_depend_on_threads():
    scene = scene_of(paper_camera(0.2))
    world = world_of(scene, moved(primitive_mesh(Sphere(radius=0.1)), (0.0, 0.0, 0.8)))
    one, three = (truth_images(world, scene.camera, scene.T_world_camera(), run=Run(threads=n)) for n in (1, 3))
    assert np.array_equal(one.position, three.position, equal_nan=True)
    assert one.depth_z == pytest.approx(three.depth_z, nan_ok=True)
