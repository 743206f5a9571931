"""Axes of stages and turntables, and cameras in robots' hands, from photographs and in silico beside their truth."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

from analysis.calibration.motion import Motion
from main import cli
from render.base.errors import InputError
from studio.calibration.motion_file import check_names, read_motion
from studio.project.project import Project
from tests.studio.calibration.photographed_boards import BOARD, COLUMNS, ROWS, SQUARE, scanner, write_folder

STEP = np.array([0.02, 0.98, 0.199])


def run(*words: str) -> tuple[int, dict]:
    result = CliRunner().invoke(cli, [*words, "--json"])
    return result.exit_code, json.loads(result.stdout)


def away(found: dict, truth: dict) -> float:
    """Squared error in sigmas; the covariance of an axis has two directions less than its six numbers."""
    names = {"stage": ("step",), "turntable": ("axis", "point"), "hand_eye": ("rotation", "translation")}[found["kind"]]
    exact = {name: np.array(truth[name]) for name in names}
    if "rotation" in exact:  # half a turn about an axis is half a turn about its opposite
        turn = exact["rotation"]
        other = turn * (1.0 - 2.0 * np.pi / np.linalg.norm(turn))
        exact["rotation"] = min(turn, other, key=lambda one: float(np.linalg.norm(found["rotation"] - one)))
    error = np.concatenate([found[name] - exact[name] for name in names])
    return float(error @ np.linalg.pinv(np.array(found["covariance"]), rcond=1e-9, hermitian=True) @ error)


def test_photographs_of_a_board_on_a_stage_give_its_direction(tmp_path: Path) -> None:
    positions = np.array([-0.04, -0.02, 0.0, 0.03, 0.05])
    there = scanner(10)
    middle = np.array([0.5 * (COLUMNS - 1), 0.5 * (ROWS - 1), 0.0]) * SQUARE
    there.translation[0] = [0.0, 0.0, 0.74] - there.rotation[0] @ middle
    group = np.concatenate([np.zeros(5), 1 + np.arange(5)]).astype(np.intp)
    there = replace(there, motion=Motion("stage", group, np.append(positions, np.zeros(5)), STEP, np.eye(3)[1]))
    there = there.moved(np.zeros(len(there.shared)), np.zeros((6, 6)))
    write_folder(tmp_path, there)
    table = tmp_path / "stage.csv"
    table.write_text("view,position_mm\n" + "".join(f"pose_{i:02},{1e3 * p:.4f}\n" for i, p in enumerate(positions)))
    out = tmp_path / "calibration.json"
    options = ("--board", BOARD, "--lens", "4", "--out", str(out), "--motion", str(table))
    code, told = run("calibrate", "scanner", str(tmp_path), *options)
    assert code == 0, told
    found = told["motion"]
    # 99.99 % of a chi-square with three degrees; by 1 mrad at most, as 5 views over 90 mm can tell
    assert away(found, {"step": STEP.tolist()}) < 21.1
    assert np.sqrt(np.diag(np.array(found["covariance"]))).max() < 1e-3
    assert json.loads(out.read_text())["motion"] == found
    data = json.loads(Project.load("plane").to_text())
    data["scene"]["rig"]["camera"] |= {"width": 640, "height": 512}
    (tmp_path / "project.json").write_text(json.dumps(data | {"calibration": "calibration.json"}))
    assert Project.load(tmp_path / "project.json").calibration.laser_count == 1


MOTIONS = (
    {"kind": "linear", "moves": "objects", "step": [0.002, 0.001, 0.0], "steps": 60},
    {"kind": "linear", "moves": "rig", "step": [0.0, 0.002, 0.0], "steps": 60},
    {"kind": "turntable", "centre": [0.02, 0.01, 0.0], "axis": [0.0, 0.1, 1.0], "angle_step": 0.02, "steps": 60},
    {"kind": "turntable", "moves": "rig", "axis": [0.0, 1.0, 0.0], "angle_step": 0.002, "steps": 60},
    {
        "kind": "poses",
        "moves": "objects",
        "poses": [
            {"translation": [0.0, 0.005 * i, 0.0], "rotation": [0.1 * (i % 3), 0.12 * (i % 2), 0.05 * i]}
            for i in range(8)
        ],
    },
)


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_project_s_own_motion_is_found_beside_its_truth(motion: dict, tmp_path: Path) -> None:
    data = json.loads(Project.load("plane").to_text())
    data["scene"]["motion"] = motion
    (tmp_path / "project.json").write_text(json.dumps(data))
    code, told = run("calibrate", str(tmp_path), "--lens", "0", "--out", str(tmp_path / "out.json"), "--views", "12")
    assert code == 0, told
    degrees = {"linear": 3, "turntable": 4, "poses": 6}[motion["kind"]]
    # beyond it one trial in 30,000 by chance
    assert away(told["motion"], told["true_motion"]) < degrees + 4.0 * np.sqrt(2.0 * degrees) + 8.0


def test_a_project_that_stands_still_has_no_axis(tmp_path: Path) -> None:
    Project.load("plane").save(tmp_path / "project.json")
    code, told = run("calibrate", str(tmp_path), "--lens", "0", "--out", str(tmp_path / "out.json"), "--views", "8")
    assert code == 0 and "motion" not in told and told["true_motion"] is None


def test_a_robot_s_poses_are_read_either_way_round(tmp_path: Path) -> None:
    table = tmp_path / "robot.csv"
    quat = Rotation.from_rotvec([0.1, -0.3, 0.5]).as_quat()
    row = ",".join(f"{value!r}" for value in [100.0, -20.0, 300.0, *(2.0 * quat).tolist()])
    table.write_text(f"view,x_mm,y_mm,z_mm,qx,qy,qz,qw,placement\na,{row},left\nb,{row},left\n")
    told = read_motion(table, "camera")
    label, pose = told.by_name["a"]
    assert told.kind == "hand_eye" and label == "left"
    np.testing.assert_allclose(pose[:3, 3], [0.1, -0.02, 0.3])
    np.testing.assert_allclose(Rotation.from_matrix(pose[:3, :3]).as_rotvec(), [0.1, -0.3, 0.5], atol=1e-12)
    np.testing.assert_allclose(read_motion(table, "board").by_name["a"][1] @ pose, np.eye(4), atol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not the columns"),
        ("view,position\na,1\n", "not the columns"),
        ("view,position_mm,angle_deg\na,1,1\n", "not the columns"),
        ("view,position_mm\na,nan\n", "not a number"),
        ("view,position_mm\na,1e9\n", "not a number"),
        ("view,position_mm\na,1,2\n", "another length"),
        ("view,position_mm\na,1\na,2\n", "told of already"),
        ("view,x_mm,y_mm,z_mm,qx,qy,qz,qw\na,1,2,3,0,0,0,0\n", "no length"),
    ],
)
def test_a_table_that_is_none_is_told_by_its_line(text: str, message: str, tmp_path: Path) -> None:
    table = tmp_path / "motion.csv"
    table.write_text(text)
    with pytest.raises(InputError, match=message):
        read_motion(table, "camera")
    table.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not text"):
        read_motion(table, "camera")


def test_a_name_without_a_photograph_is_told(tmp_path: Path) -> None:
    table = tmp_path / "motion.csv"
    table.write_text("view,angle_deg\na,1\nc,2\n")
    with pytest.raises(InputError, match="no photograph of that name; found c"):
        check_names(read_motion(table, "camera"), ["a", "b"], "motion.csv")
