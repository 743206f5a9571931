"""Nothing that is to be read is cut off, on a small screen and where everything is drawn half as large again."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from PySide6.QtCore import QByteArray, QSize, Qt
from PySide6.QtGui import QTextDocument
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSpinBox,
    QApplication,
    QCheckBox,
    QComboBox,
    QLabel,
    QLineEdit,
    QTabBar,
    QToolButton,
    QWidget,
)
from pytestqt.qtbot import QtBot

from studio.project.document import Document, FieldPath
from studio.qt.calibrate.calibration_work import CalibrationWork
from studio.qt.core import theme
from studio.qt.core.render import Render
from studio.qt.core.session import one_of
from studio.qt.core.widgets import ElidedLabel
from studio.qt.render.render_row import in_short
from studio.qt.shell.shortcuts import CheatSheet
from studio.qt.shell.window import MainWindow
from studio.qt.shell.workspaces import WORKSPACES, sealed
from studio.runtime.preferences import PreferencesFile
from tests.studio.qt.conftest import new_window
from tests.studio.qt.small_session import FOLDER, small_project, small_render

SCREENS = {"1366 x 768": (1366, 768), "1920 x 1200 at 1.5": (1280, 800), "1366 x 768 at 1.5": (911, 512)}
SMALLEST = "1366 x 768 at 1.5"
ITEMS: tuple[FieldPath, ...] = (
    ("scene", "rig", "lasers", 0),
    ("scene", "rig", "camera"),
    ("scene", "objects", 0),
    ("sensor",),
    ("render",),
    ("extraction",),
    ("delivery",),
)
BAR = 32
"""px of a screen's height that its own bar takes."""


@pytest.fixture(autouse=True)
def themed(window: MainWindow) -> None:
    """As it is drawn for a person: the style sheet makes much wider than Qt alone does."""
    theme.apply("light")


def needed(widget: QWidget) -> int | None:
    """px of width that it takes to be read or used; None: it has no text, or wraps it, or is a path."""
    if isinstance(widget, ElidedLabel) and widget.mode == Qt.TextElideMode.ElideMiddle:
        return None
    if isinstance(widget, QCheckBox):
        return widget.sizeHint().width()
    if isinstance(widget, QLabel):
        text = widget.text()
        if not text or widget.wordWrap():
            return None
        if Qt.mightBeRichText(text):
            document = QTextDocument()
            document.setDefaultFont(widget.font())
            document.setDocumentMargin(0)
            document.setHtml(text)
            return round(document.idealWidth())
        return max(widget.fontMetrics().horizontalAdvance(line) for line in text.split("\n"))
    if isinstance(widget, QComboBox):
        return widget.fontMetrics().horizontalAdvance(widget.currentText()) + 24 if not widget.isEditable() else None
    if isinstance(widget, QAbstractButton) and widget.text() and not _icon_alone(widget):
        shown = re.sub("&(.)", r"\1", widget.text())
        return widget.fontMetrics().horizontalAdvance(shown)
    return None


def _icon_alone(button: QAbstractButton) -> bool:
    return (
        isinstance(button, QToolButton)
        and button.toolButtonStyle() == Qt.ToolButtonStyle.ToolButtonIconOnly
        and (not button.icon().isNull())
    )


def cut_off(window: MainWindow) -> list[str]:
    """Texts that have less room than they take, with their panel."""
    found = []
    for key, dock in window.docks.items():
        if not dock.isVisible():
            continue
        for widget in dock.findChildren(QWidget):
            wanted = needed(widget) if widget.isVisible() else None
            seen = widget.visibleRegion().boundingRect()
            if wanted is None or (seen.isEmpty() and widget.width() > 0):  # below the edge of what is scrolled
                continue
            if isinstance(widget, QComboBox | QAbstractButton | QAbstractSpinBox | QLineEdit):
                wanted = max(wanted, widget.width())  # its edges are to be seen
            if min(widget.width(), seen.width()) < wanted:
                text = widget.currentText() if isinstance(widget, QComboBox) else widget.text()  # type: ignore[attr-defined]
                found.append(f"{key}: {text!r} has {min(widget.width(), seen.width())} of {wanted} px")
    return found


