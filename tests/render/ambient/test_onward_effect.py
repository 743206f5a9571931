"""What ambient light by way of two surfaces and more does to the line: by a few samples, and by images of both."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from render.ambient.integrator import ambient_images
from render.ambient.transport_plan import EFFECT, EFFECT_POOLED, ONWARD, onward_effect, plan_of
from render.importance import Importance, known_below
from render.material.material import Lambertian
from render.mesh.primitives import primitive_mesh
from render.run import Run
from render.scene.settings import RenderSettings
from render.scene.shape import VGroove
from render.world.placed import PlacedScene
from tests.render.ambient.test_ambient_error import SKY
from tests.render.ambient.test_path_kernels import scene_with
from tests.render.scenes import moved, paper_camera


@pytest.fixture(scope="module")
def groove() -> PlacedScene:
    """A white V groove under the sky, which runs down the image."""
    mesh = primitive_mesh(VGroove(angle=math.radians(80), depth=0.03, width=0.2, length=0.2, thickness=0.04))
    mesh = moved(mesh, (0.0, 0.0, 0.9), (math.pi, 0.0, 0.0))
    scene, world = scene_with(paper_camera(0.05), (mesh, Lambertian(albedo=0.8)), environment=SKY)
    return PlacedScene(world, scene)


def importance_of(placed: PlacedScene, column: int) -> Importance:
    """Of a line at some place of every row."""
    shape = placed.camera.height, placed.camera.width
    move = np.zeros(shape, np.float32)
    move[:, column - 4 : column + 5] = np.arange(-4, 5)
    return Importance((), np.zeros(shape, np.float32), ambient_moves=(move,))


@pytest.mark.parametrize("place", [0.52, 0.55])
def test_it_is_what_images_with_and_without_that_light_say(groove: PlacedScene, place: float) -> None:
    found = importance_of(groove, int(place * groove.camera.width))
    images = []
    for surfaces in (1, 8):
        *_, last = ambient_images(groove, target=0.0, most=256, surfaces=surfaces)
        images.append(last.radiance.astype(np.float64))
    squares = ((images[1] - images[0]) * found.ambient_moves[0][..., None]).sum(axis=1).T ** 2
    expected = math.sqrt(known_below(uniform_filter1d(squares, EFFECT_POOLED, axis=1).max(axis=0)))
    effects = [onward_effect(groove, found, 8, Run(seed=seed)) for seed in range(10)]
    # the largest of some noisy ones is rather too large, so that light is computed rather than left out
    assert 0.9 * expected < np.mean(effects) < 1.4 * expected and expected > 0.1


def test_where_no_line_is_measured_there_is_none(groove: PlacedScene) -> None:
    nothing = np.zeros((groove.camera.height, groove.camera.width), np.float32)
    assert onward_effect(groove, Importance((), nothing, ambient_moves=(nothing,))) == 0.0


def test_little_light_that_moves_the_line_is_computed(groove: PlacedScene) -> None:
    settings = RenderSettings(transport="auto", negligible=0.02)

    def computed(share: float, effect: float) -> bool | None:
        shares = {ONWARD: (share, 0.0), EFFECT: (effect, 0.0)}
        step = plan_of(shares, groove.world, groove.scene, settings).steps[1]
        assert step.moves == pytest.approx(effect * settings.goal.depth)
        return step.computed

    assert computed(0.001, 2.0) and computed(0.1, 0.5) and not computed(0.001, 0.5)
