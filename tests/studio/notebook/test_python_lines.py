"""The lines that the window copies: run, they give the numbers of the window."""

from __future__ import annotations

import numpy as np
import pytest

from render.base.errors import InputError
from render.progressive import refine
from render.run import Run
from render.scene.shape import Box
from render.world.world import build_world
from studio.notebook.frame import render
from studio.notebook.measuring import develop
from studio.notebook.python_lines import Work, changes, python_lines, scan_lines
from studio.project.project import Project
from studio.project.templates import new_project, template_folder
from studio.scan.options import ScanOptions
from studio.scan.redevelop import develop_again, development, measure_again
from studio.scan.render_goal import goal_of
from studio.scan.scan import run_scan
from studio.scan.stages import scaled

SCALE = 0.1


def quick(template, **more):
    """A project whose every light takes a moment, and which asks for no goal of the line."""
    less = {"render.ambient_samples": 2, "render.transport": "direct", "render.laser_error": 0.05, "render.goal": None}
    return Project.load(template).replaced(less | more)


def window(rendered, now, root, scale, methods, noise=True):
    """What render and develop panel make of a project and of its later state: measurements by method."""
    project = scaled(rendered, scale)
    world = build_world(project.scene, root, 0)
    settings, axis = project.render, project.extraction.axis
    how_done = Run(seed=project.seed, goal=goal_of(project))
    *_, frame = refine(world, project.scene, settings=settings, axis=axis, run=how_done)
    how = development(project, now, scale)
    images = develop_again(frame, how, noise=noise)
    return measure_again(frame, world, how, images, methods, cancelled=lambda: False)


def run(text):
    names = {}
    exec(compile(text, "copied", "exec"), names)
    return names


def assert_same(errors, measurement):
    points, found = errors.points, measurement.points
    np.testing.assert_array_equal(points.line.image.pixels, measurement.image.pixels)
    np.testing.assert_array_equal(points.line.u, measurement.line.u)
    np.testing.assert_array_equal(points.world, found.world)
    np.testing.assert_array_equal(errors.depth, measurement.errors.depth)
    assert errors.depth_z == measurement.errors.depth_z and np.isfinite(errors.depth_z.rmse)


def test_lines_of_a_render_that_was_developed_otherwise_give_the_figures_of_the_window(tmp_path, quick_reports):
    file = new_project("sphere", tmp_path / "here").project
    saved = Project.load(file)
    rendered = quick(
        str(file),
        **{"scene.objects[1].T_world_object.translation": [0.002, 0.0, 0.05], "scene.rig.lasers[0].power": 0.03},
    )
    now = rendered.replaced(
        {
            "sensor.exposure_time": 1.5 * rendered.sensor.exposure_time,
            "sensor.bits": 10,
            "scene.rig.lasers[0].power": 0.02,
            "scene.rig.camera.lens.transmission": 0.7,
            "extraction.method": "gaussian",
            # light that the render has not met is not shown by the window either
            "scene.objects[1].T_world_object.translation": [0.0, 0.0, 0.07],
            "seed": 5,
        }
    )
    methods = ("gaussian", "centre_of_mass")
    measured = window(rendered, now, file.parent, SCALE, methods)
    report = tmp_path / "it is.html"
    text = python_lines(Work(now, saved, file, rendered=rendered, image_scale=SCALE, methods=methods, report=report))
    names = run(text)
    assert names["project"] == rendered and names["project"].folder == file.parent
    assert_same(names["errors"], measured["gaussian"][0])
    assert_same(names["errors_centre_of_mass"], measured["centre_of_mass"][0])
    assert "gaussian" in report.read_text(encoding="utf-8").lower()
    # what the window could show without another render is there, what it could not is not
    assert text.count("T_world_object") == 1 and '"sensor.bits": 10' in text


def test_lines_for_several_lasers_and_no_noise_are_lists(tmp_path):
    plane = quick("plane", **{"render.goal": Project.load("plane").render.goal})
    second = plane.scene.lasers[0].model_copy(update={"name": "other", "power": 0.01})
    both = plane.replaced({"scene.rig.lasers": [plane.scene.lasers[0], second]})
    measured = window(both, both, template_folder("plane"), SCALE, ("likelihood",), noise=False)
    names = run(python_lines(Work(both, image_scale=SCALE, rendered=both, methods=("likelihood",), noise=False)))
    assert len(names["errors"]) == 2
    for mine, its in zip(names["errors"], measured["likelihood"], strict=True):
        assert_same(mine, its)


def test_a_project_without_a_file_starts_from_the_template_nearest_to_it():
    project = quick("v_groove", name="mine", seed=7)
    text = python_lines(Work(project, image_scale=SCALE))
    assert 'load("v_groove")' in text and "in_folder" not in text
    names = run(text.splitlines()[0] + "\n" + text[text.index("project =") : text.index("frame =")])
    assert names["project"] == project


def test_any_project_is_made_of_any_other():
    templates = [Project.load(name) for name in ("weld_seam", "scan", "glass_ball", "plane")]
    for before in templates:
        for now in templates:
            found = dict(changes(before, now))
            assert before.replaced(found) == now and (bool(found) == (before != now))


def test_lines_of_a_scan_run_it_again(tmp_path, quick_reports):
    root = template_folder("scan")
    first = run_scan(
        quick("scan", **{"scene.motion.steps": 2}), root, out=tmp_path / "out", options=ScanOptions(image_scale=SCALE)
    )
    again = run(scan_lines(first.folder, root))["scan"]
    assert again.folder == tmp_path / "out again" and first.manifest["results"]
    assert again.manifest["results"] == first.manifest["results"]


def test_a_changed_project_names_what_it_cannot_take():
    plane = Project.load("plane")
    assert plane.replaced({"scene.objects[0].shape": Box(size_x=0.2)}).scene.objects[0].shape == Box(size_x=0.2)
    for values, what in (
        ({"scene.rig.laser": 1}, "found laser; allowed: T_world_rig, camera, lasers"),
        ({"scene.rig.lasers[4].power": 1.0}, "found 4; allowed: 0"),
        ({"": 1}, "no such place"),
        ({"seed.x": 1}, "nothing below it"),
        ({"sensor.bits": 9}, "8, 10, 12 or 16"),
    ):
        with pytest.raises(InputError, match=what):
            plane.replaced(values)


def test_a_frame_is_not_developed_by_a_project_with_other_light():
    project = quick("plane")
    frame = render(project, image_scale=SCALE)
    moved = project.replaced({"scene.objects[0].T_world_object.translation": [0.0, 0.0, 0.01]})
    with pytest.raises(InputError, match="other light than the frame"):
        develop(frame, project=moved)
    brighter = develop(frame, project=project.replaced({"scene.rig.lasers[0].power": 0.04}), noise=False)
    assert np.array_equal(brighter.pixels, develop(frame, power=0.04, noise=False).pixels)
    assert brighter.project.scene.lasers[0].power == 0.04