def open_measured(window: MainWindow, qtbot: QtBot) -> None:
    """A project whose render is developed and measured by three methods."""
    window.files.replace(Document(small_project(), root=FOLDER))
    world, frame = small_render()
    window.session.add_render(Render(1, small_project(), world, frame))
    qtbot.waitUntil(lambda: bool(window.session.shown.measurements))  # type: ignore[union-attr]


def test_three_renders_are_seen_on_a_small_screen_with_all_that_is_told_of_them(
    window: MainWindow, qtbot: QtBot
) -> None:
    before = window.size()
    open_measured(window, qtbot)
    world, frame = small_render()
    for number in (2, 3, 4):
        window.session.add_render(Render(number, small_project(), world, frame))
    qtbot.waitUntil(lambda: bool(window.session.shown.measurements))  # type: ignore[union-attr]
    window.switch_to("render")
    window.rearrange()
    window.resize(1366, 768 - BAR)
    for _ in range(3):
        QApplication.processEvents()
    history = window.panels["render"].history.list  # type: ignore[attr-defined]
    entries = [history.visualItemRect(history.item(row)) for row in range(3)]
    seen = history.viewport().visibleRegion().boundingRect()
    window.resize(before)
    assert all(seen.contains(entry) for entry in entries), f"{entries} in {seen}"
    beside, metrics = seen.width() - history.iconSize().width() - 12, history.fontMetrics()
    for line in in_short(window.session.shown):  # type: ignore[arg-type]
        assert metrics.horizontalAdvance(line) <= beside, line
        assert 3 * metrics.height() <= entries[0].height() + 3


def calibrate_virtual_boards(window: MainWindow, qtbot: QtBot) -> None:
    """The workspace Calibrate with all that it can show; another project takes it away again."""
    work = one_of(CalibrationWork, window.session)
    work.terms = 0
    work.simulate()
    qtbot.waitUntil(lambda: not work.running)
    assert work.solved is not None
    work.tell("What cannot be done is told in as many lines as it takes: " + "a long reason, " * 5)


@pytest.mark.parametrize(
    "screen", [SMALLEST, *(pytest.param(name, marks=pytest.mark.validation) for name in SCREENS if name != SMALLEST)]
)
def test_no_text_of_any_panel_is_cut_off(window: MainWindow, qtbot: QtBot, screen: str) -> None:
    before, (width, height) = window.size(), SCREENS[screen]
    found: dict[object, list[str]] = {}
    open_measured(window, qtbot)
    calibrate_virtual_boards(window, qtbot)
    for each in WORKSPACES:
        window.switch_to(each.key)
        window.rearrange()
        window.resize(width, height - BAR)
        items = ITEMS if each.key == "setup" else ITEMS[:1]
        if each.key == "measure":  # the render is of another scene from here on, which is told
            window.session.set(("scene", "rig", "lasers", 0, "fan_angle"), 0.5, "fan angle")
        for item, extra in [
            *((item, ()) for item in items),
            (ITEMS[0], ("motion", "log")),
            (ITEMS[0], ("nominal",)),
        ]:
            window.session.select(item)
            for key in extra:
                window.show_panel(key)
            for _ in range(3):
                QApplication.processEvents()
            assert window.width() <= width and window.height() <= height, f"{each.key} is larger than {screen}"
            cut = cut_off(window)
            if cut:
                found[each.key, item, extra] = cut
        window.rearrange()
    window.resize(before)
    assert not found, "\n".join(f"{where}: {text}" for where, texts in found.items() for text in texts)


def test_the_boxes_of_a_section_show_number_and_unit(window: MainWindow, qtbot: QtBot) -> None:
    """ "-7.505 m" was seen of -7.505 mm."""
    before = window.size()
    open_measured(window, qtbot)
    window.switch_to("measure")
    window.rearrange()
    window.resize(1366, 768 - BAR)
    window.show_panel("nominal")
    nominal = window.panels["nominal"]
    section = nominal.section  # type: ignore[attr-defined]
    nominal.show_tab(section)  # type: ignore[attr-defined]
    section.normal.setCurrentIndex(section.normal.count() - 1)
    cut = []
    boxes = (*section.through, *section.own, section.thickness)
    for box, value in zip(boxes, (-7.505, -907.505, 0, -1, 0, 1, 1), strict=True):
        box.setValue(value)
    for _ in range(3):
        QApplication.processEvents()
    for box in boxes:
        room, wanted = box.lineEdit().width(), box.fontMetrics().horizontalAdvance(box.text())
        seen = box.visibleRegion().boundingRect().width()
        if room < wanted + 4 or seen < box.width():
            cut.append(f"{box.text()!r} has {room} of {wanted} px, {seen} of {box.width()} seen")
    window.rearrange()
    window.resize(before)
    assert not cut, "\n".join(cut)


