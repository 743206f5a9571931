"""A study varies calibration: points are made with what each repeat's own boards give, and the render is shared."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from render.base.errors import InputError
from studio.project.project import Project
from studio.study.boards import Boards
from studio.study.calibrating import calibrated
from studio.study.cells import cells_at, points
from studio.study.draft import board_fields, path_text, spec_of, suggested
from studio.study.measures import CALIBRATION_MEASURES
from studio.study.measuring import measure_task
from studio.study.study import Study, with_fields
from studio.study.tables import CALIBRATING
from studio.study.tasks import tasks

SMALL: dict[str, Any] = {"render.goal": None, "render.transport": "direct", "render.ambient_samples": 1}


def cells_of(values: list[int], **fixed: Any) -> list[Any]:
    sweep = {"name": "boards", "vary": [{"field": "boards.views", "values": values}], "set": fixed}
    study = Study.model_validate({"base": "plane", "image_scale": 0.05, "repeats": 1, "set": SMALL, "sweeps": [sweep]})
    return list(cells_at(study, 0, study.bases(Path(".")), points(study.sweeps[0])))


def test_few_views_and_many_share_a_render_and_points_are_made_with_what_each_found() -> None:
    first, second = cells_of([5, 40])
    assert first.render_key == second.render_key and first.key != second.key
    (task,) = tasks([first, second], 0.05, 0)
    (_, few, seconds), (_, many, _) = measure_task(task)
    assert few["calibration_rmse"] > many["calibration_rmse"] > 0.0
    assert few["depth_bias"] != many["depth_bias"] and seconds[CALIBRATING] > 0.0
    ((_, exact, _),) = measure_task(replace(task, cells=(replace(task.cells[0], boards=""),)))
    assert all(np.isnan(exact[name]) for name in CALIBRATION_MEASURES)
    assert few["position_rmse"] == exact["position_rmse"]


def test_an_error_of_the_calibration_is_the_error_of_the_points() -> None:
    """Of a line without noise the depth error is that of the calibration alone, some 0.1 mm of five poor views."""
    poor = Boards(views=5, corner_sigma=1.0, line_sigma=1.0)
    project = Project.load("plane")
    found = calibrated(project, poor, 0)
    ((_, row, _),) = measure_task(
        tasks(cells_of([5], **{"boards.corner_sigma": 1.0, "boards.line_sigma": 1.0}), 0.05, 0)[0]
    )
    assert found.measures["calibration_rmse"] == row["calibration_rmse"]
    assert 0.2 * row["calibration_rmse"] < abs(row["depth_bias"]) < 5.0 * row["calibration_rmse"]


@pytest.mark.validation
def test_the_noise_of_corners_is_the_reprojection_error_and_depth_is_known_as_well_as_is_told() -> None:
    found = [calibrated(Project.load("plane").model_copy(update={"seed": seed}), Boards(), 0) for seed in range(8)]
    # 20 views of 117 corners, two coordinates of 0.05 px each, less some 125 parameters of 4,680
    reprojection = np.array([one.measures["reprojection_rmse"] for one in found])
    assert np.mean(reprojection) == pytest.approx(0.05 * np.sqrt(2.0 * (1.0 - 125 / 4680)), rel=0.01)
    true, told = ([one.measures[name] for one in found] for name in ("calibration_rmse", "calibration_predicted"))
    # the mean square of eight, of a few degrees of freedom each
    assert 0.5 < np.sqrt(np.mean(np.square(true)) / np.mean(np.square(told))) < 1.6


def test_the_same_boards_give_the_same_numbers_to_the_bit() -> None:
    project = Project.load("plane")
    first = calibrated(project, Boards(views=10), 0)
    filler = [np.zeros(7 * i + 1) for i in range(50)]  # arrays come to lie elsewhere
    again = calibrated(project.model_copy(update={"name": "other"}), Boards(views=10), 0)
    assert len(filler) == 50 and (first.calibration, first.measures) == (again.calibration, again.measures)


def test_views_that_do_not_determine_it_are_a_row_with_the_reason() -> None:
    ((_, row, _),) = measure_task(tasks(cells_of([1]), 0.05, 0)[0])
    assert np.isnan(row["depth_rmse"]) and row["reason"]


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("boards.view", 5, "did you mean views"),
        ("boards.views", 0, "boards.*greater"),
        ("boards.board", "paper", "not a board"),
    ],
)
def test_boards_that_cannot_be_are_told_before_anything_runs(field: str, value: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        cells_of([5], **{field: value}) if field != "boards.views" else cells_of([value])


def test_boards_are_no_field_of_the_project_and_no_project_is_changed() -> None:
    project = Project.load("plane")
    assert with_fields(project, {"boards.views": 3}, "here") == project


def test_the_window_offers_what_can_be_varied_of_the_boards() -> None:
    project = Project.load("plane")
    fields = dict(board_fields())
    views = spec_of(project, "boards.views")
    assert views is not None and views.kind == "integer" and fields["boards", "views"] == views
    assert spec_of(project, "boards.nothing") is None
    for path, spec in fields.items():
        parameter = suggested(path_text(path), spec)
        sweep = {"name": "boards", "vary": [parameter]}
        study = Study.model_validate({"base": "plane", "repeats": 3, "sweeps": [sweep]})
        assert len(list(cells_at(study, 0, study.bases(Path(".")), points(study.sweeps[0])))) == 3 * len(
            points(study.sweeps[0])
        )
