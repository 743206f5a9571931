import numpy as np
import pytest

from render.base.errors import InputError
from render.base.pose import Pose
from render.mesh.mesh import Mesh
from render.mesh.primitives import primitive_mesh
from render.render import render_world
from render.scene.shape import Box, Sphere
from render.world.placement_checks import check_placement
from tests.render.scenes import moved, paper_camera, paper_laser, plane_mesh, scene_of, world_of


def refused(meshes, laser=None, **parts):
    scene = scene_of(paper_camera(0.05), laser or paper_laser(), objects=len(meshes), **parts)
    with pytest.raises(InputError) as error:
        check_placement(world_of(scene, *meshes), scene)
    return str(error.value)


def test_a_sensible_scene_passes():
    scene = scene_of(paper_camera(0.05), paper_laser())
    check_placement(world_of(scene, plane_mesh((0, 0, 1), 0.9)), scene)


def test_a_laser_plane_through_the_camera_centre_is_named():
    message = refused([plane_mesh((0, 0, 1), 0.9)], paper_laser(T_rig_laser=Pose(translation=(0.0, 0.1, 0.0))))
    assert "scene.rig.lasers[0]" in message and "plane passes through the camera" in message


def test_a_camera_inside_a_solid_is_named_with_the_solid():
    around = moved(primitive_mesh(Sphere(radius=0.3)), (0.05, 0.0, 0.1))
    message = refused([plane_mesh((0, 0, 1), 0.9), around])
    assert "inside an object" in message and "'object 1'" in message


def test_a_camera_near_an_open_surface_is_not_inside_it():
    sphere = primitive_mesh(Sphere(radius=0.3))
    half = Mesh(sphere.vertices, sphere.triangles[sphere.vertices[sphere.triangles][:, :, 2].min(axis=1) > 0])
    scene = scene_of(paper_camera(0.05), paper_laser())
    check_placement(world_of(scene, half), scene)


@pytest.mark.parametrize("place", [(0.0, 0.0, -1.0), (5.0, 0.0, 0.9), (0.0, -5.0, 0.9)])
def test_a_scene_outside_the_field_of_view_is_refused(place):
    assert "nothing is visible" in refused([moved(primitive_mesh(Box()), place)])


def test_a_scene_without_objects_is_refused():
    assert "no visible object" in refused([])


def test_a_huge_triangle_around_the_view_is_visible():
    scene = scene_of(paper_camera(0.05), paper_laser())
    check_placement(world_of(scene, plane_mesh((0, 0, 1), 0.9, 1e4)), scene)


def test_rendering_refuses_before_any_work():
    scene = scene_of(paper_camera(0.05), paper_laser())
    with pytest.raises(InputError):
        render_world(world_of(scene, moved(primitive_mesh(Box()), (0.0, 0.0, -1.0))), scene)


def test_a_laser_that_lights_nothing_gives_a_dark_image_and_an_empty_line():
    scene = scene_of(paper_camera(0.05), paper_laser())
    frame = render_world(world_of(scene, moved(primitive_mesh(Box(size_x=0.02, size_y=0.02)), (0.15, 0, 0.9))), scene)
    assert frame.curves[0].index.size == 0
    assert not np.any(frame.laser_direct[0])
    # the box lies within the fan, beside the sheet
    assert "lasers[0] (laser): its light meets no object" in frame.warnings[0]
