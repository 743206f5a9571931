"""A study file says what to run; each thing wrong with it has one message that names the place."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from render.base.errors import InputError
from studio.project.project import Project
from studio.study.cells import cells_at, check_size, next_cells, points
from studio.study.estimate import estimate
from studio.study.study import Study, ready_made, with_fields
from studio.study.tables import SECONDS, measured_cells

SWEEP: dict[str, Any] = {"name": "a", "vary": [{"field": "sensor.exposure_time", "values": [0.001, 0.002]}]}


def study_of(sweep: dict[str, Any], **more: Any) -> Study:
    return Study.model_validate({"base": "plane", "sweeps": [sweep], "repeats": 3, **more})


def bases_of(study: Study) -> dict[str, Project]:
    return study.bases(Path("."))


@pytest.mark.parametrize("name", ready_made())
def test_every_ready_made_study_fits_its_project(name: str) -> None:
    study, root = Study.load(name)
    assert next_cells(study, study.bases(root), {}) and study.question


@pytest.mark.parametrize(
    ("sweep", "message"),
    [
        ({"vary": [{"field": "sensor.exposure_time"}]}, "values, or low and high"),
        ({"vary": [{"field": "sensor.exposure_time", "low": 1.0}]}, "both low and high"),
        ({"vary": [{"field": "x", "low": 0.0, "high": 1.0, "spacing": "logarithmic"}]}, "low and high above 0"),
        ({"vary": [{"field": "x", "low": 1.0, "high": 1.0}]}, "low and high that differ"),
        ({"vary": [{"field": "x", "values": [1.0, 1.0]}]}, "each once"),
        ({"vary": []}, "1 to 8"),
        ({"measure": "depth_rmsd"}, "did you mean depth_rmse"),
        ({"measure": "length_error:"}, "there is no measure"),
        ({"references": [{"label": "x", "measure": "depth_rmse", "value": 1.0, "point": [0.003]}]}, "0.001, 0.002"),
        ({"sampling": "bisection"}, "low and high for every parameter"),
        ({"chart": "map"}, "two in vary"),
        ({"set": {"sensor.exposure_time": 1.0}}, "each once in vary and set"),
        ({"methods": ["magic"]}, "likelihood"),
    ],
)
def test_a_sweep_that_cannot_be_is_told_with_what_is_allowed(
    sweep: dict[str, Any], message: str, tmp_path: Path
) -> None:
    file = tmp_path / "study.json"
    file.write_text(json.dumps({"base": "plane", "sweeps": [{**SWEEP, **sweep}]}))
    with pytest.raises(InputError, match=message) as raised:
        Study.load(file)
    assert "study.json" in str(raised.value) and "sweeps[0]" in str(raised.value)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"sensor.exposure_tim": 1.0}, "did you mean exposure_time"),
        ({"scene.rig.lasers[3].power": 1.0}, r"no such field; found scene.rig.lasers\[3\].power: 3"),
        ({"seed.more": 1}, "nothing below a plain value"),
        ({"sensor.exposure_time": -1.0}, "greater than"),
        ({"render.transport": "all"}, "render.transport"),
    ],
)
def test_a_field_or_value_that_the_project_does_not_allow_is_told(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        with_fields(Project.load("plane"), fields, "sweep 'a'")


def test_a_base_outside_the_studys_folder_is_not_read(tmp_path: Path) -> None:
    study = Study.model_validate({"base": "../other/project.json", "sweeps": [SWEEP]})
    with pytest.raises(InputError, match="leaves the project folder"):
        study.bases(tmp_path)


def test_a_base_that_is_not_there_or_lacks_the_laser_is_told_with_what_there_is(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no such base project; found plan; allowed: .*, plane"):
        Study.model_validate({"base": "plan", "sweeps": [SWEEP]}).bases(tmp_path)
    with pytest.raises(InputError, match=r"laser, of plane: there is no such laser.*found 1; allowed: 0"):
        Study.model_validate({"base": "plane", "laser": 1, "sweeps": [SWEEP]}).bases(tmp_path)


def test_an_unknown_study_is_told_with_the_ready_made_ones() -> None:
    with pytest.raises(InputError, match="quick"):
        Study.load("quik")


def test_cells_that_differ_in_sensor_or_method_share_a_render_and_no_key() -> None:
    study = study_of(SWEEP, methods=("likelihood", "phase"), set={"render.goal": None})
    cells = next_cells(study, bases_of(study), {})
    assert len({cell.key for cell in cells}) == len(cells) == 2 * 2 * 3
    assert len({cell.render_key for cell in cells}) == 3  # one a repeat: each has its own seed


def test_light_that_is_rendered_for_one_sensor_is_shared_with_no_other() -> None:
    study = study_of(SWEEP, methods=("likelihood", "phase"))
    cells = next_cells(study, bases_of(study), {})
    assert {cell.render_key for cell in cells} == {cell.key for cell in cells}


def test_laser_power_is_scaled_and_the_scan_axis_is_not() -> None:
    power = {"name": "p", "vary": [{"field": "scene.rig.lasers[0].power", "values": [0.01, 0.02]}]}
    axis = {"name": "x", "vary": [{"field": "extraction.axis", "values": ["rows", "columns"]}]}
    for sweep, renders in ((power, 1), (axis, 2)):
        study = study_of(sweep, repeats=1, set={"render.goal": None})
        assert len({cell.render_key for cell in next_cells(study, bases_of(study), {})}) == renders


def test_more_values_methods_or_repeats_keep_the_keys_that_are_there() -> None:
    small = study_of(SWEEP)
    more = {"name": "b", "vary": [{"field": "sensor.exposure_time", "values": [0.004, 0.002, 0.001]}]}
    large = study_of(more, methods=("phase", "likelihood"), repeats=5)
    keys = {cell.key for cell in next_cells(small, bases_of(small), {})}
    assert keys < {cell.key for cell in next_cells(large, bases_of(large), {})}
    assert small.digest(bases_of(small)) == large.digest(bases_of(large))


def in_range(low: float, high: float, count: int, spacing: str, field: str = "scene.rig.lasers[0].power") -> Study:
    return study_of(
        {"name": "a", "vary": [{"field": field, "low": low, "high": high, "count": count, "spacing": spacing}]}
    )


@pytest.mark.parametrize(
    ("small", "large"),
    [
        ((0.01, 0.04, 3, "logarithmic"), (0.01, 0.08, 4, "logarithmic")),
        ((0.01, 0.1, 4, "linear"), (0.01, 0.19, 7, "linear")),
        ((math.radians(10), math.radians(40), 4, "linear", "boards.most_tilt"),
         (math.radians(10), math.radians(80), 8, "linear", "boards.most_tilt")),
    ],
)  # fmt: skip
def test_a_range_that_is_extended_keeps_the_cells_that_are_there(
    small: tuple[Any, ...], large: tuple[Any, ...]
) -> None:
    fewer, more = in_range(*small), in_range(*large)
    assert not set(points(fewer.sweeps[0])) <= set(points(more.sweeps[0])), "they differ in the last bits"
    rows = {cell.key: {} for cell in next_cells(fewer, bases_of(fewer), {})}
    left = next_cells(more, bases_of(more), rows)
    assert {cell.point for cell in left} == set(points(more.sweeps[0])[small[2] :])


def test_cells_of_values_that_are_no_longer_asked_for_are_counted() -> None:
    """Of four steps in a range two are among five; 12 new cells were told, and not that 6 dropped out of the chart."""
    fewer, more = (
        study_of({"name": "a", "vary": [{"field": "sensor.exposure_time", "low": 1e-3, "high": 1e-2, "count": count}]})
        for count in (4, 5)
    )
    seconds = dict.fromkeys(SECONDS, 1.0)
    rows = {cell.key: seconds for cell in next_cells(fewer, bases_of(fewer), {})}
    assert estimate(fewer, bases_of(fewer), rows, {}).left_over == 0
    told = estimate(more, bases_of(more), rows, {})
    assert (told.cells, told.left_over) == (9, 6)


def test_cells_that_were_named_by_every_bit_of_their_values_are_still_known() -> None:
    study = in_range(0.01, 0.08, 7, "logarithmic")
    cells = next_cells(study, bases_of(study), {})
    long = [point for point in points(study.sweeps[0]) if float(f"{point[0]:.12g}") != point[0]]
    assert sum(bool(cell.former_key) for cell in cells) == 3 * len(long) > 0
    rows = {cell.former_key or cell.key: {} for cell in cells}
    assert next_cells(study, bases_of(study), rows) == []
    assert len(list(measured_cells(study, 0, bases_of(study), rows))) == len(cells)


def test_quasi_random_points_fill_their_ranges_and_are_the_same_each_time() -> None:
    vary = [{"field": "sensor.exposure_time", "low": 1e-4, "high": 1e-2, "spacing": "logarithmic"},
            {"field": "sensor.read_noise", "low": 0.0, "high": 8.0}]  # fmt: skip
    sweep = study_of({"name": "s", "vary": vary, "sampling": "sobol", "samples": 32}).sweeps[0]
    found = points(sweep)
    assert found == points(sweep) and len(set(found)) == 32
    assert all(1e-4 <= a <= 1e-2 and 0.0 <= b <= 8.0 for a, b in found)  # type: ignore[operator]
    assert sum(a < 1e-3 for a, _ in found) == 16  # type: ignore[operator, misc]


def test_a_study_of_too_many_cells_is_refused_by_its_number() -> None:
    many = {"field": "sensor.read_noise", "low": 0.0, "high": 8.0, "count": 10_000}
    study = study_of({"name": "s", "vary": [many]}, repeats=1000)
    with pytest.raises(InputError, match="10000000 cells"):
        check_size(study)


def test_each_repeat_has_its_seed_and_nothing_else_of_its_own() -> None:
    study = study_of(SWEEP)
    cells = list(cells_at(study, 0, bases_of(study), [(0.001,)]))
    assert [cell.project.seed for cell in cells] == [1, 2, 3]
    assert len({cell.project.model_copy(update={"seed": 0}).to_text() for cell in cells}) == 1
