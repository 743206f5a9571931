"""The first look at a pixel."""

from __future__ import annotations

import math

import numpy as np

from render.laser_direct.centre_ray import BEYOND, EDGE_SHARE, estimate_errors
from render.laser_direct.integrator import direct_image
from render.laser_direct.rasterise import rasterise_sheet
from render.mesh.primitives import primitive_mesh
from render.run import Run
from render.scene.shape import Box
from tests.render.scenes import moved, paper_camera, paper_laser, plane_mesh, scene_of, world_of


def test_where_no_light_is_seen_nothing_is_read():
    # memory that was never written may hold anything
    planes = np.full((3, 4), np.nan)
    planes[1] = 0.1, 2.0, 0.0, 5.0
    planes[[0, 2], 3] = 0.0
    middle, mean, error = np.array([0.0, 0.8, 0.0]), np.empty(3), np.empty(3)
    estimate_errors(0, 3, np.arange(10, 13, dtype=np.int32), 100, planes, middle, mean, error)
    assert mean[0] == mean[2] == 0.0 and mean[1] > 0.0
    # beside the edge all three have an error
    assert np.all(error > 0.0) and np.isfinite(error).all()


def test_the_dark_beside_a_line_is_an_edge_unless_the_surface_goes_on_there():
    """Of two pixels in a row the first is lit; q grows by 4 from it to the next."""
    lit = 0.5, 4.0, 0.0, 2.0

    def error_of(dark):
        mean, error = np.empty(2), np.empty(2)
        estimate_errors(
            0, 2, np.arange(10, 12, dtype=np.int32), 100, np.array([lit, dark]), np.array([0.3, 0.0]), mean, error
        )
        return error

    jump = EDGE_SHARE * 0.3
    # where the sheet would reach and no light is seen: a shadow
    np.testing.assert_allclose(error_of((4.5, 4.0, 0.0, 0.0)), jump)
    # beyond the sheet, on the same plane, on one that bends away, on another
    np.testing.assert_allclose(error_of((4.5, 4.0, 0.0, BEYOND)), 0.0, atol=1e-15)
    np.testing.assert_allclose(error_of((4.7, 4.0, 0.0, BEYOND)), 0.2 * jump)
    np.testing.assert_allclose(error_of((9.0, 4.0, 0.0, BEYOND)), jump)


def slanted_plane():
    scene = scene_of(paper_camera(0.25), paper_laser())
    world = world_of(scene, plane_mesh((0.3, 0.5, 0.8), 0.7))
    return world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0)


def test_one_ray_a_pixel_is_enough_on_a_plane():
    image, fine = (direct_image(*slanted_plane(), target=target) for target in (2e-3, 1e-6))
    assert image.samples == len(rasterise_sheet(*slanted_plane(), None)) < fine.samples / 1000


def test_few_rays_meet_the_target_on_a_plane_and_say_so():
    image, fine = (direct_image(*slanted_plane(), target=target) for target in (2e-3, 1e-6))
    lit = fine.radiance > 0.01 * fine.radiance.max()
    error = np.sqrt(np.mean((image.radiance - fine.radiance)[lit] ** 2) / np.mean(fine.radiance[lit] ** 2))
    assert error < 5e-4
    assert error < image.error < 2e-3


def test_thin_wires_before_the_line_are_not_overlooked():
    # a fence of wires of 0.5 px, seen aslant: a ray in the middle of a pixel misses every other one
    thickness = 0.5 * 0.8 / paper_camera(0.5).fx
    wires = [
        moved(primitive_mesh(Box(size_x=0.3, size_y=thickness, size_z=thickness)), (0.0, y, 0.8), (0.0, 0.0, 0.35))
        for y in np.linspace(-0.12, 0.12, 25)
    ]
    scene = scene_of(paper_camera(0.5), paper_laser(), objects=1 + len(wires))
    world = world_of(scene, plane_mesh((0.0, 0.0, 1.0), 0.9), *wires)
    parts = (world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))
    reference = direct_image(*parts, target=1e-3, run=Run(seed=7)).radiance.astype(float)
    image = direct_image(*parts, target=0.02, run=Run(seed=1))
    lit = reference > 0
    error = math.sqrt(np.mean((image.radiance - reference)[lit] ** 2) / np.mean(reference[lit] ** 2))
    assert error <= 0.02
