"""A study that is put together is there again when its project is opened again, and no file of another's is trusted."""

from __future__ import annotations

from pathlib import Path

import pytest

from studio.project.project import Project
from studio.study import kept_draft as module
from studio.study.draft import Data, new_draft, new_sweep
from studio.study.kept_draft import keep_draft, kept_draft


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(module, "state_folder", lambda: tmp_path / "state")
    return tmp_path / "state" / "studies"


def draft() -> Data:
    made = new_draft("scanner.json")
    made["sweeps"][0]["vary"] = [{"field": "scene.rig.lasers[0].power", "values": [0.01, 0.02]}]
    made["sweeps"].append(new_sweep("Sweep 2"))
    return made


def test_it_is_there_again_by_the_name_that_the_project_has_now(tmp_path: Path) -> None:
    project = tmp_path / "scanner.json"
    assert kept_draft(project, "scanner.json") is None
    keep_draft(project, draft())
    assert kept_draft(project, "scanner.json") == (draft(), {})
    assert kept_draft(tmp_path / "x" / ".." / "scanner.json", "other.json") == (
        draft() | {"base": "other.json"},
        {},
    )
    assert kept_draft(tmp_path / "other.json", "other.json") is None


def test_one_of_other_projects_keeps_them(tmp_path: Path) -> None:
    """The study of a folder is edited beside a project that is another one."""
    base = Project.load("plane")
    keep_draft(tmp_path / "scanner.json", draft() | {"base": "plane"}, None, {"plane": base})
    found = kept_draft(tmp_path / "scanner.json", "scanner.json")
    assert found == (draft() | {"base": "plane"}, {"plane": base}) and found[1]["plane"].folder == base.folder


def test_an_unfinished_one_is_kept_as_well(tmp_path: Path) -> None:
    """A map of one field is no study yet, and work all the same."""
    unfinished = draft()
    unfinished["sweeps"][0] |= {"chart": "map", "sampling": "boundary"}
    keep_draft(tmp_path / "scanner.json", unfinished)
    assert kept_draft(tmp_path / "scanner.json", "scanner.json") == (unfinished, {})


def test_an_emptied_one_is_gone(tmp_path: Path, folder: Path) -> None:
    keep_draft(tmp_path / "scanner.json", draft())
    keep_draft(tmp_path / "scanner.json", new_draft("scanner.json"))
    assert list(folder.glob("*")) == []


@pytest.mark.parametrize("text", ["", "{", "[]", '{"sweeps": 3}', '{"sweeps": [{"name": "a"}]}', "x" * (1 << 21)])
def test_a_damaged_one_is_none(tmp_path: Path, folder: Path, text: str) -> None:
    keep_draft(tmp_path / "scanner.json", draft())
    (file,) = folder.glob("*.json")
    file.write_text(text)
    assert kept_draft(tmp_path / "scanner.json", "scanner.json") is None


def test_no_more_are_kept_than_of_the_last_projects(
    tmp_path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "KEPT", 3)
    for number in range(5):
        keep_draft(tmp_path / f"{number}.json", draft())
    assert len(list(folder.glob("*.json"))) == 3


def test_a_folder_that_cannot_be_written_is_no_fault(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file where the folder should be")
    keep_draft(tmp_path / "scanner.json", draft())
    assert kept_draft(tmp_path / "scanner.json", "scanner.json") is None
