"""Ctrl+P: everything that the menus can do, and every field of the project, by a few typed letters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtGui import QColor, QKeyEvent, QKeySequence
from PySide6.QtWidgets import QDialog, QDockWidget, QLineEdit, QListWidget, QListWidgetItem, QMenu, QVBoxLayout

from analysis.gauges.gauge import TITLES, Kind
from analysis.report.gauge_table import DEFINITIONS
from studio.project.document import FieldPath
from studio.qt.core import theme
from studio.qt.scene.field_menu import named_fields
from studio.qt.scene.scene_nodes import nodes
from studio.runtime.word_search import found, nearest

if TYPE_CHECKING:
    from studio.qt.shell.window import MainWindow

NOTHING = "Nothing found: no command and no field has these letters"
NEAREST = "Nothing has all of these words. Nearest:"
SIZE = (560, 420)
PASSED_ON = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)
WORDS = {
    "setup": "workspace design choose select lens camera laser place arrange accuracy speed working range",
    "render_workspace": "workspace image picture simulate light",
    "measure": "workspace results points error accuracy dimensions inspect",
    "study": "workspace compare choose sweep vary methods accuracy speed limits",
    "calibrate": "workspace lens distortion board checkerboard intrinsics",
    "dataset": "workspace training labels annotations images machine learning network",
    "Design": "choose lens accuracy speed resolution baseline angle working range focus depth noise",
    "preferences": "settings options",
    "theme_dark": "colours appearance night",
    "import_mesh": "CAD part model load",
    "expose": "brightness dark bright saturated",
    "scan": "conveyor turntable speed all frames",
    "photographs": "open real camera phone rectangle region measure",
    **{f"export_{kind}": "save write points cloud" for kind in ("ply", "csv", "pcd", "xyz", "las", "e57")},
    "aim": "tilt turn rotate direct angle",
    "export_photographs": "export save photograph points table picture",
    "deviation": "compare CAD tolerance surface",
    "heights": "depth range image topography",
    "shortcuts": "keys keyboard",
}
"""What else a person may call a command, by its key, or a panel, by its title."""


@dataclass(frozen=True)
class Entry:
    """What can be chosen. text: as the list shows it, "Scene > Add > Sphere"; more: what tells of it besides; words:
    what else a person may call it.
    """

    name: str
    text: str
    more: str
    tip: str
    possible: bool
    act: Callable[[], object]
    is_field: bool = False
    words: str = ""


class CommandSearch(QDialog):
    """A line to type into above the list of what fits; Return does it."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        self.setObjectName("command-search")
        self.setWindowTitle("Find a command or a field")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.window_of = window
        self.entries = [*entries(window), *measure_entries(window), *field_entries(window)]
        self.line = QLineEdit()
        self.line.setPlaceholderText("A command, or a field of the project: a few letters of each word")
        self.line.setClearButtonEnabled(True)
        self.list = QListWidget()
        self.list.setSpacing(2)
        self.list.setFrameShape(QListWidget.Shape.NoFrame)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(10, 10, 10, 10)
        layout.addWidget(self.line)
        layout.addWidget(self.list, 1)
        self.resize(*SIZE)
        self.line.installEventFilter(self)
        self.line.textChanged.connect(self.show_found)
        self.line.returnPressed.connect(self.choose)
        self.list.itemActivated.connect(lambda item: self.choose())
        self.list.itemClicked.connect(lambda item: self.choose())
        self.show_found("")

    def show_found(self, typed: str) -> None:
        """What fits, the best first."""
        self.list.clear()
        muted = QColor(theme.colours().muted)
        texts = [(f"{entry.name} {entry.words}", entry.more) for entry in self.entries]
        fits = found(typed, texts)
        near = [] if fits else nearest(typed, texts)
        if not fits:
            self._say(NEAREST if near else NOTHING)
        for i in fits or near:
            entry = self.entries[i]
            if entry.is_field and not typed.strip():
                continue  # hundreds of them would hide that these are all commands
            item = QListWidgetItem(entry.text)
            item.setToolTip(entry.tip if entry.possible else "Not possible just now")
            item.setData(Qt.ItemDataRole.UserRole, i)
            if not entry.possible:
                item.setForeground(muted)
            self.list.addItem(item)
        self.list.setCurrentRow(1 if near else 0)

    def _say(self, text: str) -> None:
        """A line that cannot be chosen."""
        line = QListWidgetItem(text)
        line.setFlags(Qt.ItemFlag.NoItemFlags)
        self.list.addItem(line)

    def choose(self) -> None:
        """Do what is marked, after this window has gone: it may open one of its own."""
        item = self.list.currentItem()
        number = None if item is None else item.data(Qt.ItemDataRole.UserRole)
        if number is None:
            return
        entry = self.entries[number]
        if entry.possible:
            self.accept()
            QTimer.singleShot(0, self.window_of, entry.act)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Arrows in the line move through the list."""
        pressed = isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress
        if watched is self.line and pressed and event.key() in PASSED_ON:  # type: ignore[attr-defined]
            self.list.event(event)
            return True
        return super().eventFilter(watched, event)


def entries(window: MainWindow) -> list[Entry]:
    """Every action of the window's menus; menus that are filled when they open are filled."""
    listed: list[Entry] = []

    def walk(menu: QMenu, path: str) -> None:
        menu.aboutToShow.emit()
        for action in menu.actions():
            name = action.text().replace("&", "").split("\t")[0].rstrip("…")
            below = action.menu()
            if isinstance(below, QMenu):
                walk(below, f"{path} > {name}")
            elif name and not action.isSeparator():
                keys = action.shortcut().toString(QKeySequence.SequenceFormat.NativeText)
                text, tip = f"{path} > {name}" + (f"   {keys}" if keys else ""), action.statusTip()
                words, dock = WORDS.get(action.objectName() or name, ""), action.parent()
                # who looks for a panel that is there wants to see it, and its entry in the menu would close it
                there = isinstance(dock, QDockWidget) and not dock.isHidden()
                act = partial(window.show_panel, dock.objectName()) if there and dock is not None else action.trigger
                listed.append(Entry(name, text, f"{path} {tip}", tip, action.isEnabled(), act, words=words))

    for action in window.menuBar().actions():
        menu = action.menu()
        if isinstance(menu, QMenu):
            walk(menu, action.text().replace("&", ""))
    return listed


def measure_entries(window: MainWindow) -> list[Entry]:
    """Every kind of measure of the part, as its list has it, "Measures of the part > Add > Thickness"."""
    render = window.session.shown
    possible = render is not None and bool(render.measurements)

    def start(kind: Kind) -> None:
        window.call_panel("results")
        window.panels["results"].part.start(kind)  # type: ignore[attr-defined]

    return [
        Entry(
            title,
            f"Measures of the part > Add > {title}",
            "measures of the part dimension",
            DEFINITIONS.get(kind, f"{title}: drag its regions in the profile"),
            possible,
            partial(start, kind),
        )
        for kind, title in TITLES.items()
    ]


def field_entries(window: MainWindow) -> list[Entry]:
    """Every field of the inspector that holds one value, "Sensor: Laser speckle"; chosen, it has the focus."""
    session = window.session

    def go_to(item: FieldPath, path: FieldPath) -> None:
        window.call_panel("inspector")
        session.select(item)
        window.panels["inspector"].form.go_to(path)  # type: ignore[attr-defined]

    return [
        Entry(name, f"{node.name}: {name}", node.name, spec.help, True, partial(go_to, node.path, path), True)
        for node in nodes(session.project)
        if node.path
        for path, spec, name in named_fields(session.project, node.path)
    ]
