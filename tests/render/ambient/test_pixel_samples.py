"""Samples of single pixels: what is forgotten is drawn anew, and was spent all the same."""

import numpy as np

from render.ambient.path_tracer import camera_paths
from render.ambient.pixel_samples import PixelSamples
from render.run import Run
from tests.render.ambient.test_ambient_error import box_on_a_wall


def test_forgotten_samples_are_told_and_drawn_anew():
    scene, world = box_on_a_wall()
    paths = camera_paths(world, scene, scene.camera.view(scene.T_world_camera()))
    pixels = np.array([100, 700, 2000], np.int32)
    film, count = PixelSamples(pixels), np.full((3, 2), 4, np.int32)
    film.add(paths, pixels, count, Run())
    before = film.means()
    film.forget(pixels[1:])
    assert film.done.sum() == 8 and film.total == 24
    film.add(paths, pixels, count, Run())
    assert film.total == 40
    assert np.array_equal(film.means(), before)
