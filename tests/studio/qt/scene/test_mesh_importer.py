"""Before files of a person become part of a project: where they are looked for, and what is asked."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtWidgets import QFileDialog, QMessageBox, QWidget
from pytestqt.qtbot import QtBot

from render.laser.laser import LineLaser
from studio.project.mesh_import import ImportedMesh
from studio.qt.core.session import Session
from studio.qt.scene.mesh_importer import choose_mesh, choose_meshes, colour_told, may_copy


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


def test_the_colour_of_a_step_file_says_what_it_is_to_the_laser(session: Session) -> None:
    """A red plate was nearly black to a blue laser, and nothing said why."""
    lasers = session.project.scene.lasers
    assert lasers[0].wavelength_nm == 450.0

    def told(
        *parts: tuple[str, tuple[float, float, float] | None], by: tuple[LineLaser, ...] = lasers
    ) -> tuple[str, str]:
        bounds = (0.0, 0.0, 0.0), (0.1, 0.1, 0.1)
        return colour_told([ImportedMesh("a.ply", "mm", bounds, 12, name, colour, True) for name, colour in parts], by)

    red, grey = ("plate", (0.6, 0.02, 0.03)), ("lid", (0.4, 0.4, 0.4))
    level, text = told(red)
    assert level == "warning" and "plate reflects 3% of the laser's light of 450 nm and is nearly black" in text
    assert "the file has for the screen" in text and "Albedo changes it" in text
    of_red = tuple(laser.model_copy(update={"wavelength_nm": 650.0}) for laser in lasers)
    assert told(red, by=of_red) == ("info", told(red, by=of_red)[1]) and "60%" in told(red, by=of_red)[1]
    assert told(grey)[0] == "info" and "lid reflects 40%" in told(grey)[1]
    assert told(grey, red)[0] == "warning" and "plate" in told(grey, red)[1]
    assert told(("bare", None)) == ("info", "")
