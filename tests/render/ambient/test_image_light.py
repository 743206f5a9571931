"""Ambient light of an image that may be off by some: no better than it is asked for, and as good as it is told."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from render.ambient import coarse_image as coarse_module
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


def test_the_error_told_is_no_less_than_the_noise_that_is_known(monkeypatch):
    """Held-out pixels that a bright path missed told 0.0 % of an image that was 11 % off, and ended its samples."""
    halves = np.array([[[1.0, 1.0, 1.0], [1.2, 1.2, 1.2]]])
    missed = np.array([[[1.2, 1.2, 1.2], [0.9, 0.9, 0.9]]])
    monkeypatch.setattr(coarse_module, "_light_grid", lambda *_, **__: None)
    monkeypatch.setattr(coarse_module, "radiance_at", lambda *_: halves.reshape(-1, 6))
    monkeypatch.setattr(coarse_module, "own_places", lambda paths: None)
    film = SimpleNamespace(means=lambda pixels: missed)
    grid = SimpleNamespace(pixels=np.array([0], np.int32))
    error, noise = coarse_module._errors(film, None, 1, grid, np.array([1], np.int32), 1)
    assert noise == pytest.approx(0.1 / np.sqrt(1.2 * 0.9)) and error == noise
