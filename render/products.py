"""The products of a frame, in the order in which they are made, and the plan of all of them."""

from __future__ import annotations

from typing import Any

from render.ambient.light_group import AmbientLight
from render.camera.focus import lens_steps, thin_lens
from render.laser_direct.light_group import DirectLight
from render.laser_indirect.light_group import IndirectLight
from render.light_group import LightGroup
from render.plan import Plan
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.truth.light_group import PixelTruth

QUICK = DirectLight(quick=True)
"""A first look at the lines."""
PRODUCTS: tuple[LightGroup[Any], ...] = (DirectLight(), IndirectLight(), PixelTruth(), AmbientLight())
"""To add a light group is to add it here, once there is a field of `Frame` for it."""


def expected_plan(scene: Scene, settings: RenderSettings) -> Plan:
    """What will be computed and what is left out, as far as that is known before a pilot has run."""
    steps = [step for product in PRODUCTS for step in product.expected(scene, settings)]
    return Plan(
        (*steps, *lens_steps(scene.camera)),
        negligible=settings.negligible,
        image_size=(scene.camera.width, scene.camera.height),
        ambient_error=settings.ambient_error,
        ambient_samples=settings.ambient_samples,
        max_bounces=settings.max_bounces,
        laser_clamp=settings.laser_clamp,
        clamp=settings.clamp,
        lens=thin_lens(scene.camera),
    )
