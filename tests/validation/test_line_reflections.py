"""Rendered metal with its reflections: continuity and geometry against the row's maximum, by the exact truth."""

from __future__ import annotations

import math

import numpy as np
import pytest

from render.material.material import Conductor
from render.run import Run
from render.world.world import build_world
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.line_extraction import extract_line
from studio.scan.stages import Clock, develop_step, render_step, scaled

pytestmark = pytest.mark.validation

MARGIN = 0.003
"""m; the working volume around the part."""
SCALE, PATHS = 0.4, 1 << 21


def groove(scene):
    """Deep, of ground steel, oblique to the line, so that each wall shows the other's reflection beside the line."""
    item = scene.objects[0]
    shape = item.shape.model_copy(update={"angle": math.radians(90), "depth": 0.07, "thickness": 0.08})
    pose = item.T_world_object.model_copy(update={"rotation": (0.0, 0.0, math.radians(60))})
    return item.model_copy(update={"shape": shape, "T_world_object": pose, "material": Conductor(roughness=0.1)})


def tee(scene):
    """Plates and bead of polished steel."""
    return scene.objects[0].model_copy(update={"material": Conductor(roughness=0.1)})


def photograph(template, part):
    """A project in a dark room, its exact line and the image of it."""
    folder = template_folder(template)
    project = scaled(Project.load(folder / "project.json"), SCALE)
    scene = project.scene
    dark = scene.environment.model_copy(update={"radiance": (0.0, 0.0, 0.0)})
    objects = (part(scene), *scene.objects[1:])
    scene = scene.model_copy(update={"objects": objects, "lights": (), "environment": dark})
    update = {"transport": "interreflection", "light_paths": PATHS, "truth_images": False}
    render = project.render.model_copy(update=update)
    project = project.model_copy(update={"scene": scene, "render": render})
    clock = Clock(lambda stage, done: None, lambda: False)
    frame = render_step(project, build_world(scene, folder, 0), 0, clock, Run(threads=2))
    return project, frame.curves[0], develop_step(project, frame, clock, 2)[0]


def shares(line, curve):
    """Of the scan lines that the line crosses: with a position off every crossing by over 2 px, and with a right one.

    A position on a scan line without any crossing counts as wrong.
    """
    wrong = right = 0
    for v in np.nonzero(line.valid[:, 0])[0]:
        truth = curve.position[curve.index == v]
        near = len(truth) > 0 and np.abs(truth - line.u[v, 0]).min() <= 2
        wrong, right = wrong + (not near), right + near
    rows = len(np.unique(curve.index))
    return wrong / rows, right / rows


@pytest.mark.parametrize(("template", "part"), [("v_groove", groove), ("shiny_weld_seam", tee)])
def test_wrong_rows_on_metal_are_a_third_by_the_maximum_and_at_most_two_percent_guarded(template, part):
    project, curve, image = photograph(template, part)
    depth = curve.depth_z
    volume = {"nearest": float(depth.min()) - MARGIN, "farthest": float(depth.max()) + MARGIN}
    ways = {
        "row maximum": {"method": "row_maximum"},
        "likelihood": {},
        "continuity": {"select": "continuous"},
        "geometry": {"geometry": True, **volume},
        "both": {"select": "continuous", "geometry": True, **volume},
        "learned": {"select": "learned"},
    }
    found = {}
    for name, changes in ways.items():
        asked = project.model_copy(update={"extraction": project.extraction.model_copy(update=changes)})
        found[name] = shares(extract_line(asked, image, 0), curve)
    told = "; ".join(f"{name} {wrong:.3f} wrong, {right:.3f} right" for name, (wrong, right) in found.items())
    print(f"\n{template}, {len(np.unique(curve.index))} scan lines: {told}")
    assert 0.2 < found["row maximum"][0] < 0.45
    assert found["both"][0] <= 0.02
    assert found["both"][1] >= found["row maximum"][1] - 0.01
    # of its own scenes it has seen none, and it knows nothing of the rig
    assert found["learned"][0] <= 0.001
    assert found["learned"][1] >= found["both"][1] - 0.02
