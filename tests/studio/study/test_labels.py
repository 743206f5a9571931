"""Charts, tables and sentences of a study in the words and units of the inspector, its files in the project's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio.project.project import Project
from studio.project.templates import template_folder
from studio.study.answers import Answer, answers
from studio.study.cells import next_cells
from studio.study.charts import chart, places
from studio.study.draft import fields_of, path_text, spec_of
from studio.study.labels import as_read, interval_text, value_text
from studio.study.page import sentences, table, write_page
from studio.study.study import Parameter, Study

EXPOSURE = "sensor.exposure_time"
BASELINE = "scene.rig.lasers[0].T_rig_laser.translation[0]"


def measured(*vary: dict[str, Any], **more: Any) -> tuple[Study, Any, Any]:
    """A study of one sweep whose depth errs by 100 um times the first value over its smallest, from seed to seed a
    little more."""
    data = {"name": "s", "vary": list(vary), "measure": "depth_rmse", **more}
    study = Study.model_validate({"base": "plane", "repeats": 3, "sweeps": [data]})
    bases, rows = study.bases(Path()), dict[str, Any]()
    while cells := next_cells(study, bases, rows):
        for cell in cells:
            error = 1e-4 * float(cell.point[0]) / 1e-3 * (1.0 + 0.01 * cell.repeat)
            rows[cell.key] = {"depth_rmse": error, "reason": "", "seconds": 1.0}
    return study, bases, rows


def read(study: Study, bases: Any, rows: Any) -> tuple[Answer, dict[str, str]]:
    return as_read(answers(study, bases, rows)[0], bases.values())


def test_a_chart_has_the_inspectors_name_and_unit() -> None:
    answer, labels = read(*measured({"field": EXPOSURE, "values": [0.001, 0.0023]}))
    axes = chart(answer, labels).axes[0]
    assert axes.get_xlabel() == "Exposure time (ms)"
    assert sorted(places(answer)[:, 0]) == [1.0, 2.3]
    assert any(np.allclose(line.get_xdata(), [1.0, 2.3]) for line in axes.lines if len(line.get_xdata()) == 2)
    assert [row[0] for row in table(answer)] == ["1", "2.3"]


def test_the_foot_of_a_narrow_chart_wraps_and_is_not_cut() -> None:
    study, bases, rows = measured({"field": EXPOSURE, "values": [0.001, 0.0023]})
    answer, labels = read(study, bases, rows)
    made = chart(replace(answer, image_scale=0.1), labels)
    made.set_size_inches(2.0, 2.0)
    made.canvas.draw()
    foot = made._supxlabel.get_window_extent()
    assert "not the scanner's own figures" in made._supxlabel.get_text()
    assert foot.x0 >= 0.0 and foot.x1 <= made.bbox.width


@pytest.mark.parametrize("high", [0.0014, 0.004, 0.02])
def test_a_logarithmic_axis_has_at_least_three_values_written_on_it(high: float) -> None:
    answer, labels = read(*measured({"field": EXPOSURE, "low": 0.001, "high": high, "spacing": "logarithmic"}))
    axis = chart(answer, labels).axes[0].xaxis
    low, high = axis.get_view_interval()
    assert sum(low <= place <= high for place in axis.get_majorticklocs()) >= 3


def test_a_part_of_a_pose_has_a_name_and_what_the_study_names_stays_in_the_files_unit() -> None:
    field = {"field": BASELINE, "values": [0.1, 0.2]}
    answer, labels = read(*measured(field))
    assert labels == {BASELINE: "Position x (mm)"} and [one.point for one in answer.spots] == [(100.0,), (200.0,)]
    answer, _ = read(*measured({**field, "label": "Baseline (m)"}))
    assert [one.point for one in answer.spots] == [(0.1,), (0.2,)]
    assert chart(answer, {}).axes[0].get_xlabel() == "Baseline (m)"


def test_a_breakdown_is_told_in_the_unit_of_its_axis(tmp_path: Path) -> None:
    limit = {"measure": "depth_rmse", "value": 3e-4}
    ends = {"field": EXPOSURE, "low": 0.001, "high": 0.01}
    run = measured(ends, sampling="bisection", limit=limit)
    answer, labels = read(*run)
    (broken,), (stored,) = answer.broken, answers(*run)[0].broken
    assert broken.breakdown.value == pytest.approx(1e3 * stored.breakdown.value) == pytest.approx(3.0, rel=0.05)
    assert f"Exposure time (ms) {broken.breakdown.value:.3g}" in sentences(answer, labels)[0]
    page, found = write_page(tmp_path, *run)
    assert "Exposure time (ms)" in page.read_text() and found[0].spots[0].point[0] < 0.1


def test_an_interval_of_a_single_repeat_is_none() -> None:
    assert interval_text(float("nan"), float("nan")) == "-"
    assert interval_text(0.0, float("inf")) == "0 to -"
    assert interval_text(-1.23456, 2.0, 3) == "-1.23 to 2"


def test_a_value_alone_has_the_unit_of_the_inspector() -> None:
    bases = [Project.load(template_folder("weld_seam") / "project.json")]
    fields = {EXPOSURE: 0.0009, "render.transport": "direct", "sensor.read_noise": 2.5}
    told = [value_text(Parameter(field=field, values=(value,)), value, bases) for field, value in fields.items()]
    assert told == ["0.9 ms", "direct", "2.5 e-"]


def test_a_pose_is_varied_by_its_position_and_its_turn() -> None:
    project = Project.load(template_folder("weld_seam") / "project.json")
    laser = fields_of(project, ("scene", "rig", "lasers", 0))
    labels = {path_text(path): spec.label for path, spec in laser if "T_rig_laser" in path}
    turn = "scene.rig.lasers[0].T_rig_laser.rotation[1]"
    assert len(labels) == 6 and labels[turn] == "Rotation vector y"
    spec = spec_of(project, turn)
    assert spec is not None and spec.unit.with_unit(spec.value) == "-13 deg"
