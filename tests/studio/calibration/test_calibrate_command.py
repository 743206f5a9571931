"""`main.py calibrate`: from photographs to a calibration that a project loads, bad files named, and in silico."""

from __future__ import annotations

import itertools
import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

from analysis.calibration.estimate import unit_plane
from analysis.line.result import Line
from main import cli
from render.base.errors import InputError
from studio.calibration.calibration_file import read_calibration
from studio.calibration.exchange import write_camera
from studio.calibration.image_views import shots
from studio.calibration.into_project import into_project
from studio.project.calibration import CalibratedCamera
from studio.project.project import Project
from studio.scan.stages import triangulate_line
from tests.analysis.calibration.test_circles import photograph, scene
from tests.studio.calibration.photographed_boards import BOARD, scanner, write_folder

VIEWS = 8


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("photographs")
    write_folder(made, scanner(VIEWS))
    return made


def run(*words: str) -> tuple[int, dict[str, object]]:
    result = CliRunner().invoke(cli, [*words, "--json"])
    return result.exit_code, json.loads(result.stdout)


@pytest.fixture(scope="module")
def calibrated(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """The scanner's calibration, in a folder of its own, with what was told; and a project of it in `mine` there."""
    made = tmp_path_factory.mktemp("calibrated")
    options = ("--board", BOARD, "--lens", "4", "--out", str(made / "calibration.json"))
    code, told = run("calibrate", "scanner", str(folder), *options, "--project", str(made / "mine"))
    assert code == 0, told
    return made / "calibration.json", told


def test_photographs_of_a_scanner_give_its_camera_and_laser(
    calibrated: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    out, told = calibrated
    there = scanner(VIEWS)
    found = [told["camera"][name] for name in ("fx", "fy", "cx", "cy")]
    sigma = np.sqrt(np.diag(np.array(told["camera_covariance"])))
    assert np.all(np.abs(np.array(found) - there.intrinsics) < 4.0 * sigma[:4])
    assert sigma[0] < 2.0
    plane = np.array(told["planes"][0])
    error = plane - unit_plane(there.planes[0])
    spread = np.sqrt(np.diag(np.array(told["covariances"][0]))[4:8])
    assert np.all(np.abs(error) < 4.0 * spread)
    assert np.abs(error[:3]).max() < 2e-3 and abs(error[3]) < 1e-3
    assert told["next_pose"]["depth_rms_after_m"] < told["next_pose"]["depth_rms_before_m"]
    # one scale of the corners' errors, told by the images themselves
    assert told["checks"]["corner_sigma_factor"] < 1.6

    mine = Project.load(out.parent / "mine" / "project.json")
    assert (mine.scene.camera.width, mine.scene.camera.height) == (640, 512)
    assert np.array_equal(mine.calibration.planes, told["planes"]) and mine.scene.camera.fx == found[0]

    data = json.loads(Project.load("plane").to_text())
    data["scene"]["rig"]["camera"] |= {"width": 640, "height": 512}
    shutil.copy(out, tmp_path / "calibration.json")
    (tmp_path / "project.json").write_text(json.dumps(data | {"calibration": "calibration.json"}))
    project = Project.load(tmp_path)
    assert project.calibration.camera is not None and project.calibration.camera.fx == pytest.approx(found[0])
    assert project.calibration.covariance(0).shape == (12, 12)


@pytest.mark.validation
def test_photographs_of_a_grid_of_discs_give_the_camera(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    for number, (tilt, side, z) in enumerate(itertools.product((15.0, 35.0), (0.3, 2.4, 4.5), (0.55, 0.8))):
        there = scene(tilt, side, z)
        image = photograph(there)
        drawn = np.clip(image + rng.normal(size=image.shape) * np.sqrt(1.0 + 0.02 * image), 0, 255)
        cv2.imwrite(str(tmp_path / f"pose_{number}.png"), np.rint(drawn).astype(np.uint8))
    words = ("calibrate", "camera", str(tmp_path), "--board", "circles:7x5:40mm:20mm", "--lens", "4")
    code, told = run(*words, "--out", str(tmp_path / "out.json"))
    assert code == 0, told
    found = np.array([told["camera"][name] for name in ("fx", "fy", "cx", "cy")])
    sigma = np.sqrt(np.diag(np.array(told["camera_covariance"])))
    assert np.all(np.abs(found - there.intrinsics) < 4.0 * sigma[:4]) and sigma[0] < 2.0
    assert told["checks"]["corner_sigma_factor"] < 1.3


def test_the_laser_alone_is_found_with_a_camera_that_is_known(folder: Path, tmp_path: Path) -> None:
    camera, out = tmp_path / "camera.json", tmp_path / "laser.json"
    code, first = run("calibrate", "camera", str(folder), "--board", BOARD, "--lens", "4", "--out", str(camera))
    assert code == 0 and not first["planes"]
    code, told = run("calibrate", "laser", str(folder), "--board", BOARD, "--camera", str(camera), "--out", str(out))
    assert code == 0, told
    assert np.abs(np.array(told["planes"][0]) - unit_plane(scanner(VIEWS).planes[0])).max() < 2e-3


def test_a_camera_of_another_program_is_held_as_exact_and_said_to_be(folder: Path, tmp_path: Path) -> None:
    there, camera, out = scanner(VIEWS), tmp_path / "camera.yaml", tmp_path / "laser.json"
    fx, fy, cx, cy = there.intrinsics
    k = tuple(there.distortion.tolist())
    write_camera(camera, CalibratedCamera(width=640, height=512, fx=fx, fy=fy, cx=cx, cy=cy, distortion=k), "opencv")
    code, told = run("calibrate", "laser", str(folder), "--board", BOARD, "--camera", str(camera), "--out", str(out))
    assert code == 0, told
    assert told["camera"]["fx"] == fx and not np.any(told["camera_covariance"])
    spread = np.sqrt(np.diag(np.array(told["covariances"][0]))[4:8])
    assert np.all(np.abs(np.array(told["planes"][0]) - unit_plane(there.planes[0])) < 4.0 * spread)
    assert any("came without its errors" in fault for fault in told["checks"]["faults"])
    assert read_calibration(out)[1].covariance is None  # held again where the file is the known camera


def test_new_photographs_tell_whether_the_calibration_holds(
    calibrated: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    out, _ = calibrated
    new = scanner(2, seed=7)
    turned = Rotation.from_rotvec([0.0, 3e-3, 0.0]).as_matrix()
    for name, there in (("again", new), ("moved", replace(new, planes=new.planes @ turned.T))):
        (tmp_path / name).mkdir()
        write_folder(tmp_path / name, there)
        # the board is the one that the calibration was made with
        code, told = run("calibrate", "check", str(tmp_path / name), "--camera", str(out))
        assert code == 0 and [part["part"] for part in told["parts"]] == ["camera", "laser 0"]
        assert told["holds"] == (name == "again")
    assert "laser 0 no longer" in told["verdict"]
    code, told = run("calibrate", "check", str(tmp_path / "again"), "--camera", str(tmp_path / "again" / "none.json"))
    assert code == 2 and "none.json" in told["error"]["message"]


def test_a_bad_photograph_is_named_and_the_rest_goes_on(tmp_path: Path) -> None:
    write_folder(tmp_path, scanner(6), pairs=False)
    (tmp_path / "broken.png").write_bytes(b"no image")
    cv2.imwrite(str(tmp_path / "empty.png"), np.full((512, 640), 90, np.uint8))
    cv2.imwrite(str(tmp_path / "small.png"), cv2.imread(str(tmp_path / "pose_00.png"))[:400])
    (tmp_path / "zz_again.png").write_bytes((tmp_path / "pose_03.png").read_bytes())
    out = tmp_path / "calibration.json"
    code, told = run("calibrate", "scanner", str(tmp_path), "--board", BOARD, "--lens", "4", "--out", str(out))
    assert code == 2
    assert out.exists()
    text = "\n".join(told["errors"])
    assert len(told["errors"]) == 4, text
    for name, words in (
        ("broken", "not an image"),
        ("empty", "no checkerboard"),
        ("small", "another size"),
        ("zz_again", "same photograph as pose_03"),
    ):
        assert any(name in line and words in line for line in told["errors"]), text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["camera", "nowhere", "--board", BOARD], "no such folder"),
        (["camera", ".", "--board", "chess:3"], "not a board"),
        (["laser", ".", "--board", BOARD], "needs a camera"),
        (["camera", ".", "--board", BOARD, "--camera", "camera.json"], "laser alone"),
        (["laser", ".", "--board", BOARD, "--camera", "camera.json", "--lens", "5"], "has its lens"),
        (["camera", ".", "--board", BOARD, "--nearest", "1", "--farthest", "0.5"], "not beyond"),
        (["check", "."], "no calibration to check"),
        (["check", "--camera", "camera.json"], "no folder of new photographs"),
        (["everything", ".", "--board", BOARD], "not known what to calibrate"),
    ],
)
def test_what_cannot_be_done_is_one_message(words: list[str], message: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    code, told = run("calibrate", *words)
    assert code == 2 and message in told["error"]["message"]


def test_a_project_is_calibrated_in_silico_beside_its_truth(tmp_path: Path) -> None:
    Project.load("plane").save(tmp_path / "project.json")
    out = tmp_path / "calibration.json"
    code, told = run("calibrate", str(tmp_path), "--views", "14", "--lens", "0", "--out", str(out), "--seed", "2")
    assert code == 0, told
    # of the few parameters that make the depth error the rms is a chi variable: within 2.5 of what was told
    assert told["true_depth_rms_m"][0] < 2.5 * told["checks"]["depth_rms_m"][0]
    assert told["checks"]["depth_rms_m"][0] < 1e-4


def test_points_of_a_calibrated_project_are_off_by_as_much_as_they_tell(tmp_path: Path) -> None:
    exact = Project.load("plane")
    exact.save(tmp_path / "project.json")
    out = tmp_path / "calibration.json"
    code, _ = run("calibrate", str(tmp_path / "project.json"), "--views", "10", "--lens", "5", "--out", str(out))
    assert code == 0
    data = json.loads((tmp_path / "project.json").read_text()) | {"calibration": "calibration.json"}
    (tmp_path / "project.json").write_text(json.dumps(data))
    project = Project.load(tmp_path / "project.json")
    full = np.full((project.scene.camera.height, 1), 1.0)
    found = []
    for u in (900.0, 1200.0, 1500.0):
        line = Line("rows", "likelihood", u * full, 0.0 * full, full, full, full, full, np.zeros(full.shape, np.uint8))
        told, truth = triangulate_line(project, line, 0, 0), triangulate_line(exact, line, 0, 0)
        found.append((told.depth_z - truth.depth_z) / told.sigma_depth_systematic)
    # all points share a few errors: the mean square is at most as uncertain as one squared normal number
    assert 1e-3 < np.mean(np.square(found)) < 9.0


def test_where_nothing_can_be_found_the_bad_photographs_are_named_too(tmp_path: Path) -> None:
    write_folder(tmp_path, scanner(2), pairs=False)
    (tmp_path / "broken.png").write_bytes(b"no image")
    code, told = run("calibrate", "camera", str(tmp_path), "--board", BOARD, "--lens", "4")
    assert code == 2
    message = told["error"]["message"]
    assert "too few views" in message and "broken.png" in message and "not an image" in message


@pytest.mark.parametrize("second", ["pose_off.tif", "pose.png", "POSE_off.png"])
def test_two_files_that_are_one_photograph_by_name_are_not_taken_for_each_other(second: str, tmp_path: Path) -> None:
    for name in ("pose_off.png", second):
        (tmp_path / name).write_bytes(b"")
    if second.startswith("POSE"):
        assert len(shots(tmp_path)) == 2
        return
    with pytest.raises(InputError, match="one photograph by name"):
        shots(tmp_path)


def file_of(covariance: list[list[float]]) -> dict[str, object]:
    camera = {"width": 640, "height": 512, "fx": 900.0, "fy": 900.0, "cx": 320.0, "cy": 256.0, "distortion": []}
    return {"kind": "blazer-calibration", "version": 1, "camera": camera, "camera_covariance": covariance}


def test_a_known_camera_has_a_whole_covariance(tmp_path: Path) -> None:
    path, good = tmp_path / "camera.json", np.diag([1.0, 1.0, 0.5, 0.5]).tolist()
    path.write_text(json.dumps(file_of(good)))
    assert read_calibration(path)[1].covariance[0, 0] == 1.0
    wrong: list[object] = [np.diag([1.0, 1.0, 0.5, -0.5]).tolist(), np.eye(3).tolist()]
    wrong.append(np.diag([1.0, 1.0, 0.5, 0.0]).tolist())
    wrong += [(np.eye(4) + np.eye(4, k=1)).tolist(), (np.eye(4) + 2.0 * np.eye(4)[::-1]).tolist(), None, "x"]
    for covariance in wrong:
        path.write_text(json.dumps(file_of(good) | {"camera_covariance": covariance}))
        with pytest.raises(InputError, match="not a covariance"):
            read_calibration(path)
    for version in (2, "1", None, True):
        path.write_text(json.dumps(file_of(good) | {"version": version}))
        with pytest.raises(InputError, match="another version"):
            read_calibration(path)


def test_a_project_names_only_calibration_files(tmp_path: Path) -> None:
    data = json.loads(Project.load("plane").to_text())
    (tmp_path / "project.json").write_text(json.dumps(data | {"calibration": "other.json"}))
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(InputError, match="no calibration"):
        Project.load(tmp_path / "project.json")
    (tmp_path / "project.json").write_text(json.dumps(data | {"calibration": "../other.json"}))
    with pytest.raises(InputError, match="leaves the project folder"):
        Project.load(tmp_path / "project.json")


def test_a_project_takes_on_a_calibration_that_goes_with_it(tmp_path: Path) -> None:
    data = {"camera": None, "planes": [[1.0, 0.0, 0.0, -0.2]] * 2, "covariances": []}
    with pytest.raises(InputError, match=r"does not go with the project.*2 planes"):
        into_project(tmp_path, data)
    assert not list(tmp_path.iterdir())
    kept = Project.load("scan")
    kept.save(tmp_path / "project.json")
    into_project(tmp_path, data | {"planes": [[1.0, 0.0, 0.0, -0.2]]})
    found = Project.load(tmp_path)
    assert found.scene == kept.scene and found.calibration.planes == ((1.0, 0.0, 0.0, -0.2),)
