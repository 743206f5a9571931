"""What tests of the window do with their hands: answer dialogs, choose files, drop them."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from PySide6.QtCore import QMimeData, QPointF, Qt, QTimer, QUrl
from PySide6.QtGui import QDropEvent
from PySide6.QtWidgets import QApplication, QFileDialog, QMessageBox, QPushButton, QWidget
from pytestqt.qtbot import QtBot

from render.base.errors import Cancelled
from render.base.threads import Cancel
from studio.project.project import Project
from studio.runtime.jobs import Progress

POWER = ("scene", "rig", "lasers", 0, "power")


def dialog(name: str) -> QMessageBox:
    """The open message box of that name."""
    found = [each for each in QApplication.topLevelWidgets() if each.objectName() == name and each.isVisible()]
    assert len(found) == 1, f"{len(found)} dialogs {name!r}"
    assert isinstance(found[0], QMessageBox)
    return found[0]


def answer(qtbot: QtBot, name: str, button: str) -> None:
    """Press a button of a modal dialog as soon as it is there."""

    def press() -> None:
        for each in QApplication.topLevelWidgets():
            if each.objectName() == name and each.isVisible():
                for one in each.findChildren(QPushButton):
                    if one.text().replace("&", "") == button:
                        qtbot.mouseClick(one, Qt.MouseButton.LeftButton)
                        return
        QTimer.singleShot(10, press)

    QTimer.singleShot(0, press)


def choose_file(monkeypatch: pytest.MonkeyPatch, path: Path | str) -> None:
    """What a person picks in the next file dialogs; "" is Cancel."""
    for name in ("getOpenFileName", "getSaveFileName"):
        monkeypatch.setattr(QFileDialog, name, lambda *_, **__: (str(path), ""))


def files(*paths: Path) -> QMimeData:
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path)) for path in paths])
    return data


def until_cancelled(progress: Progress, cancelled: Cancel) -> None:
    while not cancelled():
        time.sleep(0.005)
    raise Cancelled


def drop(window: QWidget, path: Path) -> None:
    data = files(path)
    buttons, keys = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    window.dropEvent(QDropEvent(QPointF(9, 9), Qt.DropAction.CopyAction, data, buttons, keys))


def project_with_missing_mesh(project: Project, folder: Path) -> Path:
    from render.scene.scene import SceneObject
    from render.scene.shape import MeshFile

    gone = SceneObject(name="gone", shape=MeshFile(path="meshes/gone.ply"))
    scene = project.scene.model_copy(update={"objects": (*project.scene.objects, gone)})
    path = folder / "broken" / "broken.json"
    project.model_copy(update={"scene": scene}).save(path)
    return path


def contrast(a: str, b: str) -> float:
    """Ratio of relative luminances, WCAG 2.1."""
    from PySide6.QtGui import QColor

    def luminance(text: str) -> float:
        parts = [
            value / 12.92 if value <= 0.03928 else ((value + 0.055) / 1.055) ** 2.4
            for value in QColor(text).getRgbF()[:3]
        ]
        return 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2]

    bright, dark = sorted((luminance(a), luminance(b)), reverse=True)
    return (bright + 0.05) / (dark + 0.05)
