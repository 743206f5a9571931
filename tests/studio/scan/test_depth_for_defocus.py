"""Defocus by depth wants to know the depth of pixels: whoever develops an image has it."""

from __future__ import annotations

from pathlib import Path

import pytest

from studio.notebook.frame import render
from studio.preview.inspection import inspect
from studio.preview.preview import Preview
from studio.project.project import Project
from studio.scan.frame_views import live_picture
from studio.scan.options import ScanOptions
from studio.scan.scan import run_scan
from studio.scan.stages import scaled
from studio.study.cheaper_parts import parts_of


@pytest.fixture(scope="module")
def blurred() -> Project:
    """Focused far before the part, which no truth of pixels is asked for."""
    project = Project.load("plane")
    changed = {
        "scene.rig.camera.lens.focus_distance": 0.15,
        "scene.rig.camera.lens.f_number": 1.4,
        "sensor.defocus": True,
        "render.truth_images": False,
        "render.goal": None,
        "render.transport": "direct",
        "scene.lights": (),
    }
    return scaled(project.replaced(changed), 0.2).in_folder(project.folder)


def sharp(project: Project) -> Project:
    return project.replaced({"sensor.defocus": False}).in_folder(project.folder)


def test_the_live_picture_is_as_blurred_as_the_image_will_be(blurred: Project) -> None:
    """It failed at every move, and the picture of another project stayed."""
    lit = []
    for project in (sharp(blurred), blurred):
        image = Preview().look(project, project.folder).image(1.0)
        dark = live_picture(project, image) != live_picture(project.replaced({"sensor.exposure_time": 1e-9}), image)
        lit.append(int(dark.sum()))
    assert lit[1] > 2 * lit[0] > 0


def test_it_is_inspected(blurred: Project) -> None:
    (seen,), (without,) = (inspect(project, project.folder).lasers for project in (blurred, sharp(blurred)))
    assert seen.width_px is not None and without.width_px is not None and seen.width_px > 2.0 * without.width_px


def test_a_frame_that_shall_have_no_truth_has_it_where_it_is_needed(blurred: Project) -> None:
    assert render(blurred).truth is not None
    assert render(sharp(blurred)).truth is None


@pytest.mark.usefixtures("quick_reports")
@pytest.mark.parametrize("kept", ["all", "none"])
def test_a_scan_without_the_truth_of_pixels_is_developed(blurred: Project, kept: str, tmp_path: Path) -> None:
    run_scan(blurred, blurred.folder, out=tmp_path / "out", options=ScanOptions(frames=kept))
    assert (tmp_path / "out" / "points.csv").is_file()


def test_a_cheaper_project_keeps_the_truth_that_it_needs(blurred: Project) -> None:
    whole = blurred.replaced({"render.truth_images": True})
    names = [[part.name for part in parts_of(one)] for one in (whole, sharp(whole))]
    assert "per-pixel truth" not in names[0] and "per-pixel truth" in names[1]
