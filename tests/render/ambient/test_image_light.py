"""Ambient light of an image that may be off by some: no better than it is asked for, and as good as it is told."""

from __future__ import annotations

import numpy as np

from render.ambient.coarse_image import COARSE_ERROR
from render.ambient.integrator import ambient_images
from render.ambient.measured_light import image_light
from render.run import Run
from render.world.placed import PlacedScene
from tests.render.ambient.test_ambient_error import box_on_a_wall


def test_an_image_that_may_be_off_by_a_twentieth_is_interpolated_and_a_finer_one_sampled():
    scene, world = box_on_a_wall(0.08)
    placed = PlacedScene(world, scene)
    (image,) = image_light(placed, target=COARSE_ERROR)
    *_, reference = ambient_images(placed, target=0.0, most=512, run=Run(seed=7))
    true = np.sqrt(np.mean((image.radiance - reference.radiance) ** 2) / np.mean(reference.radiance**2))
    assert image.samples < 1.0 and image.lines is image.coarse_error is None
    assert image.error <= COARSE_ERROR and true < 1.1 * COARSE_ERROR
    *_, finer = image_light(placed, target=0.99 * COARSE_ERROR)
    *_, sampled = ambient_images(placed, target=0.99 * COARSE_ERROR)
    assert np.array_equal(finer.radiance, sampled.radiance)
