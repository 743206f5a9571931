"""The wheel scrolls panels; no setting changes because the mouse came over it on the way."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import (
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QScrollBar,
    QWidget,
)
from pytestqt.qtbot import QtBot
from superqt import QRangeSlider

import studio.qt
from studio.qt.shell.panels import PANELS
from studio.qt.shell.window import MainWindow

QT_BOXES = "QComboBox|QSpinBox|QDoubleSpinBox|QSlider|QRangeSlider"


def turn_wheel(widget: QWidget, by: int) -> None:
    place = QPointF(widget.rect().center())
    wheel = QWheelEvent(place, widget.mapToGlobal(place), QPoint(0, 0), QPoint(0, by), Qt.MouseButton.NoButton,
                        Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False)  # fmt: skip
    QApplication.sendEvent(widget, wheel)


def settings_of(window: MainWindow) -> list[QWidget]:
    """What a person sets, in every panel and in the preferences."""
    places = [window.panels[panel.key] for panel in PANELS] + [window.preferring.ask()]
    kinds = QComboBox | QAbstractSpinBox | QAbstractSlider | QLineEdit
    found = [widget for place in places for widget in place.findChildren(QWidget) if isinstance(widget, kinds)]
    return [widget for widget in found if not isinstance(widget, QScrollBar)]


def value_of(widget: Any) -> object:
    if isinstance(widget, QComboBox):
        return widget.currentIndex()
    return widget.text() if isinstance(widget, QLineEdit | QAbstractSpinBox) else widget.value()


def test_the_wheel_over_a_box_that_was_never_clicked_changes_nothing(window: MainWindow) -> None:
    window.session.select(("scene", "rig", "lasers", 0))
    window.switch_to("dataset")
    boxes = settings_of(window)
    window.setFocus()
    kinds = {kind for kind in (QComboBox, QAbstractSpinBox, QAbstractSlider, QRangeSlider) for box in boxes
             if isinstance(box, kind)}  # fmt: skip
    assert len(kinds) == 4 and len(boxes) > 50
    changed = []
    for box in boxes:
        before = value_of(box)
        for by in (120, -240):
            turn_wheel(box, by)
        if value_of(box) != before or box.focusPolicy() == Qt.FocusPolicy.WheelFocus:
            changed.append(f"{type(box).__name__} {box.accessibleName()}: {before} became {value_of(box)}")
    assert not changed


def test_the_wheel_steps_the_box_that_has_the_focus(window: MainWindow, qtbot: QtBot) -> None:
    window.switch_to("dataset")
    scenes = window.panels["recipe"].scenes  # type: ignore[attr-defined]
    before = scenes.value()
    qtbot.mouseClick(scenes.lineEdit(), Qt.MouseButton.LeftButton)
    assert scenes.hasFocus()
    turn_wheel(scenes, -120)
    assert scenes.value() == before - 1
    window.setFocus()
    scenes.setFocus(Qt.FocusReason.TabFocusReason)
    qtbot.keyRelease(scenes, Qt.Key.Key_Tab)
    turn_wheel(scenes, 120)
    assert scenes.value() == before


def test_a_box_that_qt_gave_the_focus_leaves_the_wheel_to_the_panel(window: MainWindow) -> None:
    """Of what is hidden with a workspace it hands the focus to the next box that is shown, and calls that Tab."""
    window.switch_to("dataset")
    scenes = window.panels["recipe"].scenes  # type: ignore[attr-defined]
    before = scenes.value()
    window.setFocus()
    scenes.setFocus(Qt.FocusReason.TabFocusReason)
    assert scenes.hasFocus()
    turn_wheel(scenes, -240)
    assert scenes.value() == before


def test_no_panel_has_a_box_of_qts_own() -> None:
    made = re.compile(rf"\b({QT_BOXES})\(")
    files = Path(studio.qt.__file__).parent.rglob("*.py")
    allowed = "class "
    found = [
        f"{file.name}: {line.strip()}"
        for file in files
        for line in file.read_text(encoding="utf-8").splitlines()
        if made.search(line) and not line.startswith(allowed)
    ]
    assert not found
