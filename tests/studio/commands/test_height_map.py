"""`main.py heightmap`: what is read back from the files is what was written, and bad input is told."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result

import main
from analysis.cloud import Cloud, read_ply, write_ply
from analysis.height_map import height_map

SIDE = 12


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main.cli, ["heightmap", *(str(argument) for argument in arguments)])


@pytest.fixture
def points(tmp_path: Path) -> Path:
    """A dome of 12 x 12 points, 1 mm apart."""
    row, step = (one.ravel() for one in np.meshgrid(np.arange(SIDE), np.arange(SIDE)))
    cloud: Cloud = {"x": 1e-3 * row, "y": 1e-3 * step, "z": 0.5 - 10.0 * (1e-3 * (row - 5)) ** 2}
    cloud |= {"sigma_random": np.full(len(row), 1e-5), "row": row.astype(np.int32), "step": step.astype(np.int32)}
    write_ply(tmp_path / "points.ply", cloud)
    return tmp_path / "points.ply"


@pytest.mark.parametrize("name", ["map.png", "map.tif"])
def test_the_picture_and_the_file_beside_it_give_the_heights_exactly(points: Path, name: str) -> None:
    out = points.with_name(name)
    done = call(points, "--pitch", "0.5", "--out", out, "--json")
    assert done.exit_code == 0, done.output
    told: dict[str, Any] = json.loads(done.stdout)
    beside = json.loads(out.with_suffix(".json").read_text())
    assert all(told[key] == value for key, value in beside.items())
    numbers = cv2.imread(str(out), cv2.IMREAD_UNCHANGED)
    assert numbers.dtype == np.uint16 and numbers.shape == (beside["height"], beside["width"])
    expected = height_map(read_ply(points), 5e-4)
    heights = np.where(numbers > 0, beside["offset"] + beside["scale"] * numbers.astype(float), np.nan)
    assert np.array_equal(np.isnan(heights), np.isnan(expected.heights))
    assert np.nanmax(np.abs(heights - expected.heights)) <= 0.5001 * beside["scale"]
    assert (beside["x_first"], beside["y_first"]) == (0.0, pytest.approx(11e-3))
    # the same numbers again, from what was read
    known = numbers > 0
    assert np.array_equal(np.round((heights[known] - beside["offset"]) / beside["scale"]), numbers[known])
    assert 0.3 < beside["sigma"]["cells_over_points"] <= 1.0 and "random sigma" in call(points).stdout


@pytest.mark.parametrize("errors", [True, False])
def test_cells_of_a_stray_point_are_left_out_and_counted_or_kept_where_asked(points: Path, errors: bool) -> None:
    """With and without known errors; a pin that is no stray point stays, however few points it has."""
    cloud, stray, pin = read_ply(points), 5 * SIDE + 6, 8 * SIDE + 3
    cloud["z"][[stray, pin]] += (-0.6, 5e-3 if errors else 0.0)
    if errors:
        cloud["error_depth"] = np.random.default_rng(1).normal(0.0, 1e-5, len(cloud["z"]))
        cloud["error_depth"][stray] = 0.6
    write_ply(points, cloud)
    out = points.with_name("map.png")
    done = call(points, "--pitch", "0.5", "--out", out)
    assert done.exit_code == 0 and "left out, beyond" in done.stdout and "--all-heights" in done.stdout
    beside = json.loads(out.with_suffix(".json").read_text())
    left_out, heights = beside["left_out"], height_map(read_ply(points), 5e-4).heights
    assert left_out["all_from"] == np.nanmin(heights) and left_out["kept_to"] == np.nanmax(heights)
    assert 0 < left_out["cells"] < 16 and beside["valid"] + left_out["cells"] == np.count_nonzero(np.isfinite(heights))
    assert beside["scale"] < 1e-7
    assert beside["steep"]["cells"] > 10 and "no height, at walls and jumps" in done.stdout
    done = call(points, "--pitch", "0.5", "--out", out, "--all-heights")
    whole = json.loads(out.with_suffix(".json").read_text())
    assert "left out" not in done.stdout and whole["left_out"]["cells"] == 0 and whole["scale"] > 50 * beside["scale"]


def test_it_replaces_its_own_files_and_no_others(points: Path) -> None:
    out = points.with_name("map.tiff")
    assert [call(points, "--out", out).exit_code for _ in range(2)] == [0, 0]
    out.with_suffix(".json").write_text("{}")
    done = call(points, "--out", out, "--json")
    assert done.exit_code == 2 and "did not write" in json.loads(done.stdout)["error"]["message"]


@pytest.mark.parametrize("case", ["empty folder", "no PLY", "cut short", "suffix", "pitch"])
def test_bad_input_is_one_message(points: Path, tmp_path: Path, case: str) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.ply").write_text("solid")
    shutil.copy(points, tmp_path / "cut.ply")
    (tmp_path / "cut.ply").write_bytes(points.read_bytes()[:-9])
    arguments: dict[str, tuple[object, ...]] = {
        "empty folder": (tmp_path / "empty",),
        "no PLY": (tmp_path / "text.ply",),
        "cut short": (tmp_path / "cut.ply",),
        "suffix": (points, "--out", tmp_path / "map.jpg"),
        "pitch": (points, "--pitch", "nan"),
    }
    done = call(*arguments[case], "--json")
    assert done.exit_code == 2 and json.loads(done.stdout)["ok"] is False
