"""Ambient light in translucent bodies: nothing is lost in a white one, Beer's law in a black one, bands apart."""

from __future__ import annotations

import math

import numpy as np
import pytest

from render.base.pose import Pose
from render.material.material import Subsurface
from render.mesh.primitives import primitive_mesh
from render.scene.lights import Environment, RectangleLight
from render.scene.shape import Box, Sphere
from tests.render.ambient.test_path_kernels import picture, scene_with
from tests.render.scenes import moved, paper_camera

SKY = Environment(radiance=(1.0, 1.0, 1.0))


@pytest.mark.parametrize("anisotropy", [0.0, 0.8])
def test_a_body_that_absorbs_nothing_vanishes_in_an_even_sky(anisotropy):
    ball = moved(primitive_mesh(Sphere(radius=0.3)), (0, 0, 0.8))
    white = Subsurface(index=1.01, roughness=0.05, mean_free_path=0.1, scattering_albedo=0.99999, anisotropy=anisotropy)
    scene, world = scene_with(paper_camera(0.01), (ball, white), environment=SKY)
    image = picture(scene, world, samples=256)
    # light that a rough boundary would scatter twice is lost: 0.36 % of what passes a clear ball of it, more
    # of what meets it from all sides; absorption takes 1e-4
    assert image.mean() == pytest.approx(1.0, abs=0.012) and image.mean() < 1.001


def test_a_body_that_scatters_nothing_follows_beers_law():
    thickness, free = 0.04, (0.02, 0.05, 0.2)
    slab = moved(primitive_mesh(Box(size_x=3.0, size_y=3.0, size_z=thickness)), (0, 0, 0.5))
    tinted = Subsurface(index=1.01, roughness=0.05, mean_free_path=free, scattering_albedo=0.0)
    scene, world = scene_with(paper_camera(0.005), (slab, tinted), environment=SKY)
    image = picture(scene, world, samples=1024)[4:6, 5:7].mean(axis=(0, 1))
    # reflection of such a boundary is 2.5e-5
    assert image == pytest.approx(np.exp(-thickness / np.array(free)), rel=0.02, abs=0.005)


@pytest.mark.validation
def test_each_band_is_what_it_would_be_alone():
    ball = moved(primitive_mesh(Sphere(radius=0.1)), (0, 0, 0.8))
    lamp = RectangleLight(width=0.3, height=0.3, T_world_light=Pose(translation=(0.3, -0.2, 0.2), rotation=(0, 0, 0)))
    free, albedo = (0.01, 0.02, 0.05), (0.99, 0.9, 0.7)
    totals = []
    for medium in [(free, albedo), *zip(free, albedo, strict=True)]:
        skin = Subsurface(index=1.4, mean_free_path=medium[0], scattering_albedo=medium[1], anisotropy=0.5)
        scene, world = scene_with(paper_camera(0.02), (ball, skin), lights=(lamp,))
        runs = [picture(scene, world, samples=64, seed=seed).sum(axis=(0, 1)) for seed in range(8)]
        totals.append((np.mean(runs, axis=0), np.std(runs, axis=0, ddof=1) / math.sqrt(8)))
    together, spread = totals[0]
    for band in range(3):
        alone, error = totals[1 + band][0][band], totals[1 + band][1][band]
        assert together[band] == pytest.approx(alone, abs=4.5 * math.hypot(spread[band], error))
        assert spread[band] < 0.1 * together[band]


def test_threads_do_not_change_a_bit():
    ball = moved(primitive_mesh(Sphere(radius=0.1)), (0, 0, 0.8))
    scene, world = scene_with(paper_camera(0.02), (ball, Subsurface(mean_free_path=0.01)), environment=SKY)
    assert np.array_equal(*(picture(scene, world, samples=8, threads=n) for n in (1, 3)))