def test_no_workspace_makes_the_window_larger_than_a_small_screen_at_1_5(window: MainWindow, qtbot: QtBot) -> None:
    """1366 x 768, drawn half as large again; also from one workspace to the next, whose columns are others."""
    before, size = window.size(), QSize(911, 512 - BAR)
    open_measured(window, qtbot)
    grown = []
    window.resize(size)
    for key in ("setup", "render", "measure", "study", "calibrate", "dataset", "setup", "measure", "render", "setup"):
        window.switch_to(key)
        for item in ITEMS if key == "setup" else ():
            window.session.select(item)
            QApplication.processEvents()
        for _ in range(3):
            QApplication.processEvents()
        for called in ("motion", "log"):  # what a command shows beside what is there
            window.call_panel(called)
        for _ in range(3):
            QApplication.processEvents()
        if window.size() != size:
            grown.append(f"{key}: {window.width()} x {window.height()}, least {window.minimumSizeHint().width()}")
    window.resize(before)
    assert not grown


def test_a_panel_that_is_called_for_comes_before_another_and_leaves_nothing_behind(
    window: MainWindow, qtbot: QtBot
) -> None:
    before, size = window.size(), QSize(911, 512)
    window.resize(size)
    window.switch_to("measure")
    window.show_panel("nominal")
    for _ in range(3):
        QApplication.processEvents()
    assert window.size() == size, "there is room for it where the camera view is"
    assert window.docks["camera"] in window.tabifiedDockWidgets(window.docks["nominal"])

    def tabs() -> list[QTabBar]:
        bars = window.findChildren(QTabBar, options=Qt.FindChildOption.FindDirectChildrenOnly)
        # those that it has no use for Qt keeps beyond the edge
        return [bar for bar in bars if bar.isVisible() and bar.geometry().intersects(window.rect())]

    assert tabs()
    window.switch_to("setup")
    qtbot.waitUntil(lambda: not tabs())
    window.switch_to("measure")
    qtbot.waitUntil(lambda: bool(tabs()))
    window.docks["nominal"].hide()
    window.rearrange()
    window.resize(before)


@pytest.mark.parametrize("screen", SCREENS.values(), ids=SCREENS)
def test_the_cheat_sheet_fits_its_screen(
    window: MainWindow, screen: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whole where 1280 px are, and never larger than the screen."""
    monkeypatch.setattr(CheatSheet, "screen", lambda _: SimpleNamespace(availableSize=lambda: QSize(*screen)))
    sheet = CheatSheet(window)
    page = sheet.findChild(QLabel).sizeHint()
    assert sheet.width() <= screen[0] and sheet.height() <= screen[1] - BAR
    assert screen[0] < 1280 or sheet.size() == page


@pytest.mark.parametrize("kept", [True, pytest.param(False, marks=pytest.mark.validation)])
@pytest.mark.parametrize(("screen", "maximized"), [(QSize(1366, 768), True), (QSize(1920, 1200), False)])
def test_a_window_fits_its_screen_where_nothing_of_an_earlier_one_is_restored(
    screen: QSize, maximized: bool, kept: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """kept: of a screen so different that Qt refuses it."""
    if kept:
        PreferencesFile(tmp_path / "config").change(geometry=sealed(QByteArray(b"of another screen")))
    monkeypatch.setattr(MainWindow, "screen", lambda _: SimpleNamespace(availableSize=lambda: screen))
    made = new_window(tmp_path, "plane")
    assert made.isMaximized() == maximized
    size = made.size()
    assert size.boundedTo(screen) == size
    made.close()
    made.deleteLater()
