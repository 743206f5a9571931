"""Ctrl+P: everything that the menus can do, by a few typed letters."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtGui import QAction, QColor, QKeyEvent, QKeySequence
from PySide6.QtWidgets import QDialog, QLineEdit, QListWidget, QListWidgetItem, QMainWindow, QMenu, QVBoxLayout

from studio.qt.core import theme
from studio.runtime.word_search import found

NOTHING = "Nothing found: no command has these letters"
SIZE = (560, 420)
PASSED_ON = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)


@dataclass(frozen=True)
class Entry:
    """An action, with the menus that lead to it: "Scene > Add"."""

    menu: str
    name: str
    action: QAction


class CommandSearch(QDialog):
    """A line to type into above the list of what fits; Return does it."""

    def __init__(self, window: QMainWindow) -> None:
        super().__init__(window)
        self.setObjectName("command-search")
        self.setWindowTitle("Find a command")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.entries = entries(window)
        self.line = QLineEdit()
        self.line.setPlaceholderText("What to do: a few letters of each word")
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
        texts = [(entry.name, f"{entry.menu} {entry.action.statusTip()}") for entry in self.entries]
        for i in found(typed, texts):
            entry = self.entries[i]
            keys = entry.action.shortcut().toString(QKeySequence.SequenceFormat.NativeText)
            item = QListWidgetItem(f"{entry.menu} > {entry.name}" + (f"   {keys}" if keys else ""))
            item.setToolTip(entry.action.statusTip())
            item.setData(Qt.ItemDataRole.UserRole, i)
            if not entry.action.isEnabled():
                item.setForeground(muted)
                item.setToolTip("Not possible just now")
            self.list.addItem(item)
        self.list.setCurrentRow(0)
        if self.list.count() == 0:
            nothing = QListWidgetItem(NOTHING)
            nothing.setFlags(Qt.ItemFlag.NoItemFlags)
            self.list.addItem(nothing)

    def choose(self) -> None:
        """Do what is marked, after this window has gone: it may open one of its own."""
        item = self.list.currentItem()
        number = None if item is None else item.data(Qt.ItemDataRole.UserRole)
        if number is None:
            return
        action = self.entries[number].action
        if action.isEnabled():
            self.accept()
            QTimer.singleShot(0, action, action.trigger)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Arrows in the line move through the list."""
        pressed = isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress
        if watched is self.line and pressed and event.key() in PASSED_ON:  # type: ignore[attr-defined]
            self.list.event(event)
            return True
        return super().eventFilter(watched, event)


def entries(window: QMainWindow) -> list[Entry]:
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
                listed.append(Entry(path, name, action))

    for action in window.menuBar().actions():
        menu = action.menu()
        if isinstance(menu, QMenu):
            walk(menu, action.text().replace("&", ""))
    return listed
