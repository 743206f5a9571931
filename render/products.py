"""The products of a frame, in the order in which they are made, and the plan of all of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.ambient.light_group import AmbientLight
from render.base.deadline import Deadline
from render.base.threads import map_chunks
from render.camera.focus import lens_steps, thin_lens
from render.frame import Frame
from render.laser_direct.light_group import DirectLight
from render.laser_indirect.light_group import IndirectLight
from render.light_group import LightGroup, has_work
from render.plan import Plan
from render.run import Run, ignore
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.truth.light_group import PixelTruth
from render.world.placed import PlacedScene

QUICK = DirectLight(quick=True)
"""A first look at the lines."""
AIMED = DirectLight(aimed=True)
"""Direct light again, where the goal asks for more than the image does."""
PRODUCTS: tuple[LightGroup[Any], ...] = (DirectLight(), PixelTruth(), AmbientLight(), IndirectLight())
"""To add a light group is to add it here, once there is a field of `Frame` for it."""

LOOK_SIDE = 256
"""Most coarse pixels a side of a first look at the ambient light."""
LOOK = {"transport": "direct", "ambient_samples": 8, "ambient_error": 0.1, "clamp": None}


def expected_plan(scene: Scene, settings: RenderSettings) -> Plan:
    """What will be computed and what is left out, as far as that is known before a pilot has run."""
    steps = [step for product in PRODUCTS for step in product.expected(scene, settings)]
    return Plan(
        (*steps, *lens_steps(scene.camera)),
        negligible=settings.negligible,
        goal=settings.goal.depth if settings.goal is not None and scene.lasers else None,
        image_size=(scene.camera.width, scene.camera.height),
        ambient_error=settings.ambient_error,
        ambient_samples=settings.ambient_samples,
        max_bounces=settings.max_bounces,
        laser_clamp=settings.laser_clamp,
        clamp=settings.clamp,
        lens=thin_lens(scene.camera),
    )


def ambient_look(placed: PlacedScene, settings: RenderSettings, run: Run) -> NDArray[np.float32] | None:
    """(h, w, 3) ambient light by way of one surface, in coarse pixels: how bright it is about the line, before it is
    rendered. None: there is none. Raises Cancelled."""
    scene, product = placed.scene, AmbientLight()
    settings = settings.model_copy(update=LOOK)
    if not has_work(product, scene, settings):
        return None
    camera = scene.camera
    coarse = PlacedScene(
        placed.world, scene.scaled(min(1.0, LOOK_SIDE / max(camera.width, camera.height))), placed.step
    )
    quiet = replace(run, progress=ignore, checkpoint=None, deadline=Deadline(), goal=None)
    plan = product.plan(None, placed.world, coarse.scene, settings)
    *_, last = product.estimates(coarse, settings, plan, Frame(placed.step, (), None, (), None), quiet)
    image = np.asarray(last.value, np.float32)
    rows = np.arange(camera.height) * image.shape[0] // camera.height
    columns = np.arange(camera.width) * image.shape[1] // camera.width
    wide, out = image[:, columns], np.empty((camera.height, camera.width, 3), np.float32)

    def work(start: int, stop: int) -> None:
        out[start:stop] = wide[rows[start:stop]]

    map_chunks(work, camera.height, LOOK_SIDE, run.threads)
    return out
