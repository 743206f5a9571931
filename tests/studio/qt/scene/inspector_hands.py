"""The inspector in a window of its own, as a dock would hold it, and hands that type and drag in it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMainWindow
from pytestqt.qtbot import QtBot

from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.core.session import Session
from studio.qt.forms.form import Section
from studio.qt.forms.form_rows import Row
from studio.qt.forms.number_field import NumberField
from studio.qt.scene.inspector import Inspector

LASER = ("scene", "rig", "lasers", 0)
CAMERA = ("scene", "rig", "camera")


def sample_session(folder: Path) -> Session:
    project = Project.load(template_folder("scan") / "project.json").save(folder / "project.json")
    return Session(Document(project, folder / "project.json"))


@contextmanager
def inspector_window(session: Session, qtbot: QtBot) -> Iterator[Inspector]:
    window = QMainWindow()
    qtbot.addWidget(window)
    panel = Inspector(session)
    window.setCentralWidget(panel)
    undo = QAction("Undo", window)
    undo.setShortcut(QKeySequence.StandardKey.Undo)
    undo.triggered.connect(lambda: session.document.undo())
    window.addAction(undo)
    window.resize(340, 800)
    window.show()
    qtbot.waitExposed(window)
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    session.select(LASER)
    yield panel
    Section.folded.clear()


def row(inspector: Inspector, *path: str | int, part: int = 0) -> Row:
    return inspector.form.rows[path][part]


def field(inspector: Inspector, *path: str | int, part: int = 0, axis: int | None = None) -> Any:
    editor = row(inspector, *path, part=part).editor
    return editor if axis is None else editor.fields[axis]


def type_into(qtbot: QtBot, editor: Any, text: str, key: Qt.Key | None = Qt.Key.Key_Return) -> None:
    qtbot.mouseClick(editor, Qt.MouseButton.LeftButton)
    assert editor.hasFocus()
    editor.selectAll()
    qtbot.keyClicks(editor, text)
    if key is not None:
        qtbot.keyClick(editor, key)


def drag(qtbot: QtBot, editor: NumberField, dx: int, release: bool = True) -> None:
    start = editor.rect().center()
    qtbot.mousePress(editor, Qt.MouseButton.LeftButton, pos=start)
    for i in range(1, 11):
        qtbot.mouseMove(editor, start + QPoint(dx * i // 10, 0))
    if release:
        qtbot.mouseRelease(editor, Qt.MouseButton.LeftButton, pos=start + QPoint(dx, 0))
