"""Rendered metal with its reflections: continuity and geometry against the row's maximum, by the exact truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analysis.line.extract import extract
from analysis.line.geometry import WorkingVolume
from analysis.line.noise import NoiseModel
from analysis.line.settings import ExtractionSettings
from render.material import Conductor
from render.world import build_world
from studio.project import Project
from studio.stages import Clock, develop_step, render_step, scaled
from studio.templates import template_folder

pytestmark = pytest.mark.validation

MARGIN = 0.003
"""m; the working volume around the part."""


def photograph(template: str, roughness: float | None):
    folder: Path = template_folder(template)
    project = scaled(Project.load(folder / "project.json"), 0.4)
    scene = project.scene
    if roughness is not None:
        item = scene.objects[0].model_copy(update={"material": Conductor(roughness=roughness)})
        scene = scene.model_copy(update={"objects": (item, *scene.objects[1:])})
    render = project.render.model_copy(update={"transport": "interreflection", "light_paths": 1 << 21})
    project = project.model_copy(update={"scene": scene, "render": render})
    clock = Clock(lambda stage, done: None, lambda: False)
    world = build_world(scene, folder, 0)
    frame = render_step(project, world, 0, clock, 2)
    return scene, frame.curves[0], develop_step(project, frame, clock, 2)[0]


def wrong(line, curve):
    """Share of the scan lines with a line whose position is more than 2 px from every true crossing."""
    count = 0
    for v in np.nonzero(line.valid[:, 0])[0]:
        truth = curve.position[curve.index == v]
        count += len(truth) == 0 or np.abs(truth - line.u[v, 0]).min() > 2
    return count / len(np.unique(curve.index))


@pytest.mark.parametrize(("template", "roughness"), [("v_groove", 0.15), ("v_groove", 0.2), ("shiny_weld_seam", None)])
def test_wrong_rows_on_rendered_metal_are_at_most_two_percent(template, roughness):
    scene, curve, image = photograph(template, roughness)
    noise = NoiseModel(
        gain=image.gain, black_level=image.black_level, read_noise=image.read_noise, saturation=image.saturation
    )
    depth = curve.depth_z
    volume = WorkingVolume(
        scene.camera,
        scene.lasers[0],
        scene.T_camera_laser(0),
        nearest=float(depth.min()) - MARGIN,
        farthest=float(depth.max()) + MARGIN,
    )
    settings = ExtractionSettings(select="continuous")
    plain = wrong(extract(image.pixels, method="row_maximum", noise=noise), curve)
    alone = wrong(extract(image.pixels, noise=noise), curve)
    guarded = wrong(extract(image.pixels, settings=settings, noise=noise, volume=volume), curve)
    print(
        f"\n{template} {roughness}: wrong rows {plain:.3f} row maximum, {alone:.3f} likelihood, {guarded:.3f} guarded"
    )
    assert guarded <= 0.02
    assert guarded <= min(plain, alone)
