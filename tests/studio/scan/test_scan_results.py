"""A finished scan is looked at a step at a time, and what is said of all its steps is what its files say."""

from __future__ import annotations

import json
import math
import shutil
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from analysis.cloud import merge, read_ply, write_ply
from render.base.errors import InputError
from render.output.frame_files import read_frame
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.templates import new_project
from studio.scan import scan_results
from studio.scan.point_sample import PointSample
from studio.scan.result_series import ERROR_VIEWS
from studio.scan.scan_folder import ScanFolder, open_folder
from studio.scan.scan_results import holds_scan, is_scan_of, is_unfinished, read_results, source_of
from studio.scan.stages import scaled
from tests.studio.scan_of_steps import SCALE, small_scan

DEPTH, SURFACE, POSITION = ERROR_VIEWS


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return small_scan(tmp_path_factory.mktemp("scan"))


@pytest.fixture
def copy(scanned: tuple[Path, Path], tmp_path: Path) -> Path:
    """Of the results, to be damaged; the project stays where it is."""
    shutil.copytree(scanned[0].parent, tmp_path / "project")
    return Path(shutil.copytree(scanned[1], tmp_path / "scan"))


def edit_manifest(folder: Path, **values: object) -> None:
    file = folder / "scan.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | values))


def test_each_step_is_read_as_it_was_written(scanned: tuple[Path, Path]) -> None:
    results = read_results(open_folder(scanned[1]))
    assert results.count == 3 and results.image_scale == SCALE and results.measured and results.report is None
    frame, world = results.read_step(1, None)
    assert frame.step == 1
    np.testing.assert_array_equal(frame.laser_direct[0], read_frame(scanned[1] / "frame_0001.exr").laser_direct[0])
    assert results.read_step(2, world)[1] is world, "the rig moves: the part stays where it is"


@pytest.mark.parametrize(("view", "column"), [(DEPTH, "error_depth"), (SURFACE, "error_surface")])
def test_the_error_of_a_step_is_that_of_its_points(scanned: tuple[Path, Path], view, column) -> None:
    points = read_ply(scanned[1] / "points.ply")
    bias, rmse = read_results(open_folder(scanned[1])).by_step(0, view.kind)
    for step in range(3):
        error = points[column][points["step"] == step]
        assert bias[step] == pytest.approx(np.nanmean(error))
        assert rmse[step] == pytest.approx(np.sqrt(np.nanmean(error**2)))


def test_the_measures_of_all_steps_are_those_of_the_scan(scanned: tuple[Path, Path]) -> None:
    found = open_folder(scanned[1])
    row = found.manifest["results"][0]
    for view, key in ((DEPTH, "depth_m"), (SURFACE, "surface_error_m"), (POSITION, "line_px")):
        methods, rows = read_results(found).table(0, view)
        told = {name: values[0] for name, _, values in rows}
        assert methods[0] == row["method"] and len(methods) == 3
        assert told["Points"] == row["points"]
        # the manifest has those that completeness leaves out, whatever error is looked at
        assert told["Outliers in the image"] == pytest.approx(100.0 * row["outliers"] / row["points"])
        assert told["RMSE"] == pytest.approx(view.scale * row[key]["rmse"])
        assert told["RMSE"] ** 2 == pytest.approx(told["Bias"] ** 2 + told["Sigma"] ** 2)


def test_the_surface_error_of_an_older_manifest_turns_its_sign(scanned: tuple[Path, Path]) -> None:
    found = read_results(open_folder(scanned[1]))
    now = {name: values for name, _, values in found.table(0, SURFACE)[1] if name in ("Bias", "Sigma")}
    for row in found.found.manifest["results"]:
        row["surface_m"] = {**row.pop("surface_error_m")}
        row["surface_m"]["bias"] *= -1.0
    then = {name: values for name, _, values in found.table(0, SURFACE)[1] if name in ("Bias", "Sigma")}
    assert then == now and len(now) == 2 and abs(now["Bias"][0]) > 0.0


def test_what_the_report_remarks_on_is_kept_with_the_scan(scanned: tuple[Path, Path]) -> None:
    found = open_folder(scanned[1])
    assert found.manifest["remarks"] and read_results(found).remarks()[-1] == found.manifest["remarks"][-1]


