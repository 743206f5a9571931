"""Photographs that are no good, as a stranger takes them: each is named with its reason, and the rest goes on."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from analysis.calibration.board import Board
from analysis.calibration.calibrate import Request, calibrate
from analysis.calibration.detect import detect
from analysis.calibration.motion import Motion, Told
from analysis.calibration.virtual import noisy
from main import cli
from render.base.errors import InputError
from tests.analysis.calibration import boards
from tests.studio.calibration.photographed_boards import BOARD, scanner, write_folder

VIEWS = 12
PLAIN = Board("checkerboard", 8, 6, 0.04)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("photographs")
    write_folder(made, scanner(VIEWS))
    return made


def grey(file: Path) -> np.ndarray:
    return np.asarray(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE))


def change(folder: Path, number: int, how: Callable[[np.ndarray], np.ndarray], *roles: str) -> None:
    for role in roles or ("off", "on"):
        file = folder / f"pose_{number:02}_{role}.png"
        cv2.imwrite(str(file), how(grey(file)))


def compressed(image: np.ndarray, quality: int) -> np.ndarray:
    return np.asarray(cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], 0))


def cut_off(image: np.ndarray) -> np.ndarray:
    out = np.full_like(image, 130)
    out[:, :-260] = image[:, 260:]
    return out


def test_each_is_named_in_a_folder_of_all_of_them(good: Path, tmp_path: Path) -> None:
    folder = tmp_path / "all"
    shutil.copytree(good, folder)
    change(folder, 1, lambda image: image[:400])
    change(folder, 2, lambda image: np.full_like(image, 90))
    change(folder, 3, cut_off)
    change(folder, 4, lambda image: np.ascontiguousarray(image[:, ::-1]))
    change(folder, 6, lambda image: (0.6 * image).astype(np.uint8), "on")
    change(folder, 7, lambda image: grey(folder / "pose_07_off.png"), "on")
    (folder / "pose_08_on.png").unlink()
    change(folder, 9, lambda image: compressed(image, 10))
    (folder / "note.png").write_bytes(b"x")
    for role in ("off", "on"):
        shutil.copy(folder / f"pose_10_{role}.png", folder / f"twice_{role}.png")
    words = ("calibrate", "scanner", str(folder), "--board", BOARD, "--lens", "4", "--out", str(tmp_path / "out.json"))
    result = CliRunner().invoke(cli, [*words, "--json"])
    told = json.loads(result.stdout)
    assert result.exit_code == 2 and "Traceback" not in result.output
    named = {
        "pose_01": "another size",
        "pose_02": "no checkerboard",
        "pose_03": "all of them seen",
        "note": "not an image",
        "twice": "same photograph as pose_10",
    }
    for name, why in named.items():
        assert sum(name in line and why in line for line in told["errors"]) == 1, (name, told["errors"])
    assert len(told["errors"]) == len(named)
    sentences = [*told["notes"], *told["checks"]["left_out"]]
    for name, why in (
        ("pose_04", "mirrored photograph"),
        ("pose_06", "switch off automatic exposure"),
        ("pose_07", "is it on?"),
        ("pose_08", "no photograph with the laser on"),
        ("pose_09", "as far off as is typical"),
    ):
        assert sum(line.startswith(name) and why in line for line in sentences) == 1, (name, sentences)
    assert not any(line.startswith(("pose_00", "pose_08: 2")) and "dropped" in line for line in sentences)
    # what is left is a calibration: within what it tells
    found = np.array([told["camera"][name] for name in ("fx", "fy")])
    sigma = np.sqrt(np.diag(np.array(told["camera_covariance"])))[:2]
    assert np.all(np.abs(found - 900.0) < 4.0 * sigma) and sigma.max() < 3.0


@pytest.mark.parametrize("quality", [30, 50, 90])
def test_a_board_is_found_in_a_compressed_photograph(quality: int, good: Path) -> None:
    for number in (0, 5):
        view, _ = detect(compressed(grey(good / f"pose_{number:02}_off.png"), quality), PLAIN, "image")
        there = detect(grey(good / f"pose_{number:02}_off.png"), PLAIN, "image")[0]
        away = np.linalg.norm(view.pixel[:, None] - there.pixel, axis=2).min(axis=1)
        assert len(view.pixel) > 40 and np.median(away) < 0.3


@pytest.mark.parametrize("said", [(9, 6), (7, 5)])
def test_a_board_that_was_counted_wrongly_is_told_as_it_is(said: tuple[int, int], good: Path) -> None:
    with pytest.raises(InputError, match="found one of 8 x 6"):
        detect(grey(good / "pose_00_off.png"), Board("checkerboard", *said, 0.04), "image")


@pytest.mark.validation
def test_where_no_line_is_left_the_reason_is_told(good: Path, tmp_path: Path) -> None:
    for file in good.glob("pose_0[0-4]_*.png"):
        (tmp_path / file.name.replace("png", "jpg")).write_bytes(cv2.imencode(".jpg", grey(file), [1, 40])[1].tobytes())
    result = CliRunner().invoke(cli, ["calibrate", "scanner", str(tmp_path), "--board", BOARD, "--lens", "4", "--json"])
    message = json.loads(result.stdout)["error"]["message"]
    assert result.exit_code == 2 and message.count("compressed") >= 4, message


@pytest.mark.parametrize("factor", [1.0, 1.02])
def test_squares_of_another_size_are_seen_by_a_stage_s_way(factor: float) -> None:
    """Boards 2 % smaller than was said go 2 % too far."""
    there = boards.truth(3, 10, tilt=(10.0, 35.0))
    group = np.concatenate([np.zeros(5), 1 + np.arange(5)]).astype(np.intp)
    given = np.append([0.0, 0.03, -0.03, 0.05, -0.05], np.zeros(5))
    there = replace(there, motion=Motion("stage", group, given, np.array([0.0, 0.6, 0.8]), np.eye(3)[1]))
    there = there.moved(np.zeros(len(there.shared)), np.zeros((6, 6)))
    views = noisy(boards.views_of(there, laser_step=64), np.random.default_rng(0))
    views = [replace(view, target=factor * view.target) for view in views]
    told = Told("stage", {f"view {i}": ("", given[i]) for i in range(5)})
    faults = calibrate(views, factor * boards.target(), Request(boards.SIZE, 1, 0, told=told)).faults
    named = [one for one in faults if "squares are 0.98" in one and "1.02 times as far" in one]
    assert len(named) == (factor > 1.0), faults
