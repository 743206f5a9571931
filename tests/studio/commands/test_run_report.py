"""A report can be run again: to the same bits, with the same files, and nothing in it leaves the folder."""

from __future__ import annotations

import html
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import main
from analysis.cloud import read_ply
from render.base.errors import InputError
from render.progressive import refine
from render.run import Run, never
from render.world.world import build_world
from studio.project.project import Project
from studio.scan.export import Exported, export_report
from studio.scan.redevelop import develop_again, development, measure_again
from studio.scan.run_record import ELEMENT, read_run, unequal
from studio.scan.stages import scaled
from tests.quick_reports import drawn_quickly
from tests.studio.small_scan import SCALE, contents, scan, small_project


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main.cli, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project's folder, with a scan of a seed and scale of its own in `out`."""
    folder = tmp_path_factory.mktemp("project")
    with drawn_quickly():
        scan(small_project(folder), folder / "out", report=True, seed=7)
    return folder


def edited(source: Path, target: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    """A copy of a report with another record."""
    text = source.read_text(encoding="utf-8")
    record = json.loads(html.unescape(ELEMENT.findall(text)[0]))
    change(record)
    element = f'<template id="blazer-run">{html.escape(json.dumps(record))}</template>'
    target.write_text(ELEMENT.sub(lambda _: element, text), encoding="utf-8")
    return target


def test_a_report_run_again_gives_every_number_and_file_to_the_bit(scanned: Path, tmp_path: Path) -> None:
    done = call("run", scanned / "out" / "report.html", "--no-report", "--out", tmp_path, "--json", "--quiet")
    assert done.exit_code == 0, done.output
    first, second = (json.loads((at / "scan.json").read_text()) for at in (scanned / "out", tmp_path))
    assert json.loads(done.stdout)["reproduced"] and first["results"] == second["results"]
    same = ("seed", "image_scale", "frames", "notes", "remarks", "light")
    assert {name: first[name] for name in same} == {name: second[name] for name in same} and first["seed"] == 7
    assert contents(scanned / "out") == contents(tmp_path)


def test_the_record_is_inert_text_and_holds_the_errors_of_all_points(scanned: Path) -> None:
    page = scanned / "out" / "report.html"
    assert "<script" not in page.read_text(encoding="utf-8")
    points, written = read_run(page).points(0), read_ply(scanned / "out" / "points.ply")
    assert np.array_equal(points["row"], written["row"]) and np.array_equal(points["step"], written["step"])
    np.testing.assert_array_equal(points["error"], written["error_depth"])


def test_a_report_alone_asks_for_its_files_by_name_and_takes_them_from_the_root(scanned: Path, tmp_path: Path) -> None:
    alone = tmp_path / "mail" / "report.html"
    alone.parent.mkdir()
    shutil.copyfile(scanned / "out" / "report.html", alone)
    missing = call("run", alone, "--out", tmp_path / "out")
    assert missing.exit_code == 2 and "plate.obj (missing)" in missing.stderr and "--root" in missing.stderr
    changed = tmp_path / "changed"
    shutil.copytree(scanned, changed)
    (changed / "grain.png").write_bytes(b"other")
    other = call("run", alone, "--root", changed, "--out", tmp_path / "out")
    assert other.exit_code == 2 and "grain.png (changed since)" in other.stderr and "plate.obj" not in other.stderr
    found = call("run", alone, "--root", scanned, "--out", tmp_path / "out", "--no-report", "--json", "--quiet")
    assert found.exit_code == 0 and json.loads(found.stdout)["reproduced"]


@pytest.mark.parametrize("path", ["../plate.obj", "/etc/passwd", "C:\\plate.obj"])
def test_a_hostile_path_in_a_report_never_leaves_the_folder(scanned: Path, tmp_path: Path, path: str) -> None:
    source = scanned / "out" / "report.html"

    def of_inputs(record: dict[str, Any]) -> None:
        record["inputs"][path] = "0" * 64

    def of_mesh(record: dict[str, Any]) -> None:
        record["project"]["scene"]["objects"][0]["shape"]["path"] = path

    for change in (of_inputs, of_mesh):
        page = edited(source, tmp_path / "report.html", change)
        done = call("run", page, "--root", scanned, "--out", tmp_path / "out")
        assert done.exit_code == 2 and "the path" in done.stderr and path in done.stderr
        assert not (tmp_path / "out" / "scan.json").exists()


def test_other_settings_are_refused_by_their_option(scanned: Path, tmp_path: Path) -> None:
    page = scanned / "out" / "report.html"
    for option, value in (("--scale", "0.5"), ("--seed", "1"), ("--method", "gaussian"), ("--steps", "1")):
        done = call("run", page, option, value, "--out", tmp_path)
        assert done.exit_code == 2 and option in done.stderr
    done = call("run", scanned, "--root", scanned, "--out", tmp_path)
    assert done.exit_code == 2 and "--root" in done.stderr


def test_a_report_is_never_replaced_by_its_own_second_run(scanned: Path) -> None:
    page = scanned / "out" / "report.html"
    before = page.read_bytes()
    done = call("run", page, "--out", scanned / "out")
    assert done.exit_code == 2 and page.read_bytes() == before


def test_what_is_no_report_or_damaged_is_told_in_one_message(scanned: Path, tmp_path: Path) -> None:
    source, page = scanned / "out" / "report.html", tmp_path / "report.html"
    bad: list[tuple[bytes, str]] = [
        (b"", "0 records"),
        (b"\xff\xfe", "no report"),
        (b"<html></html>", "run the project"),
        (b'<template id="blazer-run">{}</template>', "no project"),
        (b'<template id="blazer-run">{}</template>' * 2, "2 records"),
        (b'<template id="blazer-run">{&quot;a</template>', "report's record"),
    ]
    for data, words in bad:
        page.write_bytes(data)
        with pytest.raises(InputError, match=words):
            read_run(page)
    for change in ({"image_scale": -1}, {"frames": "two"}, {"format_version": 9}, {"inputs": {"a": "short"}}):
        with pytest.raises(InputError, match=next(iter(change))):
            read_run(edited(source, page, lambda record, change=change: record.update(change)))
    with pytest.raises(InputError, match="damaged"):
        read_run(edited(source, page, lambda record: record.update(points=["no base64!"]))).points(0)


def exported(folder: Path, **kept: Any) -> Exported:
    """What the window exports of the first step, which it developed and measured by methods of a person's choice."""
    project = scaled(Project.load(small_project(folder)), SCALE)
    world = build_world(project.scene, folder, 0)
    *_, frame = refine(world, project.scene, settings=project.render, run=Run(seed=project.seed, threads=1))
    how = development(project, project)
    images = develop_again(frame, how, threads=1)
    chosen = (project.extraction.method, "parabola", "centre_of_mass")
    found = measure_again(frame, world, how, images, chosen, cancelled=never, threads=1)
    return Exported(how.powered, project, folder, world, frame, tuple(images), found, SCALE, **kept)


def test_a_report_of_the_window_runs_again_to_the_bit(tmp_path: Path, quick_reports: None) -> None:
    page, out = tmp_path / "project" / "seen.html", tmp_path / "out"
    export_report(page, exported(page.parent, repeatable=True))
    done = call("run", page, "--no-report", "--out", out, "--json", "--quiet")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["reproduced"]
    rows = read_run(page).record.results
    assert [one["method"] for one in rows] == ["likelihood", "centre_of_mass"] and rows[0]["points"] > 0


def test_a_report_that_no_run_repeats_holds_no_record(tmp_path: Path, quick_reports: None) -> None:
    page = tmp_path / "seen.html"
    what = exported(tmp_path, repeatable=True)
    laser = what.project.scene.lasers[0]
    rig = what.project.scene.rig.model_copy(update={"lasers": (laser.model_copy(update={"power": 2 * laser.power}),)})
    brighter = what.project.model_copy(update={"scene": what.project.scene.model_copy(update={"rig": rig})})
    for other in (replace(what, repeatable=False), replace(what, project=brighter)):
        export_report(page, other)
        with pytest.raises(InputError, match="does not say what was run"):
            read_run(page)


def test_numbers_that_differ_are_named_with_their_place() -> None:
    assert unequal([{"a": 1.0, "b": [2.0]}], [{"a": 1.0, "b": [2.0]}]) == []
    assert unequal([{"a": 1.0, "b": [2.0]}], [{"a": 1.0, "b": [2.5]}]) == ["[0].b[0]: 2.5, then 2.0"]
