"""Only what this program wrote is replaced unasked, told by what is in the file."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import pytest

from analysis.cloud import merge, write_csv, write_ply
from render.base.errors import InputError
from studio.scan.own_files import check_replaceable, is_own
from tests.analysis.line.line_images import expected, exposed
from tests.studio.commands.test_extract import CENTRE, WIDTH, call
from tests.studio.small_scan import scan, small_project


@pytest.fixture
def shot(tmp_path: Path) -> Path:
    image = exposed(expected(WIDTH, CENTRE, 2000, 1.5, 10.0), 3, np.random.default_rng(3))
    assert cv2.imwrite(str(tmp_path / "shot.png"), np.round(image * 0.07).clip(0, 255).astype(np.uint8))
    return tmp_path / "shot.png"


@pytest.mark.parametrize(("options", "name"), [((), "shot_line.csv"), (("--ridges",), "shot_ridges.csv")])
def test_a_table_is_replaced_by_the_same_command_and_a_person_s_never(
    options: tuple[str, ...], name: str, shot: Path
) -> None:
    for _ in range(2):
        assert call("extract", shot, *options).exit_code == 0
    (shot.parent / name).write_text("date,who,what\ntoday,me,measured\n")
    refused = call("extract", shot, *options)
    assert refused.exit_code == 2 and f"{name}: a result would replace a file" in refused.stderr
    assert (shot.parent / name).read_text().startswith("date,who")


@pytest.mark.parametrize("suffix", [".csv", ".ply"])
def test_points_of_a_photograph_take_no_other_file_s_place(suffix: str, tmp_path: Path) -> None:
    file = small_project(tmp_path / "project")
    scan(file, tmp_path / "out")
    photograph, project = tmp_path / "out" / "frame_0000.png", tmp_path / "out" / "scan_project.json"
    command = ("reconstruct", photograph, "--project", project, "--out", tmp_path / "points")
    for _ in range(2):
        assert call(*command).exit_code == 0
    mine = (tmp_path / "points" / "frame_0000").with_suffix(suffix)
    mine.write_text("mine")
    assert call(*command).exit_code == 2
    assert mine.read_text() == "mine"


def test_all_that_a_scan_writes_is_known_as_its_own(tmp_path: Path, quick_reports: None) -> None:
    scan(small_project(tmp_path / "project"), tmp_path / "out", report=True)
    unknown = [path.name for path in (tmp_path / "out").iterdir() if not is_own(path)]
    assert unknown == ["scan_project.json"]  # a project like any other: the manifest tells it
    assert not any(is_own(path) for path in (tmp_path / "project").iterdir())


def test_files_of_the_same_kind_from_elsewhere_are_not(tmp_path: Path) -> None:
    import trimesh

    trimesh.creation.box().export(tmp_path / "mesh.ply")
    (tmp_path / "table.csv").write_text("scan_line,rank,u,v\n")
    (tmp_path / "page.html").write_text('<meta name="generator" content="Someone else">')
    (tmp_path / "page.pdf").write_bytes(b"%PDF-1.7")
    (tmp_path / "data.json").write_text('{"format": "other"}')
    (tmp_path / "empty.csv").touch()
    (tmp_path / "folder.ply").mkdir()
    picture = {"R": np.zeros((4, 4), np.float32), "G": np.zeros((4, 4), np.float32), "B": np.zeros((4, 4), np.float32)}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, picture).write(str(tmp_path / "picture.exr"))
    cv2.imwrite(str(tmp_path / "picture.png"), np.zeros((4, 4), np.uint8))
    for path in tmp_path.iterdir():
        assert not is_own(path)
        with pytest.raises(InputError, match="did not write"):
            check_replaceable([path])


def test_points_are_known_by_their_header(tmp_path: Path) -> None:
    write_ply(tmp_path / "points.ply", merge([]))
    write_csv(tmp_path / "points.csv", merge([]))
    check_replaceable([tmp_path / "points.ply", tmp_path / "points.csv", tmp_path / "not there.csv"])


def test_points_of_the_version_without_sigmas_along_the_normal_may_be_replaced(tmp_path: Path) -> None:
    former = {name: column for name, column in merge([]).items() if not name.startswith("sigma_surface")}
    write_csv(tmp_path / "points.csv", former)
    check_replaceable([tmp_path / "points.csv"])
    del former["sheet_bias"]
    write_csv(tmp_path / "points.csv", former)
    with pytest.raises(InputError, match="did not write"):
        check_replaceable([tmp_path / "points.csv"])
