"""The workspaces: arrangements of the same panels, so that no screen shows more than the task needs."""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass
from typing import TypeVar

from PySide6.QtCore import QByteArray, Qt
from PySide6.QtWidgets import QDockWidget, QMainWindow, QTabBar, QToolBar, QWidget

Named = TypeVar("Named", bound=QWidget)

Area = Qt.DockWidgetArea
LEFT, RIGHT, BOTTOM = Area.LeftDockWidgetArea, Area.RightDockWidgetArea, Area.BottomDockWidgetArea
CALLED = ("nominal", "motion", "log")
"""Panels of no workspace, which come in front of one where they are called for: there is no room beside."""
VERSION = 5
"""Of the arrangement; a remembered one of another version is dropped."""


@dataclass(frozen=True)
class Column:
    """Docks of one area, and its share of the window's width (at the sides) or height (at the bottom)."""

    area: Area
    share: float
    docks: tuple[tuple[str, float], ...]
    """Name, and share of the area."""


@dataclass(frozen=True)
class Workspace:
    """Its name on the switch, what it is for, and where the panels stand. What is not named is hidden."""

    key: str
    title: str
    tip: str
    viewport: bool
    columns: tuple[Column, ...]
    sides_reach_down: bool
    """The areas at the sides, not the bottom one, hold the lower corners."""
    behind: str
    """The panel that those which are called for come in front of."""


SETTING_UP = (
    Column(LEFT, 0.17, (("scene", 1.0),)),
    Column(RIGHT, 0.26, (("inspector", 0.58), ("readout", 0.42))),
    Column(BOTTOM, 0.42, (("camera", 1.0),)),
)
RENDERING = (
    Column(LEFT, 0.74, (("camera", 1.0),)),
    Column(RIGHT, 0.26, (("render", 0.68), ("develop", 0.32))),
)
MEASURING = (Column(LEFT, 0.42, (("camera", 1.0),)), Column(BOTTOM, 0.5, (("results", 1.0),)))
STUDYING = (Column(LEFT, 0.32, (("study", 1.0),)), Column(RIGHT, 0.68, (("charts", 1.0),)))
CALIBRATING = (Column(BOTTOM, 1.0, (("calibrate", 0.25), ("boards", 0.46), ("calibration", 0.29))),)
LABELLING = (Column(LEFT, 0.4, (("recipe", 1.0),)), Column(RIGHT, 0.6, (("contact", 1.0),)))
QUESTION = "Many runs with one question: what a value changes, and where methods break"
WORKSPACES = (
    Workspace("setup", "Set up", "Place and design: camera, lasers, objects", True, SETTING_UP, True, "readout"),
    Workspace("render", "Render", "The image and its light", False, RENDERING, True, "develop"),
    Workspace("measure", "Measure", "Line, points and their error", True, MEASURING, False, "camera"),
    Workspace("study", "Study", QUESTION, False, STUDYING, True, "charts"),
    Workspace(
        "calibrate", "Calibrate", "Camera and lasers from photographs of a board", False, CALIBRATING, True, "boards"
    ),
    Workspace(
        "dataset", "Dataset", "Labelled images of drawn scenes, by the thousand", False, LABELLING, True, "contact"
    ),
)
"""In the order of the switch; the 3D view takes what the columns leave."""


def workspace(key: str) -> Workspace:
    """By its key; the first one for a key that there is not."""
    return next((each for each in WORKSPACES if each.key == key), WORKSPACES[0])


def arrange(window: QMainWindow, docks: dict[str, QDockWidget], wanted: Workspace) -> None:
    """Put every dock where the workspace has it."""
    window.restoreState(first_state(window, docks, wanted), VERSION)
    share_out(window, docks, wanted)


