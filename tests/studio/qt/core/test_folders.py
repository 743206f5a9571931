"""The folder that results go into may be one that is not there yet."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractButton, QDialogButtonBox, QLineEdit, QMessageBox
from pytestqt.qtbot import QtBot

from studio.qt.core.folders import ResultsFolder, may_replace_scan, readable_folder, unused_name
from tests.studio.qt.shell.window_hands import answer


def choice(qtbot: QtBot, suggested: Path) -> ResultsFolder:
    dialog = ResultsFolder(None, "Folder for the results", suggested)
    dialog.setOption(ResultsFolder.Option.DontUseNativeDialog)
    qtbot.addWidget(dialog)
    dialog.show()
    dialog.activateWindow()
    qtbot.waitUntil(dialog.isActiveWindow)
    dialog.findChild(QLineEdit).setFocus()
    return dialog


def accept_button(dialog: ResultsFolder) -> QAbstractButton:
    buttons = dialog.findChild(QDialogButtonBox)
    accept = QDialogButtonBox.ButtonRole.AcceptRole
    return next(button for button in buttons.buttons() if buttons.buttonRole(button) == accept)


def test_a_suggested_folder_is_made_when_it_is_chosen(qtbot: QtBot, tmp_path: Path) -> None:
    dialog = choice(qtbot, tmp_path / "study results")
    assert not (tmp_path / "study results").exists()
    qtbot.mouseClick(accept_button(dialog), Qt.MouseButton.LeftButton)
    assert dialog.selectedFiles() == [str(tmp_path / "study results")]
    assert (tmp_path / "study results").is_dir() and not dialog.isVisible()


def test_a_typed_name_makes_a_folder_and_one_that_is_there_is_taken(qtbot: QtBot, tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    for name in ("new", "there"):
        dialog = choice(qtbot, tmp_path / "study results")
        line = dialog.findChild(QLineEdit)
        line.selectAll()
        qtbot.keyClick(line, Qt.Key.Key_Delete)
        qtbot.keyClicks(line, name)
        assert accept_button(dialog).isEnabled()
        qtbot.keyClick(line, Qt.Key.Key_Return)
        assert dialog.selectedFiles() == [str(tmp_path / name)] and (tmp_path / name).is_dir()
    assert not (tmp_path / "study results").exists()


def test_what_cannot_be_made_is_told_and_leaves_the_question_open(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(folder: Path) -> None:
        raise PermissionError(13, "Permission denied", str(folder))

    monkeypatch.setattr(Path, "mkdir", refuse)
    dialog = choice(qtbot, tmp_path / "results")
    dialog.accept()
    told = dialog.findChild(QMessageBox)
    assert "Permission denied" in told.informativeText() and dialog.isVisible()


@pytest.mark.parametrize(
    ("name", "made"),
    [("Weld seam scan", "Weld seam scan"), ("a/b: c?", "a-b- c-"), ("..", "results"), ("x" * 200, "x" * 80)],
)
def test_a_name_that_no_folder_may_have_is_mended(name: str, made: str) -> None:
    assert readable_folder(name) == made


def test_a_suggested_name_is_of_nothing_that_is_there(tmp_path: Path) -> None:
    assert unused_name(tmp_path, "a/b scan") == "a-b scan"
    (tmp_path / "a-b scan").mkdir()
    (tmp_path / "a-b scan 2").write_text("")
    assert unused_name(tmp_path, "a/b scan") == "a-b scan 3"


@pytest.mark.parametrize(("button", "expected"), [("Replace", True), ("Cancel", False)])
def test_an_earlier_scan_is_replaced_only_if_one_says_so(
    qtbot: QtBot, tmp_path: Path, button: str, expected: bool
) -> None:
    answer(qtbot, "replace", button)
    assert may_replace_scan(None, tmp_path) is expected
