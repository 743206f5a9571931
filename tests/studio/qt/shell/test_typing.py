"""What keys mean while something is typed in a field of the window, and what they leave as it is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, cast

import pytest
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QEnterEvent, QKeyEvent
from PySide6.QtWidgets import QApplication, QCheckBox, QComboBox, QFileDialog, QPushButton, QWidget
from pytestqt.qtbot import QtBot

from studio.qt.shell.window import MainWindow
from tests.studio.qt.scene.inspector_hands import LASER, field, row, type_into


@pytest.fixture
def power(window: MainWindow, qtbot: QtBot) -> Any:
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    window.session.select(LASER)
    return field(inspector_of(window), *LASER, "power")


def inspector_of(window: MainWindow) -> Any:
    return window.panels["inspector"]


def test_escape_is_the_fields_before_it_is_the_windows(window: MainWindow, power: Any, qtbot: QtBot) -> None:
    before = power.text()
    type_into(qtbot, power, "-500", key=None)
    told = row(inspector_of(window), *LASER, "power").reason
    assert told.isVisible()
    qtbot.keyClick(power, Qt.Key.Key_Escape)
    assert power.text() == before and not power.invalid and not told.isVisible()


def test_a_command_takes_what_is_being_typed(window: MainWindow, power: Any, qtbot: QtBot) -> None:
    type_into(qtbot, power, "35", key=None)
    asked = []
    window.commands["copy_python"].triggered.connect(lambda: asked.append(window.session.project))
    qtbot.keyClick(power, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
    assert asked[0].scene.lasers[0].power == pytest.approx(0.035)


def test_a_command_drops_what_is_typed_in_vain_and_says_so(window: MainWindow, power: Any, qtbot: QtBot) -> None:
    before = power.text()
    type_into(qtbot, power, "-500", key=None)
    with qtbot.waitSignal(window.session.message, check_params_cb=lambda kind, text: "Power" in text) as told:
        window.commands["copy_python"].trigger()
    assert told.args[0] == "warning" and "at least 0 mW. The value is as it was" in told.args[1]
    assert power.text() == before and not power.invalid


def test_a_render_leaves_the_panels_where_they_are(
    window: MainWindow, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it does is in the status bar; the Render panel between others cut their buttons off."""
    started: list[str] = []
    monkeypatch.setattr(window.runner, "run", lambda key, name, *rest: started.append(name))
    for workspace in ("setup", "measure"):
        window.switch_to(workspace)
        shown = {key for key, dock in window.docks.items() if dock.isVisible()}
        qtbot.keyClick(window, Qt.Key.Key_F5)
        assert {key for key, dock in window.docks.items() if dock.isVisible()} == shown
    assert started == ["render"] * 2


def test_escape_gives_up_the_measure_that_is_being_added(window: MainWindow, qtbot: QtBot) -> None:
    window.switch_to("measure")
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    results: Any = window.panels["results"]
    part = results.part
    part.start("angle")
    part.place(-0.01, -0.005)
    for focus in (results.profile, results.rows, window):
        focus.setFocus()
        qtbot.keyClick(window.focusWidget() or window, Qt.Key.Key_Escape)
        assert part.placing is None and not any(span.isVisible() for span in part.drawing.spans)
        part.start("angle")
    assert not window.session.project.measures


def test_keys_are_for_the_3d_view_that_the_mouse_comes_over(window: MainWindow, power: Any, qtbot: QtBot) -> None:
    """Not while something is typed: a tree would take G for the first letter of a name."""
    view = cast(Any, window.panels["viewport"]).view
    tree = window.panels["scene"]
    enter = QEnterEvent(QPointF(5, 5), QPointF(5, 5), QPointF(5, 5))
    power.setFocus()
    QApplication.sendEvent(view, enter)
    assert power.hasFocus()
    tree.setFocus()
    QApplication.sendEvent(view, enter)
    assert view.hasFocus()


@pytest.mark.parametrize("kind", [QPushButton, QCheckBox])
def test_a_button_that_was_clicked_keeps_no_keys_from_the_3d_view(
    window: MainWindow, power: Any, qtbot: QtBot, kind: type[QWidget]
) -> None:
    """After a click on a button of the inspector G and R did nothing over the view."""
    before = window.session.project.scene.T_world_laser(0)[0, 3]
    with left_for_the_view(window, kind()):
        for key in ("g", "x", "3", "0", Qt.Key.Key_Return):
            qtbot.keyClick(window.focusWidget(), key)
    assert window.session.project.scene.T_world_laser(0)[0, 3] == pytest.approx(before + 0.03)
    window.files.count_as_saved(window.session.project)


@pytest.mark.parametrize("editable", [True, False])
def test_a_list_that_is_typed_into_keeps_its_keys(window: MainWindow, power: Any, editable: bool) -> None:
    box = QComboBox(editable=editable)
    with left_for_the_view(window, box):
        assert box.hasFocus() == editable


@contextmanager
def left_for_the_view(window: MainWindow, widget: QWidget) -> Iterator[None]:
    """A widget of the inspector has the focus, and the mouse goes over the 3D view."""
    widget.setParent(inspector_of(window))
    widget.show()
    widget.setFocus()
    assert widget.hasFocus()
    view = cast(Any, window.panels["viewport"]).view
    QApplication.sendEvent(view, QEnterEvent(QPointF(5, 5), QPointF(5, 5), QPointF(5, 5)))
    yield
    widget.setParent(None)
    widget.deleteLater()


def test_ctrl_and_a_letter_is_the_menus_while_something_is_typed(
    window: MainWindow, power: Any, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_, **__: ("", ""))
    window.commands["export_html"].setEnabled(True)
    asked: list[str] = []
    own = [(window.commands[key], partial(asked.append, key)) for key in ("export_html", "duplicate")]
    for command, told in own:
        command.triggered.connect(told)
    type_into(qtbot, power, "35", key=None)
    qtbot.keyClick(power, Qt.Key.Key_E, Qt.KeyboardModifier.ControlModifier)
    qtbot.keyClick(power, Qt.Key.Key_D, Qt.KeyboardModifier.ControlModifier)
    for command, told in own:
        command.triggered.disconnect(told)
    assert asked == ["export_html", "duplicate"] and power.text() == "35"
    qtbot.keyClick(power, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    assert power.selectedText() == "35", "keys of editing stay the field's"


@pytest.mark.parametrize("letter", "EDNOSPILQ")
def test_a_field_leaves_the_keys_of_the_menus_alone(window: MainWindow, power: Any, qtbot: QtBot, letter: str) -> None:
    """However its platform means them: it would say by accepting what overrides a shortcut that it wants the key."""
    type_into(qtbot, power, "35", key=None)
    key, control = getattr(Qt.Key, f"Key_{letter}"), Qt.KeyboardModifier.ControlModifier
    event = QKeyEvent(QEvent.Type.ShortcutOverride, key, control)
    event.ignore()
    QApplication.sendEvent(power, event)
    assert not event.isAccepted()
