import math

import numpy as np

from render.direct import direct_image
from render.neighbours import with_neighbours
from render.primitives import primitive_mesh
from render.shape import Box
from tests.render.scenes import moved, paper_camera, paper_laser, plane_mesh, scene_of, world_of


def test_neighbours_are_those_of_the_image():
    rng = np.random.default_rng(3)
    height, width = 40, 31
    inside = rng.random((height, width)) < 0.4
    # the rim is left free: beyond it neighbours wrap
    inside[[0, -1]] = inside[:, [0, -1]] = False
    chosen = inside & (rng.random((height, width)) < 0.2)
    wanted = np.zeros_like(inside)
    for dv in (-1, 0, 1):
        for du in (-1, 0, 1):
            wanted |= np.roll(chosen, (dv, du), (0, 1))
    pixels = np.flatnonzero(inside).astype(np.int32)
    found = with_neighbours(chosen.ravel()[pixels], pixels, width)
    assert np.array_equal(found, wanted.ravel()[pixels])


def test_one_ray_a_pixel_is_enough_on_a_plane():
    scene = scene_of(paper_camera(0.25), paper_laser())
    world = world_of(scene, plane_mesh((0.3, 0.5, 0.8), 0.7))
    parts = (world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))
    image = direct_image(*parts, target=2e-3)
    fine = direct_image(*parts, target=1e-6)
    assert image.samples < fine.samples / 100
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
    reference = direct_image(*parts, target=1e-3, seed=7).radiance.astype(float)
    image = direct_image(*parts, target=0.02, seed=1)
    lit = reference > 0
    error = math.sqrt(np.mean((image.radiance - reference)[lit] ** 2) / np.mean(reference[lit] ** 2))
    assert error <= 0.02