def first_state(window: QMainWindow, docks: dict[str, QDockWidget], wanted: Workspace) -> QByteArray:
    """The workspace's own arrangement as Qt saves one, of a window with toolbars and docks of these names.

    It is made with empty docks, so that those of the window are added once and never taken out.
    """
    model = QMainWindow()
    for bar in window.findChildren(QToolBar, options=Qt.FindChildOption.FindDirectChildrenOnly):
        model.addToolBar(window.toolBarArea(bar), _named(QToolBar(), bar.objectName()))
    corners = (LEFT, RIGHT) if wanted.sides_reach_down else (BOTTOM, BOTTOM)
    model.setCorner(Qt.Corner.BottomLeftCorner, corners[0])
    model.setCorner(Qt.Corner.BottomRightCorner, corners[1])
    empty = {name: _named(QDockWidget(), dock.objectName()) for name, dock in docks.items()}
    shown = {name for column in wanted.columns for name, _ in column.docks}
    for name, dock in empty.items():
        if name not in shown:
            model.addDockWidget(RIGHT, dock)
            dock.hide()
    for column in wanted.columns:
        beside = Qt.Orientation.Horizontal if column.area == BOTTOM else Qt.Orientation.Vertical
        before: QDockWidget | None = None
        for name, _ in column.docks:
            if before is None:
                model.addDockWidget(column.area, empty[name])
            else:
                model.splitDockWidget(before, empty[name], beside)
            before = empty[name]
            empty[name].show()
    for name in CALLED:
        model.tabifyDockWidget(empty[wanted.behind], empty[name])
        empty[name].hide()
    return model.saveState(VERSION)


def _named(widget: Named, name: str) -> Named:
    widget.setObjectName(name)
    return widget


def share_out(window: QMainWindow, docks: dict[str, QDockWidget], wanted: Workspace) -> None:
    """Give the docks their shares of the window's present size."""
    size = window.size()
    for column in wanted.columns:
        across = Qt.Orientation.Vertical if column.area == BOTTOM else Qt.Orientation.Horizontal
        along = Qt.Orientation.Horizontal if column.area == BOTTOM else Qt.Orientation.Vertical
        extent = size.height() if column.area == BOTTOM else size.width()
        first = docks[column.docks[0][0]]
        window.resizeDocks([first], [round(column.share * extent)], across)
        if len(column.docks) > 1:
            sizes = [round(1000 * share) for _, share in column.docks]
            window.resizeDocks([docks[name] for name, _ in column.docks], sizes, along)
    if window.size() != size:  # shares that do not fit beside what is least let the window grow
        window.resize(size)


def hide_stray_tabs(window: QMainWindow) -> None:
    """Of panels that stand one before the other no longer, Qt may leave the bar of their tabs over others."""
    docks = window.findChildren(QDockWidget)
    shown = {dock.windowTitle() for dock in docks if not dock.isHidden() and window.tabifiedDockWidgets(dock)}
    for bar in window.findChildren(QTabBar, options=Qt.FindChildOption.FindDirectChildrenOnly):
        if not {bar.tabText(i) for i in range(bar.count())} <= shown:
            bar.hide()


def remembered(window: QMainWindow) -> str:
    """The arrangement as text."""
    return sealed(window.saveState(VERSION))


def restore(window: QMainWindow, text: str) -> bool:
    """Bring back a remembered arrangement; False: it is not one, damaged, or of another version."""
    state = unsealed(text)
    return state is not None and window.restoreState(state, VERSION)


def sealed(data: QByteArray) -> str:
    """What Qt saved, as text with a checksum."""
    raw = bytes(data.data())
    return f"{zlib.crc32(raw):08x}:{base64.b64encode(raw).decode()}"


def unsealed(text: str) -> QByteArray | None:
    """None: it is not as it was sealed. Of damaged bytes Qt makes what it can, which may be a segmentation fault."""
    checksum, _, encoded = text.partition(":")
    try:
        raw = base64.b64decode(encoded, validate=True)
    except ValueError:
        return None
    return QByteArray(raw) if raw and checksum == f"{zlib.crc32(raw):08x}" else None