def test_only_a_sample_of_the_points_is_held_but_all_are_counted(
    scanned: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = open_folder(scanned[1])
    whole = read_results(found)
    monkeypatch.setattr(scan_results, "PointSample", lambda: PointSample(60))
    sample = read_results(found)
    assert 30 <= len(sample.points["x"]) <= 60
    assert set(sample.points["step"]) == {0, 1, 2}
    np.testing.assert_array_equal(sample.by_step(0, "depth"), whole.by_step(0, "depth"))


def test_a_longer_scan_takes_no_more_memory(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scan_results, "PointSample", lambda: PointSample(1000))
    points = read_ply(copy / "points.ply")
    peaks = []
    for times in (400, 1600):
        write_ply(copy / "points.ply", merge([points] * times))
        tracemalloc.start()
        read_results(open_folder(copy))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.05 * peaks[0]


def test_a_scan_knows_its_project_at_full_size(scanned: tuple[Path, Path]) -> None:
    found, project = open_folder(scanned[1]), Project.load(scanned[0])
    assert is_scan_of(found, project)
    assert is_scan_of(found, project.model_copy(update={"name": "renamed", "seed": 3}))
    assert not is_scan_of(found, replaced(project, ("scene", "rig", "lasers", 0, "power"), 1e-3))
    assert not is_scan_of(found, scaled(project, SCALE)), "the scan's own size is not the scanner's"


def test_the_file_that_was_scanned_is_found_unless_it_was_edited(copy: Path) -> None:
    project = copy.parent / "project"
    replaced(Project.load(project / "steps.json"), ("sensor", "bits"), 8).save(project / "another.json")
    (project / "broken.json").write_text("{")
    assert source_of(open_folder(copy)) == (project / "steps.json").resolve()
    (project / "steps.json").rename(copy.parent / "saved later.json")
    assert source_of(open_folder(copy)) == (copy.parent / "saved later.json").resolve(), "it lies beside the scan"
    (copy.parent / "saved later.json").unlink()
    assert source_of(open_folder(copy)) is None


def test_the_beginning_of_a_scan_is_known_by_its_project(copy: Path) -> None:
    project = scaled(Project.load(copy.parent / "project" / "steps.json"), SCALE)
    assert not is_unfinished(copy, project), "it is finished"
    (copy / "scan.json").unlink()
    assert is_unfinished(copy, project)
    assert not is_unfinished(copy, replaced(project, ("sensor", "bits"), 8))
    (copy / "scan_project.json").write_text("{")
    assert not is_unfinished(copy, project)
    assert not is_unfinished(copy / "nothing", project)


def test_a_scan_is_meant_by_its_folder_or_its_own_files(scanned: tuple[Path, Path]) -> None:
    file, folder = scanned
    assert holds_scan(folder) == holds_scan(folder / "scan.json") == holds_scan(folder / "scan_project.json") == folder
    assert holds_scan(file) is holds_scan(file.parent) is holds_scan(folder / "frame_0000.json") is None


def test_a_project_that_is_called_as_a_scans_manifest_is_a_project(tmp_path: Path) -> None:
    """One of the template "Scan", saved as scan.json, could not be opened again."""
    file = tmp_path / "p" / "scan.json"
    new_project("plane", file.parent)
    (file.parent / "project.json").rename(file)
    assert holds_scan(file) is holds_scan(file.parent) is None
    assert Project.load(file).name == "Tilted plane"


def test_points_without_their_errors_are_refused_in_words(copy: Path) -> None:
    points = read_ply(copy / "points.ply")
    write_ply(copy / "points.ply", {name: points[name] for name in ("x", "y", "z", "row", "laser", "step")})
    with pytest.raises(InputError, match="error_depth, error_surface"):
        read_results(open_folder(copy))


def test_points_of_no_step_of_the_scan_are_left_out(copy: Path) -> None:
    before = read_results(open_folder(copy)).by_step(0, "depth")
    points = read_ply(copy / "points.ply")
    stray = {name: column[:3].copy() for name, column in points.items()}
    stray["step"][:], stray["laser"][:] = (-1, 3, 0), (0, 0, 7)
    write_ply(copy / "points.ply", merge([points, stray]))
    np.testing.assert_array_equal(read_results(open_folder(copy)).by_step(0, "depth"), before)


def test_a_frame_in_the_place_of_another_is_refused(copy: Path) -> None:
    for suffix in (".json", ".exr"):
        shutil.copy(copy / f"frame_0002{suffix}", copy / f"frame_0001{suffix}")
    with pytest.raises(InputError, match="has changed since the scan ended"):
        read_results(open_folder(copy)).read_step(1, None)


@pytest.mark.parametrize(
    "written",
    [
        None,
        "text",
        [1, None],
        [{"laser": 3}],
        [{"laser": "laser", "method": "gaussian", "points": "many", "depth_m": 1}],
    ],
)
def test_a_manifest_that_says_nothing_of_use_leaves_gaps(copy: Path, written: object) -> None:
    found = open_folder(copy)
    assert isinstance(found, ScanFolder)
    name = found.project.scene.lasers[0].name
    if isinstance(written, list):
        written = [{**row, "laser": name} if isinstance(row, dict) and "method" in row else row for row in written]
    edit_manifest(copy, results=written, notes=[None, "a note"], extraction=5, remarks=None)
    results = read_results(open_folder(copy))
    methods, rows = results.table(0, DEPTH)
    assert len(methods) <= 1
    assert all(math.isnan(value) for _, _, values in rows for value in values)
    assert results.remarks() == ["a note"]


def test_a_scan_without_points_can_be_looked_at(copy: Path) -> None:
    (copy / "points.ply").unlink()
    results = read_results(open_folder(copy))
    assert len(results.points["x"]) == 0
    assert np.isnan(results.by_step(0, "depth")[1]).all()
    assert results.read_step(0, None)[0].step == 0
