"""What a project's calibration says of itself is what was told when it was made, as far as the project stores it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from analysis.calibration.calibrate import Calibrated, Request, calibrate
from studio.calibration.board_text import parse_board
from studio.calibration.calibration_file import file_data
from studio.calibration.in_silico import true_depth_error
from studio.calibration.material import board_distances, virtual
from studio.calibration.project_calibration import own_depth, own_depth_rows, own_notes, own_rows
from studio.calibration.solving import of_project
from studio.calibration.words import WARP, parameter_rows
from studio.project.calibration import Calibration
from studio.project.project import Project

BOARD = "checkerboard:13x9:25mm"


@cache
def calibrated() -> tuple[Project, Calibrated, list[tuple[float, float]]]:
    """A project that uses a calibration of its own boards with a lens of four terms, that, and its true errors."""
    project, board = Project.load("plane"), parse_board(BOARD)
    material, truth = virtual(project, board)
    nearest, farthest = board_distances(project, None, None)
    request = Request(material.size, material.lasers, 4, nearest=nearest, farthest=farthest)
    result = calibrate(material.views, board.target, request)
    used = project.model_copy(update={"calibration": of_project(file_data(result, material.size, BOARD))})
    return used, result, true_depth_error(result, truth)


def test_parameters_are_those_that_were_told_but_for_the_board() -> None:
    project, result, _ = calibrated()
    names = [laser.name for laser in project.scene.lasers]
    told = [row for row in parameter_rows(result, names) if row[0] != WARP]
    assert own_rows(project) == [("image px", "2448 x 2048", ""), *told]
    assert [row[0] for row in told[:8]] == ["fx px", "fy px", "cx px", "cy px", "k1", "k2", "p1", "p2"]


def test_depth_is_off_as_was_told_over_the_same_distances() -> None:
    project, result, ((true, told),) = calibrated()
    (one,) = own_depth(project)
    assert one.told.volume.depth == pytest.approx(result.depth[0].volume.depth)
    # the file holds the plane by its unit normal: its covariance is carried to first order
    assert one.told.rms == pytest.approx(told, rel=1e-6) and one.true == pytest.approx(true, rel=1e-6)
    ((span, *cells),) = own_depth_rows(project, [one])
    assert span.startswith(project.scene.lasers[0].name)
    worst = 1e6 * result.depth[0].systematic.max()
    assert cells == [f"{1e6 * told:.1f}", f"{worst:.1f}", f"{1e6 * true:.1f}"]


def test_what_is_stored_without_a_covariance_is_exact_and_says_so() -> None:
    project, _, ((true, _),) = calibrated()
    bare = project.calibration.model_copy(update={"covariances": ()})
    project = project.model_copy(update={"calibration": bare})
    assert all(sigma == "exact" for _, _, sigma in own_rows(project)[1:])
    assert any("exact" in note for note in own_notes(project))
    ((_, *cells),) = own_depth_rows(project, own_depth(project))
    assert cells == ["-", "-", f"{1e6 * true:.1f}"]


def test_a_covariance_without_the_lens_leaves_its_terms_exact() -> None:
    project, _, _ = calibrated()
    short = tuple(tuple(row[:8] for row in rows[:8]) for rows in project.calibration.covariances)
    project = project.model_copy(update={"calibration": project.calibration.model_copy(update={"covariances": short})})
    sigma = [row[2] for row in own_rows(project)[1:9]]
    assert sigma[4:] == 4 * ["exact"] and "exact" not in sigma[:4]
    (one,) = own_depth(project)
    assert np.isfinite(one.told.systematic).all() and one.told.rms > 0.0


def test_a_calibration_of_planes_alone_leaves_the_camera_to_the_scene() -> None:
    project, _, _ = calibrated()
    planes = Calibration(planes=project.calibration.planes)
    project = project.model_copy(update={"calibration": planes})
    assert any("camera is the scene's" in note for note in own_notes(project))
    assert own_rows(project)[1][1] == f"{project.scene.camera.fx:.3f}"
