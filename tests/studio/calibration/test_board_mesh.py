"""Boards that are rendered: their texture covers what is dark, and the detector finds it where the camera sees it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import studio as blazer
from analysis.calibration.board import Board
from analysis.calibration.circles import centre_bias
from analysis.calibration.detect import detect
from analysis.calibration.estimate import Estimate
from analysis.calibration.virtual import exact_view
from main import cli
from render.base.pose import Pose
from studio.calibration.board_mesh import coverage, write_board_mesh
from studio.calibration.board_text import board_text, parse_board
from studio.project.project import Project
from tests.analysis.calibration.test_circles import in_order, scene

DISCS = Board("circles", 7, 5, 0.04, 0.02)
SAMPLES, BLUR = 64, 0.8 * 3.45e-6
"""Of a pixel, so that edges of the texture are in their place; and of the lens, m."""
CHECKERS = Board("checkerboard", 7, 5, 0.04)
MARKED = Board("checkerboard", 7, 5, 0.04, dotted=True)


def test_as_much_is_dark_as_the_board_has() -> None:
    fine = coverage(DISCS).shape[0] // 8
    dark = coverage(DISCS).sum() / fine**2
    # 35 discs, of squares; an edge is right to second order in a texel over the radius of 40
    assert dark == pytest.approx(35 * np.pi * 0.25**2, rel=0.5 / 40.0**2)
    assert coverage(CHECKERS).sum() / fine**2 == pytest.approx(24.0)
    # a dot of paper in a dark square, two of ink in light ones
    assert coverage(MARKED).sum() / fine**2 == pytest.approx(24.0 + np.pi * 0.17**2, rel=1e-5)
    marked = parse_board("charuco:7x6:30mm:20mm:DICT_4X4_50")
    share = coverage(marked)
    assert share.min() >= 0.0 and share.max() == 1.0
    rows = (np.arange(share.shape[0]) + 0.5) * 8 / share.shape[0] - 1.0
    assert share[(rows < 0.0) | (rows > 6.0)].max() == 0.0, "about the board is paper"


def rendered(board: Board, there: Estimate, folder: Path) -> np.ndarray:
    """An image of the board in the only pose of an estimate, under an even sky, by the path tracer."""
    write_board_mesh(folder / "board.glb", board)
    data = json.loads(Project.load("plane").to_text())
    fx, fy, cx, cy = there.intrinsics.tolist()
    camera = data["scene"]["rig"]["camera"]
    camera |= {"width": 640, "height": 512, "fx": fx, "fy": fy, "cx": cx, "cy": cy}
    camera["distortion"] = there.distortion.tolist()
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = there.rotation[0], there.translation[0]
    world = Project.load("plane").scene.T_world_camera(0) @ pose
    shown = data["scene"]["objects"][0]
    shown |= {"shape": {"kind": "file", "path": "board.glb"}, "T_world_object": Pose.from_matrix(world).model_dump()}
    shown["material"] = {"kind": "lambertian", "albedo": {"source": "mesh"}}
    data["scene"] |= {"lights": [], "environment": {"radiance": [1.0, 1.0, 1.0]}}
    data["scene"]["rig"]["lasers"][0]["power"] = 0.0
    data["render"] |= {"goal": None, "ambient_samples": SAMPLES, "ambient_error": 1e-3}
    data["sensor"] |= {"blur_sigma": BLUR}
    (folder / "project.json").write_text(json.dumps(data))
    image = blazer.develop(blazer.render(Project.load(folder)))
    return np.asarray(image)


@pytest.mark.parametrize(
    "board", [pytest.param(DISCS, marks=pytest.mark.validation), MARKED], ids=["discs", "squares with a marker"]
)
def test_a_rendered_board_is_found_where_the_camera_sees_it(board: Board, tmp_path: Path) -> None:
    there = scene(30.0)
    view, _ = detect(rendered(board, there, tmp_path), board, "image")
    assert len(view.pixel) == 35
    expected = exact_view("", there, 0, board.target, (640, 512)).pixel
    if board.kind == "circles":
        expected = expected + centre_bias(there, np.zeros(35, dtype=np.intp), board.target, board.circle)
    error = view.pixel - in_order(view.pixel, expected)
    # beside the image's noise, 0.01 px, edges have that of the light's samples, of which the image does not tell
    assert np.sqrt(np.mean(error**2)) < 0.03
    # a texel is a third of a pixel here: neither the picture nor its place on the mesh is off by a tenth of one
    assert np.abs(error.mean(axis=0)).max() < min(0.03, 4.0 * error.std() / np.sqrt(35.0))


def test_the_command_writes_a_mesh_that_a_project_reads(tmp_path: Path) -> None:
    out = tmp_path / "board.glb"
    for _ in range(2):  # its own file may be replaced
        result = CliRunner().invoke(cli, ["board", board_text(DISCS), "--out", str(out), "--json"])
        assert result.exit_code == 0 and json.loads(result.stdout)["file"] == str(out)
    out.write_bytes(b"another file")
    for name, message in (("board.glb", "in the way"), ("board.obj", "PDF or a mesh")):
        result = CliRunner().invoke(cli, ["board", board_text(DISCS), "--out", str(tmp_path / name), "--json"])
        assert result.exit_code == 2 and message in json.loads(result.stdout)["error"]["message"]
    assert out.read_bytes() == b"another file"
