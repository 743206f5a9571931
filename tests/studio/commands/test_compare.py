"""Two runs compared: every field that changed in words, and only differences beyond chance are called so."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

import main
from studio.project.project import Project
from studio.study.comparison import compare_runs, read_side
from tests.studio.small_scan import scan, small_project

SCALE = 0.2
"""At less the line is narrower than 0.25 px: rows share its width, so that their errors hang together."""


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main.cli, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Of one project: as it is, with another seed, with much more read noise, and with the laser elsewhere."""
    folder = tmp_path_factory.mktemp("project")
    file = small_project(folder)
    project = Project.load(file)
    others: dict[str, dict[str, Any]] = {
        "same": {},
        "seed": {"seed": 9},
        "noisy": {"seed": 9, "sensor.read_noise": 150.0, "sensor.exposure_time": 0.004},
        "moved": {"scene.rig.lasers[0].T_rig_laser.translation": [0.25, 0.0, 0.0], "scene.objects[0].name": "part"},
    }
    for name, change in others.items():
        scan(file, folder / name, project=project.replaced(change), image_scale=SCALE)
    return {name: folder / name for name in others}


def told(runs: dict[str, Path], a: str, b: str) -> dict[str, Any]:
    done = call("compare", runs[a], runs[b], "--json")
    assert done.exit_code == 0, done.output
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_a_run_does_not_differ_from_itself(runs: dict[str, Path]) -> None:
    found = told(runs, "same", "same")
    assert found["setup"] == [] and all(row["difference"] == 0.0 and not row["differs"] for row in found["results"])
    assert "nothing differs" in call("compare", runs["same"], runs["same"]).stdout


def test_another_seed_is_a_change_of_set_up_and_none_of_results(runs: dict[str, Path]) -> None:
    found = told(runs, "same", "seed")
    assert [(row["field"], row["a"], row["b"]) for row in found["setup"]] == [("seed", "1", "9")]
    assert found["paired"] and not any(row["differs"] for row in found["results"])


def test_noise_is_found_with_its_size_and_cause(runs: dict[str, Path]) -> None:
    found = told(runs, "seed", "noisy")
    changed = {row["label"]: (row["a"], row["b"]) for row in found["setup"]}
    assert changed == {"Sensor: Read noise": ("2.5 e-", "150 e-"), "Sensor: Exposure time": ("0.18 ms", "0.16 ms")}
    sigma = next(row for row in found["results"] if row["figure"] == "depth sigma")
    assert sigma["differs"] and sigma["low"] > 0.0 and sigma["p"] < 0.01 and sigma["unit"] == "m"


def test_rows_of_another_geometry_are_not_paired(runs: dict[str, Path]) -> None:
    found = compare_runs(read_side(runs["same"]), read_side(runs["moved"]))
    assert not found.paired and any("Geometry differs" in note for note in found.notes)
    labels = {one.label: (one.a, one.b) for one in found.setup}
    assert labels["Scene: Rig: Lasers: laser: Pose on the rig: Position"] == ("200, 0, 0 mm", "250, 0, 0 mm")
    assert labels["Scene: Objects: plate"] == ("there", "not there")


def test_what_is_no_run_is_told_in_one_message(runs: dict[str, Path], tmp_path: Path) -> None:
    (tmp_path / "x.txt").write_text("x")
    for wrong, words in ((tmp_path, "no finished scan"), (tmp_path / "x.txt", "no finished run"),
                         (tmp_path / "none.html", "no such report")):  # fmt: skip
        done = call("compare", runs["same"], wrong)
        assert done.exit_code == 2 and words in done.stderr and done.stderr.count("error: ") == 1
    file = runs["same"].parent / "project.json"
    scan(file, tmp_path / "frames", measure=False)
    done = call("compare", runs["same"], tmp_path / "frames")
    assert done.exit_code == 0 and "frames alone" in done.stdout
