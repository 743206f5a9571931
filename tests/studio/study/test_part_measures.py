"""A project's own measures of the part, as a study's: by name, with value, error and sigma, in table and chart."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import pytest

from analysis.gauges.gauge import Gauge
from render.base.errors import InputError
from studio.project.project import Project
from studio.runtime.workers import Engine
from studio.study.as_begun import begun_in, set_apart, told_apart
from studio.study.begin import begin
from studio.study.cells import next_cells
from studio.study.measures import measure_of, part_names
from studio.study.measuring import measure_task
from studio.study.store import Store
from studio.study.study import Study, told_laser
from studio.study.tables import write_tables
from studio.study.tasks import tasks

STEP = {
    "name": "First step",
    "kind": "step",
    "regions": [[-0.062, -0.05], [-0.03, -0.018]],
    "nominal": 0.01,
    "lower": -1e-3,
    "upper": 1e-3,
}
SWEEP = {"name": "a", "vary": [{"field": "sensor.exposure_time", "values": [0.001, 0.002]}]}


def study_of(measure: str, *references: dict[str, Any]) -> tuple[Study, dict[str, Project]]:
    sweep = {**SWEEP, "measure": measure, "references": references}
    study = Study.model_validate(
        {"base": "step_block", "sweeps": [sweep], "repeats": 3, "image_scale": 0.2,
         "methods": ["likelihood"], "set": {"render.goal": None}}
    )  # fmt: skip
    base = Project.load("step_block")
    return study, {"step_block": base.replaced({"measures": [STEP]}).in_folder(base.folder)}


def test_every_cell_has_the_part_s_own_numbers(tmp_path: Path) -> None:
    study, bases = study_of("length_error:First step")
    cells = next_cells(study, bases, {})
    rows: dict[str, Any] = {}
    for task in tasks(cells[:2], study.image_scale, study.laser):
        rows |= {key: {**measured, **seconds} for key, measured, seconds in measure_task(task)}
    assert len(rows) == 2
    for row in rows.values():
        value, error, sigma = (row[f"length_{kind}:First step"] for kind in ("value", "error", "sigma"))
        assert math.isfinite(value) and sigma > 0.0
        # the truth by the same definition is the block's rise, a little longer along a sheet that is not upright
        assert abs(error) < 6.0 * sigma and value - error == pytest.approx(-0.01, rel=0.05)
    write_tables(tmp_path, study, bases, rows)
    with open(tmp_path / "table.csv", newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert {float(row["length_value:First step"]) for row in table} == {
        row["length_value:First step"] for row in rows.values()
    }


def test_names_say_what_is_there_and_others_are_refused() -> None:
    study, bases = study_of("length_error:Second step")
    with pytest.raises(InputError, match="length_error:First step"):
        next_cells(study, bases, {})
    theirs = {"label": "data sheet", "measure": "length_sigma:Second step", "value": 1e-5, "point": [0.001]}
    with pytest.raises(InputError, match="length_sigma:First step"):
        next_cells(*study_of("depth_rmse", theirs), {})
    assert part_names(bases["step_block"].measures) == [
        f"length_{kind}:First step" for kind in ("value", "error", "sigma")
    ]
    shown = measure_of("length_error:First step")
    assert (shown.label, shown.unit, shown.signed) == ("First step, error against the truth", "µm", True)
    assert measure_of("depth_rmse").unit == "µm"
    section = {"name": "seam", "kind": "area", "regions": [[0.0, 0.01], [0.02, 0.03]]}
    assert part_names([Gauge.model_validate(section)])[0] == "area_value:seam"
    assert measure_of("area_value:seam").unit == "mm²"
    for name in ("length_error:", "volume_error:x", "depth"):
        with pytest.raises(KeyError):
            measure_of(name)


def test_a_folder_that_goes_on_keeps_the_measures_that_it_was_begun_with(tmp_path: Path) -> None:
    """Those that the study does not ask for; one that it asks for makes another study, told before anything runs."""
    study, bases = study_of("depth_rmse")
    with Store(tmp_path, study.digest(bases)) as store:
        store.describe(study, bases)
    base = bases["step_block"]
    for later in ({"measures": []}, {"measured_in": "upright"}, {"measures": [STEP, {**STEP, "name": "Other"}]}):
        now = {"step_block": base.replaced(later).in_folder(base.folder)}
        again = begun_in(tmp_path, study, now)
        assert again == bases and again["step_block"].folder == base.folder
    asking, _ = study_of("length_error:First step")
    for later in ({"measured_in": "upright"}, {"measures[0].nominal": 0.02}):
        now = {"step_block": base.replaced(later).in_folder(base.folder)}
        assert begun_in(tmp_path, asking, now) == now
    varied = study.model_copy(update={"set": {**study.set, "measured_in": "across_x"}})
    now = {"step_block": base.replaced({"measures": []}).in_folder(base.folder)}
    assert begun_in(tmp_path, varied, now) == now
    assert begun_in(tmp_path / "other", study, now) == now


def test_another_set_up_is_told_by_the_fields_that_differ(tmp_path: Path) -> None:
    study, bases = study_of("depth_rmse")
    with Store(tmp_path, study.digest(bases)) as store:
        store.describe(study, bases)
    base = bases["step_block"]
    now = {"step_block": base.replaced({"sensor.bits": 8, "measured_in": "upright"}).in_folder(base.folder)}
    smaller = study.model_copy(update={"image_scale": 0.031})
    told = set_apart(smaller, now, study, bases)
    assert (
        len(told) == 2
        and told[0].startswith("Image scale: ")
        and told[1] == "Sensor: Bit depth: 12 in the folder, 8 now"
    )
    with pytest.raises(InputError, match="Bit depth: 12 in the folder, 8 now"), begin(tmp_path, study, now, Engine(1)):
        pass


def test_a_calibration_that_was_taken_over_since_is_told_without_its_numbers() -> None:
    study, bases = study_of("depth_rmse")
    base = bases["step_block"]

    def calibrated(distance: float) -> dict[str, Project]:
        plane, matrix = (
            [0.9743806882629759, 0.0, -0.2249053, distance],
            [[0.0252 * (i == j) for j in range(8)] for i in range(8)],
        )
        found = {"calibration.covariances": [matrix], "calibration.planes": [plane]}
        return {"step_block": base.replaced(found).in_folder(base.folder)}

    first = set_apart(study, calibrated(-0.1), study, bases)
    assert [one.rpartition("Laser planes: ")[2] for one in first[:1]] == ["none in the folder, there is one now"]
    assert told_apart(first).count("there is one now") == 2 and "0.97" not in told_apart(first)
    lens = base.scene.camera
    camera = {name: getattr(lens, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
    with_camera = {"step_block": base.replaced({"calibration.camera": camera}).in_folder(base.folder)}
    told = told_apart(set_apart(study, with_camera, study, bases))
    assert "Camera: none in the folder, there is one now" in told and "CalibratedCamera" not in told
    assert "Camera: one in the folder, none now" in told_apart(set_apart(study, bases, study, with_camera))
    (second,) = set_apart(study, calibrated(-0.2), study, calibrated(-0.1))
    assert second.endswith("Laser planes: another one in the folder")


def test_another_laser_is_told_by_its_name() -> None:
    """In the folder and now were 0 and 1, and the window chooses them by their names."""
    study, bases = study_of("depth_rmse")
    base = bases["step_block"]
    (laser,) = base.scene.lasers
    rig = {"scene.rig.lasers": [laser.model_dump(mode="json"), {**laser.model_dump(mode="json"), "name": "second"}]}
    two = {"step_block": base.replaced(rig).in_folder(base.folder)}
    other = study.model_copy(update={"laser": 1})
    assert set_apart(other, two, study, two) == (f"Laser: {laser.name} in the folder, second now",)
    assert told_laser(other, two) == ["of second, one of 2 lasers"] and told_laser(study, bases) == []


def test_digests_of_meshes_that_saving_writes_lock_nothing_out(tmp_path: Path) -> None:
    study, bases = study_of("depth_rmse")
    base = bases["step_block"]
    shape = {"kind": "file", "path": "meshes/part.ply", "unit": "mm"}

    def with_digest(digest: str | None) -> dict[str, Project]:
        return {"step_block": base.replaced({"scene.objects[0].shape": {**shape, "sha256": digest}})}

    unsaved, saved, other = (with_digest(digest) for digest in (None, "0" * 64, "1" * 64))
    for folder, begun in ((tmp_path / "unsaved", unsaved), (tmp_path / "saved", saved)):
        folder.mkdir()
        with Store(folder, study.digest(begun)) as store:
            store.describe(study, begun)
    assert begun_in(tmp_path / "unsaved", study, saved) == unsaved
    assert begun_in(tmp_path / "saved", study, other) == other


def test_another_name_of_the_base_projects_file_is_no_other_study(tmp_path: Path) -> None:
    """A project that is saved for the first time, or copied, holds what it held."""
    study, bases = study_of("depth_rmse")
    base = bases["step_block"]
    with Store(tmp_path, study.digest(bases)) as store:
        store.describe(study, bases)
    renamed = study.model_copy(update={"base": "p1.json"})
    moved = {"p1.json": base.replaced({"name": "p1"}).in_folder(tmp_path)}
    assert set_apart(renamed, moved, study, bases) == ()
    with begin(tmp_path, renamed, begun_in(tmp_path, renamed, moved), Engine(1)):
        pass
    other = {"p1.json": base.replaced({"sensor.bits": 8})}
    assert set_apart(renamed, other, study, bases) == ("Sensor: Bit depth: 12 in the folder, 8 now",)
    assert renamed.digest(other) != study.digest(bases)


def test_of_several_base_projects_with_other_names_each_is_held_against_its_own() -> None:
    study, bases = study_of("depth_rmse")
    first = bases["step_block"]
    second = first.replaced({"sensor.bits": 8, "sensor.read_noise": 4.0})
    now = {"b.json": second.replaced({"sensor.read_noise": 5.0}), "a.json": first}
    told = set_apart(study, now, study, {"one.json": first, "two.json": second})
    assert told == ("Sensor: Read noise: 4 e- in the folder, 5 e- now",)
