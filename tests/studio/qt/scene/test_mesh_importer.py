"""Before files of a person become part of a project: where they are looked for, and what is asked."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtWidgets import QFileDialog, QMessageBox, QWidget
from pytestqt.qtbot import QtBot

from studio.qt.core.session import Session
from studio.qt.scene.mesh_importer import choose_mesh, choose_meshes, may_copy


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What was asked, each question with its explanation; all are agreed to."""
    found: list[str] = []

    def answer(box: QMessageBox) -> int:
        found.append(f"{box.text()} {box.informativeText()}")
        box.defaultButton().click()
        return 0

    monkeypatch.setattr(QMessageBox, "exec", answer)
    return found


@pytest.fixture
def parent(qtbot: QtBot) -> QWidget:
    made = QWidget()
    qtbot.addWidget(made)
    return made


@pytest.mark.parametrize("name", ["housing.step", "housing.stl"])
def test_nothing_is_asked_of_a_file_in_the_projects_own_folder(
    parent: QWidget, asked: list[str], tmp_path: Path, name: str
) -> None:
    assert may_copy(parent, [tmp_path / "parts" / name], tmp_path) and asked == []


def test_the_question_about_a_step_file_tells_what_is_written(
    parent: QWidget, asked: list[str], tmp_path: Path
) -> None:
    """It asked whether to copy the file, which is not what is done."""
    root, step, mesh = tmp_path / "project", tmp_path / "housing.step", tmp_path / "lid.stl"
    (root / "meshes" / "housing").mkdir(parents=True)
    assert may_copy(parent, [step], root) and may_copy(parent, [mesh], root) and may_copy(parent, [step, mesh], root)
    alone, copied, both = asked
    assert "Write the parts of housing.step" in alone and "Copy" not in alone
    assert alone.endswith(f"as PLY files into:\n{root / 'meshes' / 'housing 2'}")
    assert "Copy lid.stl into" in copied and "PLY" not in copied
    assert "Copy 2 files into" in both and "Of a STEP file the parts are written" in both


def test_dialogs_begin_beside_the_project(session: Session, parent: QWidget, monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[str] = []

    def choose(parent: QWidget, title: str, start: str, kinds: str) -> tuple[str, str]:
        begun.append(start)
        return "", ""

    monkeypatch.setattr(QFileDialog, "getOpenFileName", choose)
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", choose)
    choose_meshes(session, parent)
    assert choose_mesh(session, parent) is None
    assert begun == [str(session.document.root)] * 2
