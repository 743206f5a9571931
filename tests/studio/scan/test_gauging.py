"""The project's measures go through a scan into table, record and console, and are measured anew."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import main
from analysis.gauges.gauge import Gauge
from analysis.gauges.read import MISFITS, OTHER_SHAPE, Reading
from analysis.report.gauge_table import UNPROVED, cells, missing_of, over_steps, reasons, worst_of
from analysis.report.units import NONE
from render.base.errors import InputError
from render.run import Run
from render.scene.motion import LinearStage
from render.world.world import build_world
from studio.project.project import Project
from studio.scan.gauging import (
    SINCE_SCAN,
    judged_over_steps,
    kept_readings,
    measures_record,
    profiles,
    read_each,
    step_readings,
    verdict_counts,
    worst,
    write_measures,
)
from studio.scan.line_extraction import extract_line
from studio.scan.options import ScanOptions
from studio.scan.scan import run_scan
from studio.scan.scan_folder import measured_project, open_folder
from studio.scan.stages import Clock, Measurement, compare_points, develop_step, render_step, triangulate_line
from tests.studio.scan_of_steps import small_project as scan_of_steps
from tests.studio.small_scan import scan, small_project

FLAT = {"kind": "straightness", "regions": [[-0.08, 0.08]]}
LEVEL = {"kind": "step", "regions": [[-0.08, -0.01], [0.01, 0.08]], "nominal": 0.0, "lower": -0.05, "upper": 0.05}


def with_measures(project: Project, *measures: dict[str, Any]) -> Project:
    return project.replaced({"measures": list(measures)})


def call(*arguments: object) -> str:
    """What a command line prints; it must succeed."""
    result = CliRunner().invoke(main.cli, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("gauging")
    file = small_project(folder)
    project = with_measures(Project.load(file), {"name": "level", **LEVEL}, {"name": "bow", **FLAT, "step": 1})
    scan(file, folder / "out", project=project)
    return folder / "out"


def test_every_frame_is_read_and_the_plate_is_flat_within_its_sigma(scanned: Path) -> None:
    rows = table(scanned)
    assert [(row["name"], row["step"]) for row in rows] == [("level", "0"), ("level", "1"), ("bow", "1")]
    for row in rows:
        assert abs(float(row["truth"])) < 1e-9
        assert abs(float(row["error"])) < 4.0 * float(row["sigma"]) < 0.02
    assert [row["verdict"] for row in rows] == ["pass", "pass", ""]


def test_every_row_says_in_which_section_it_was_read(scanned: Path, tmp_path: Path) -> None:
    """The same file said first fail and then pass, with another section, and nothing of that."""
    file = scanned.parent / "across.json"
    project = open_folder(scanned).project.model_copy(update={"measured_in": "across_y"})
    file.write_text(project.to_text(), encoding="utf-8")
    assert {row["section"] for row in table(scanned)} == {"in the laser's plane"}
    call("reconstruct", scanned, "--project", file, "--out", tmp_path)
    assert {row["section"] for row in table(tmp_path)} == {"in a section across Y"}
    assert (tmp_path / "measures.csv").read_text(encoding="utf-8").splitlines()[0].endswith(",remark,section")


def test_a_profile_knows_how_strong_its_line_is_and_the_exact_one_is_of_the_middles_of_scan_lines(
    tmp_path: Path,
) -> None:
    project, clock = Project.load(small_project(tmp_path)), Clock(lambda stage, done: None, lambda: False)
    world = build_world(project.scene, tmp_path, 0)
    frame = render_step(project, world, 0, clock, Run(threads=2))
    image = develop_step(project, frame, clock, 2)[0]
    line = extract_line(project, image, 0)
    points = triangulate_line(project, line, 0, 0)
    errors = compare_points(project, frame, world, points, line, 0)
    measured, exact = profiles(project, frame, Measurement(0, 0, image, line, points, errors), "laser_plane")
    assert measured.strength is not None and exact.strength is None
    assert measured.strength == pytest.approx(line.amplitude[measured.index, 0]) and len(measured.index) > 20
    # of a point that no exact line is beside, the nearest face is any
    assert measured.normal is not None and np.isfinite(measured.normal[1:-1]).all()
    alone = replace(errors, truth=np.where(np.arange(len(errors.truth)) % 2, errors.truth, -1))
    measured, _ = profiles(project, frame, Measurement(0, 0, image, line, points, alone), "laser_plane")
    assert measured.normal is not None and np.isnan(measured.normal).any(axis=1).mean() == pytest.approx(0.5, abs=0.1)


def table(folder: Path) -> list[dict[str, str]]:
    with open(folder / "measures.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("remark", [OTHER_SHAPE, *MISFITS.values()])
def test_points_that_miss_the_curve_are_marked_beside_the_verdict_in_the_report(remark: str) -> None:
    """The remark stood below the table, and the row had a pass like any other, which a misfit cannot prove."""
    gauge = Gauge(name="a", kind="peak", regions=((-0.3, -0.1), (0.0, 0.3)), nominal=0.2, upper=0.1)
    told = f"the section crosses its faces 13.0° obliquely; {remark.format(63.0)}"
    one = Reading(gauge, 0, value=0.2, sigma_random=1e-5, sigma_systematic=0.0, remark=told)
    for value in (0.2, 0.5):
        row = judged_over_steps(gauge, [replace(one, value=value)])
        assert cells(row)[5] == "?\u00a0undecided, misfit" and row["verdicts"] == {"undecided": 1}
        assert reasons([row])[0].endswith(f"times their sigma{remark.partition('sigma')[2]}; {UNPROVED}")
    assert cells(judged_over_steps(gauge, [replace(one, remark="")]))[5] == "✓\u00a0pass"
    bare = replace(one, gauge=gauge.model_copy(update={"nominal": None, "upper": None}))
    row = judged_over_steps(bare.gauge, [bare])
    assert cells(row)[5] == "misfit" and UNPROVED not in reasons([row])[0]


def test_an_oblique_section_stands_beside_the_verdict_in_the_report() -> None:
    gauge = Gauge.model_validate({"name": "a", **LEVEL})
    remark = "the section crosses its faces 13.0° obliquely: square to them it is 0.0100 mm; turn the laser"
    found = Reading(
        gauge, 0, value=0.2, sigma_random=1e-5, sigma_systematic=0.0, remark=remark, oblique=0.2269, square=1e-5
    )
    (row,) = measures_record((gauge,), (found,))
    assert cells(row)[5] == "✗\u00a0fail, 13.0° oblique" and reasons([row]) == [f"a: {remark}"]
    assert row["square"] == 1e-5


def test_the_record_has_one_entry_a_measure(scanned: Path) -> None:
    rows = open_folder(scanned).manifest["measures"]
    assert [(row["name"], row["readings"], row["verdicts"]) for row in rows] == [
        ("level", 2, {"pass": 2}),
        ("bow", 1, {"no tolerance": 1}),
    ]


def test_other_measures_are_read_off_the_same_frames(scanned: Path, tmp_path: Path) -> None:
    away = {"name": "away", "kind": "radius", "regions": [[0.5, 0.6]]}
    project = with_measures(open_folder(scanned).project, {"name": "new", **FLAT}, away)
    file = scanned.parent / "other.json"
    file.write_text(project.to_text(), encoding="utf-8")
    told = json.loads(call("reconstruct", scanned, "--project", file, "--json"))["measures"]
    assert [row["name"] for row in told] == ["new", "away"]
    assert told[1]["value"] is None and "too few points" in told[1]["reason"]
    assert measured_project(open_folder(scanned)).measures == project.measures
    shown = call("reconstruct", scanned, "--project", file, "--out", tmp_path)
    assert "Straightness (bow)" in shown and "away is not measured: too few points" in shown


def test_the_worst_reading_without_a_nominal_is_the_farthest_off_the_truth() -> None:
    gauge = Gauge(kind="step", regions=((-0.08, -0.01), (0.01, 0.08)))
    readings = [Reading(gauge, step, value=0.01 + off, truth=0.01) for step, off in enumerate((1e-6, -2e-5, 9e-6))]
    assert worst(readings).step == 1
    # of stray points, where the exact line does not reach: 464 mm from all others it was passed over
    away = Reading(gauge, 3, value=-0.412485, sigma_random=0.0192)
    assert worst([*readings, away]).step == 3
    (row,) = measures_record((gauge,), [*readings, away])
    assert worst_of(row) == "farthest off the truth: step 4 of 4"
    assert worst([away]).step == 3


@pytest.mark.parametrize(
    ("limits", "step"), [({"lower": -1e-4}, 0), ({"upper": 1e-4}, 3), ({"lower": -1e-4, "upper": 5e-5}, 3), ({}, 3)]
)
def test_the_worst_reading_is_the_nearest_to_its_limit(limits: dict[str, float], step: int) -> None:
    """Of 39.964 to 40.038 mm, of which none may be below 39.9, the first; the last was told."""
    gauge = Gauge(kind="step", regions=((-0.08, -0.01), (0.01, 0.08)), nominal=0.04, **limits)
    values = (0.039964, 0.040001, 0.040022, 0.040038)
    readings = [Reading(gauge, k, value=value, sigma_random=1e-6, truth=0.04) for k, value in enumerate(values)]
    assert worst(readings).step == step


def test_the_worst_reading_speaks_for_a_measure() -> None:
    gauge = Gauge.model_validate({"name": "a", **LEVEL})
    good = Reading(gauge, 0, value=0.0, sigma_random=1e-5, sigma_systematic=0.0)
    off = replace(good, step=1, value=0.04)
    unsure = replace(good, step=2, value=0.05)
    bad = replace(good, step=3, value=-0.2)
    none = Reading(gauge, 4, reason="too few points")
    for found, shown in ((good, off), 1), ((off, unsure), 2), ((unsure, bad, good), 3), ((none, off), 1), ((none,), 4):
        assert worst(found).step == shown
    assert measures_record((gauge,), ())[0]["reason"] == "no frame of its step was measured"


def test_a_step_that_was_not_measured_neither_hides_the_others_nor_passes() -> None:
    """Of 20 steps one had no points, and nothing was told of the others: not that 12 pass, nor that one fails."""
    gauge = Gauge.model_validate({"name": "a", **LEVEL})
    good = Reading(gauge, 0, value=0.0, sigma_random=1e-5, sigma_systematic=0.0)
    none = Reading(gauge, 3, reason="too few points")
    steps = (good, replace(good, step=1, value=0.03), good, none)
    for found, verdict, text in (
        (steps, "undecided", "?\u00a0undecided: 3 pass, 1 not measured, worst measured: step 2 of 4"),
        ((*steps, replace(good, step=4, value=-0.2)), "fail", "3 pass, 1 fail, 1 not measured, worst measured: step 5"),
        (steps[:3], "pass", "✓\u00a0pass: 3 pass, worst: step 2 of 3"),
        ((none, none), None, "not measured in any of 2 steps"),
    ):
        (row,) = measures_record((gauge,), found)
        assert row["verdict"] == verdict and text in cells(row)[5]
        assert (cells(row)[1] == NONE) == (verdict is None)
        missing = [one for one in found if one.reason]
        assert any("not measured" in one and "too few points" in one for one in reasons([row])) == bool(missing)


def test_a_stray_step_is_not_the_worst_and_what_the_others_come_to_is_told() -> None:
    """-10.86 mm of stray light was the value of a step of 12 mm that fourteen steps passed, printed as its failure."""
    gauge = Gauge.model_validate({"name": "a", **LEVEL, "nominal": 0.012, "lower": -5e-4, "upper": 5e-4})
    good = [Reading(gauge, k, value=0.012 + 1e-6 * k, sigma_random=2e-6, sigma_systematic=0.0) for k in range(14)]
    stray = Reading(gauge, 14, value=-0.01086, sigma_random=5.9e-4, sigma_systematic=0.0, stray=True)
    (row,) = measures_record((gauge,), [*good, stray, Reading(gauge, 15, reason="too few points")])
    assert row["step"] == 13 and row["verdict"] == "undecided" and row["verdicts"] == {"none": 2, "pass": 14}
    assert cells(row)[5] == "?\u00a0undecided: 14 pass, 2 not measured, worst measured: step 14 of 16"
    told = "a: median 12.0065\u00a0mm, from 12.0000 to 12.0130\u00a0mm, over the 14 of 16 steps that were measured"
    assert over_steps([row]) == [told]
    (missing,) = reasons([row])
    assert missing.startswith("a is not measured in 2 of 16 steps, first in step 15: the exact line does not reach")
    assert "-10.8600 mm" in missing
    for alone in (good[:1], [stray], []):
        assert over_steps([measures_record((gauge,), alone)[0]]) == []
    assert over_steps([{**row, "over_steps": None}]) == [], "of a former version"
    assert missing_of(row).startswith("in step 15: the exact line does not reach"), "as the window tells it"
    assert missing_of(measures_record((gauge,), good)[0]) == ""
    alone = judged_over_steps(gauge, [stray])
    assert missing_of(alone) == alone["reason"]
    assert alone["reason"] and alone["value"] is None, "a step that is looked at is judged alike"


def test_a_scan_that_goes_on_over_the_table_is_judged_by_the_steps_of_its_part(tmp_path: Path) -> None:
    """Of 20 steps the last four saw the table alone, and were four failures of 0.0 mm."""
    rise = {"name": "rise", "kind": "step", "regions": [[-0.04, -0.018], [-0.01, 0.012]], "nominal": -0.0103}
    flat = {"name": "flat", "kind": "flatness", "regions": [[-0.013, 0.013]]}
    project = with_measures(scan_of_steps(), {**rise, "lower": -1.2e-2, "upper": 1.2e-2}, flat)
    scene = project.scene.model_copy(update={"motion": LinearStage(step=(0.0075, 0.0, 0.0), steps=16)})
    project = project.model_copy(update={"scene": scene}).save(tmp_path / "table.json")
    run_scan(project, tmp_path, out=tmp_path / "out", options=ScanOptions(report=False))
    rows = [row for row in table(tmp_path / "out") if row["name"] == "rise"]
    beyond = [row for row in rows if "on the plane that parts stand on" in row["reason"]]
    assert len(beyond) >= 8 and beyond == rows[-len(beyond) :] and not any(row["value"] for row in beyond)
    of_part = [row for row in rows if row["value"]]
    assert len(of_part) >= 6 and {row["verdict"] for row in of_part} == {"pass"}
    record, of_flat = open_folder(tmp_path / "out").manifest["measures"]
    assert record["verdict"] == "undecided" and record["over_steps"]["measured"] == len(of_part)
    assert record["verdicts"] == {"none": 16 - len(of_part), "pass": len(of_part)}
    # most of the steps are of the table, which is not what is asked for
    assert of_flat["truth"] == pytest.approx(0.0, abs=1e-6) and of_flat["value"] < 4.0 * of_flat["sigma"]
    assert f"in {len(beyond)} of the steps its region lies on the plane that parts stand on" in of_flat["remark"]


def test_the_table_of_a_scan_is_judged_by_another_tolerance(tmp_path: Path) -> None:
    level, bow = (Gauge.model_validate(one) for one in ({"name": "level", **LEVEL}, {"name": "bow", **FLAT}))
    read = [Reading(level, k, value=1e-3 * k, sigma_random=1e-5, sigma_systematic=1e-6) for k in range(3)]
    file = tmp_path / "measures.csv"
    write_measures(file, [*read, Reading(level, 3, reason="too few points"), Reading(bow, 0, value=1e-4)])
    found = step_readings(file, (level, bow))
    assert verdict_counts(level, found[level]) == {"none": 1, "pass": 3}
    assert verdict_counts(bow, found[bow]) == {"no tolerance": 1}
    narrow = level.model_copy(update={"upper": 1e-3, "name": "renamed"})
    assert narrow.reads_as(level) and verdict_counts(narrow, found[level]) == {
        "fail": 1, "none": 1, "pass": 1, "undecided": 1,
    }  # fmt: skip
    assert step_readings(tmp_path / "none.csv", (level,)) == {}
    file.write_bytes(b"name,value,sigma_random\nlevel,wide\n\xff")
    assert step_readings(file, (level,)) == {}
    file.write_bytes(b"name,value,sigma_random\nlevel,wide\nother,1\n")
    assert verdict_counts(level, step_readings(file, (level,))[level]) == {"none": 1}


@pytest.mark.parametrize(
    ("measure", "told"),
    [
        ({"laser": 1}, r"measures\[1\].laser is 1; allowed: less than 1"),
        ({"step": 7}, r"measures\[1\].step is 7; allowed: less than 2"),
        ({"name": "a"}, r"measures\[1\].name is 'a'"),
        ({"nominal": "wide"}, r"measures\[1\].nominal"),
        ({"colour": 1}, r"measures\[1\].*colour"),
    ],
)
def test_a_measure_that_cannot_be_is_refused_by_its_field(measure: dict[str, Any], told: str, tmp_path: Path) -> None:
    project = Project.load(small_project(tmp_path))
    with pytest.raises(InputError, match=told):
        with_measures(project, {"name": "a", **FLAT}, {"name": "b", **FLAT, **measure})


def test_a_window_is_told_why_a_measure_is_not_of_its_frame() -> None:
    other_step, other_laser = (Gauge.model_validate(FLAT | more) for more in ({"step": 2}, {"laser": 1}))
    found = read_each((other_step, other_laser), 0, {})
    assert [one.reason for one in found] == ["it is of step 2 alone", "laser 1 was not rendered"]
    assert not any(one.verdict for one in found)


def test_a_scan_has_one_flatness_which_is_kept_for_who_looks_at_it(tmp_path: Path) -> None:
    file = small_project(tmp_path)
    flat = {"name": "flat", "kind": "flatness", "regions": [[-0.08, 0.08]], "nominal": 0.0, "upper": 0.01}
    project = with_measures(Project.load(file), {"name": "level", **LEVEL}, flat)
    motion = project.scene.motion.model_copy(update={"steps": 4})
    scan(file, tmp_path / "out", project=project.replaced({"scene": {**project.scene.model_dump(), "motion": motion}}))
    with open(tmp_path / "out" / "measures.csv", encoding="utf-8", newline="") as table:
        rows = list(csv.DictReader(table))
    assert [(row["name"], row["step"]) for row in rows] == [*(("level", str(k)) for k in range(4)), ("flat", "")]
    row = rows[-1]
    assert abs(float(row["truth"])) < 1e-9 and int(row["points"]) > 20
    assert 0.0 < float(row["value"]) < 4.0 * float(row["sigma"]) < 0.01 and row["verdict"] == "pass"
    shown = call("reconstruct", tmp_path / "out", "--out", tmp_path / "again")
    assert "Flatness (bow and twist)" in shown and "worst" not in shown.split("Flatness")[1]

    record = open_folder(tmp_path / "out").manifest["measures"]
    wider = project.measures[1].model_copy(update={"name": "renamed", "upper": 0.2})
    elsewhere = wider.model_copy(update={"regions": ((-0.05, 0.05),)})
    kept = kept_readings([wider, elsewhere], project.measures, record)
    assert kept[elsewhere].reason == SINCE_SCAN and not kept[elsewhere].points
    assert kept[wider].value == pytest.approx(float(row["value"]))
    told = kept_readings([wider], project.measures, [{}, {**record[1], "remark": "points miss the surface"}])
    assert told[wider].remark == "points miss the surface", "what is amiss with it is seen in the window as well"
    assert kept_readings([wider], project.measures, [{"value": "damaged"}, None])[wider].reason == ""
    assert kept_readings([wider], project.measures, "damaged")[wider].reason == SINCE_SCAN


def test_a_flatness_of_one_step_is_refused_with_what_is_allowed(tmp_path: Path) -> None:
    project = Project.load(small_project(tmp_path))
    with pytest.raises(InputError, match="allowed for flatness, which is of all steps: none"):
        with_measures(project, {"name": "flat", "kind": "flatness", "regions": [[-0.08, 0.08]], "step": 1})
