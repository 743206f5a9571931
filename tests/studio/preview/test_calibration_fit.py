"""A calibration of another set-up is told before anything is rendered with it."""

from __future__ import annotations

import numpy as np
import pytest

from studio.preview.preview import Preview
from studio.preview.readout_rows import Row, rows
from studio.preview.readouts import Readouts, readouts
from studio.project.project import Project
from studio.project.templates import template_folder

SIGMA = 2e-5
"""m, of the plane's distance."""


def with_plane(farther: float, *, sigma: float = SIGMA) -> Project:
    """The plane's template, whose laser plane was found so much too far from the camera, m."""
    project = Project.load(template_folder("plane"))
    plane = project.scene.laser_plane(0)
    plane = plane / np.linalg.norm(plane[:3])
    matrix = np.zeros((8, 8))
    matrix[7, 7] = sigma**2
    found = {
        "calibration.planes": [[*plane[:3].tolist(), float(plane[3] * (1.0 + farther / abs(plane[3])))]],
        "calibration.covariances": [matrix.tolist()],
    }
    return project.replaced(found).in_folder(project.folder)


def read(project: Project) -> Readouts:
    return readouts(Preview(1).look(project, project.folder), 0)


def row_of(found: Readouts) -> Row | None:
    return next((one for one in rows(found) if one.key == "calibration"), None)


def test_a_project_without_a_calibration_has_no_such_row() -> None:
    found = read(Project.load(template_folder("plane")))
    assert found.calibration is None and row_of(found) is None


def test_a_plane_that_is_farther_is_off_as_the_closed_form_says_and_so_is_its_sigma() -> None:
    """Depth is -d / (n . q): it grows as the plane's distance does."""
    project, farther = with_plane(1e-4), 1e-4
    found, distance = read(project), abs(float(project.scene.laser_plane(0)[3]))
    assert found.calibration is not None and found.distance is not None
    assert found.calibration.off == pytest.approx(found.distance.middle * farther / distance, rel=0.01)
    assert found.calibration.told == pytest.approx(found.distance.middle * SIGMA / distance, rel=0.01)
    assert found.calibration.off == pytest.approx(5.0 * found.calibration.told, rel=1e-3)


def test_off_by_what_it_can_be_by_chance_is_no_fault_and_by_more_it_is_of_another_set_up() -> None:
    """A laser that was moved by 10 mm was 45 mm off in depth, called the calibration's own error of 80 um."""
    near, far = (row_of(read(with_plane(farther))) for farther in (2.0 * SIGMA, 1e-3))
    assert near is not None and near.level == "" and near.note.endswith("told")
    assert far is not None and far.level == "error" and far.note == "of another set-up"
    assert "take it out of the project" in far.help
    # what no line can tell is no fault, however exact the calibration says it is
    exact = row_of(read(with_plane(1e-8, sigma=1e-12)))
    assert exact is not None and exact.level == ""
