"""What is said of figures beside them: at which scale they were measured, and what the report says of them."""

from __future__ import annotations

import re

import numpy as np
import pytest

from analysis.report.record import record_of
from analysis.report.summary import remarks
from analysis.report.total import total
from render.base.errors import InputError
from render.world.world import build_world
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.image_lacks import image_lacks
from studio.scan.remarks import best, frame_remarks, frame_result, scale_head, scale_notes
from studio.scan.speckle_remark import speckle_remark
from studio.scan.stages import Clock, develop_step, measure_step, render_step, scaled

DIRECT = {"ambient_samples": 1, "transport": "direct", "goal": None}


def test_figures_at_another_scale_are_said_not_to_be_the_scanners() -> None:
    assert scale_notes(1.0) == () and scale_head(1.0) == ""
    (note,) = scale_notes(0.25)
    assert "image scale 0.25" in note and "not the scanner's" in note and "4 times as large" in note
    assert note.startswith(scale_head(0.25))
    assert "as large" not in scale_notes(2.0)[0]


def test_the_remarks_are_those_of_the_report() -> None:
    folder = template_folder("step_block")
    project = scaled(Project.load(folder / "project.json"), 0.1)
    world = build_world(project.scene, folder, 0)
    clock = Clock(lambda *_: None, lambda: False)
    frame = render_step(project, world, 0, clock)
    images = develop_step(project, frame, clock, None)
    # its sigma knows nothing of the phase in the pixel, which is most of the error of so narrow a line
    found = {"centre_of_mass": measure_step(project, frame, world, images, clock, None, "centre_of_mass")}
    result = frame_result(project, frame, found, images)
    assert np.array_equal(result.lasers[0].image, images[0].pixels)
    said = remarks(total(record_of(project.scene, [result]).chosen()))
    assert said and frame_remarks(project, frame, found) == [*frame.warnings, *said]
    assert any("predicted sigma" in text for text in said), "the share within 2 sigma is explained"


def test_without_a_measurement_there_is_nothing_to_remark() -> None:
    with pytest.raises(InputError, match="nothing is measured"):
        best({}, scaled(Project.load(template_folder("plane") / "project.json"), 0.1))


def test_speckle_that_the_sensor_leaves_out_is_told_with_its_size() -> None:
    folder = template_folder("plane")
    project = Project.load(folder / "project.json")
    direct = project.render.model_copy(update=DIRECT | {"truth_images": False})
    project = project.model_copy(update={"render": direct})
    world, clock = build_world(project.scene, folder, 0), Clock(lambda *_: None, lambda: False)
    frame = render_step(project, world, 0, clock)
    scatter, told = {}, {}
    for how in ("off", "polarised"):
        sensor = project.sensor.model_copy(update={"speckle": how})
        made = project.model_copy(update={"sensor": sensor})
        (one,) = measure_step(made, frame, world, develop_step(made, frame, clock, None), clock, None, "likelihood")
        scatter[how], told[how] = one.errors.depth_z.robust_sigma, speckle_remark(made, [one])
    assert told["polarised"] == ""
    foretold = float(re.search(r"by about ([\d.]+)", told["off"])[1]) * 1e-6
    # 3 standard errors of the robust sigma of 2,000 rows, of which two or three at a time share grains
    assert foretold == pytest.approx(scatter["polarised"], rel=0.1) and foretold > 3.0 * scatter["off"]


@pytest.mark.validation
def test_blur_that_the_image_leaves_out_is_told_with_its_size() -> None:
    """A disc of diameter D has a sigma of D / 4 across the line."""
    folder = template_folder("plane")
    project = Project.load(folder / "project.json")
    direct = project.render.model_copy(update=DIRECT)
    project = project.model_copy(update={"render": direct})
    lens = ("scene", "rig", "camera", "lens", "focus_distance")
    world, clock = build_world(project.scene, folder, 0), Clock(lambda *_: None, lambda: False)
    width, told = {}, {}
    for focus, defocus in ((0.8663, False), (0.5, False), (0.5, True)):
        made = replaced(project, lens, focus)
        made = made.model_copy(update={"sensor": made.sensor.model_copy(update={"defocus": defocus})})
        frame = render_step(made, world, 0, clock)
        (one,) = measure_step(made, frame, world, develop_step(made, frame, clock, None), clock, None, "likelihood")
        width[focus, defocus] = float(np.nanmedian(one.line.width))
        told[focus, defocus] = image_lacks(made, [one], {"speckle": "known"})
    assert told[0.8663, False] == told[0.5, True] == {"speckle": "known"}
    foretold = float(re.search(r"blurred by ([\d.]+) px", told[0.5, False]["defocus"])[1])
    blur = np.sqrt(width[0.5, True] ** 2 - width[0.5, False] ** 2)
    assert foretold == pytest.approx(4.0 * blur, rel=0.1) and foretold > 4.0
