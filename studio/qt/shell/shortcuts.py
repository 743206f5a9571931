"""The cheat sheet: every shortcut on one page, read from the same table as the menus."""

from __future__ import annotations

import html

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtWidgets import QDialog, QLabel, QScrollArea, QVBoxLayout, QWidget

from studio.qt.core import theme
from studio.qt.core.actions import COMMANDS, VIEW_KEYS, Command
from studio.qt.core.widgets import room_for_a_window

MOUSE = (
    ("Drag", "turn the 3D view"),
    ("Shift+drag, middle drag", "shift it; Shift over the image: a region"),
    ("Wheel", "zoom"),
    ("Click", "select; Ctrl: several; in a plot: keep the row"),
    ("Double-click", "frame the part; a plot: all of it"),
    ("Hover", "the same row in every view"),
    ("Drag on a number", "change it; with Shift finer, with Ctrl coarser"),
)
FIELDS = (
    ("Return", "take it over"),
    ("Esc", "the value as it was; end a drag, a menu"),
    ("Up, Down", "a step; with Shift a tenth of it"),
)
LISTS = (("Return", "frame the part"), ("F2", "name a part or a render"), ("Del", "remove what is chosen in it"))
COLUMNS = (("File", "Render"), ("Edit", "Scene", "Lists", "Help"), ("View", "Measure"), ("Mouse", "Fields", "3D view"))


class CheatSheet(QDialog):
    """Esc closes it; a screen that is smaller than the page shows a part of it."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Shortcuts")
        self.setObjectName("cheat-sheet")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        label = QLabel(page())
        label.setTextFormat(Qt.TextFormat.RichText)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        label.setContentsMargins(16, 12, 12, 16)
        page_area = QScrollArea()
        page_area.setFrameShape(QScrollArea.Shape.NoFrame)
        page_area.setWidget(label)
        layout.addWidget(page_area)
        self.resize(label.sizeHint().boundedTo(room_for_a_window(self)))


def page() -> str:
    """The sheet as rich text."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for command in COMMANDS:
        if isinstance(command, Command) and command.shortcut:
            known = QKeySequence.listFromString(command.shortcut)
            keys = ", ".join(one.toString(QKeySequence.SequenceFormat.NativeText) for one in known)
            text = command.text.replace("&", "").rstrip("…")
            groups.setdefault(command.menu.split("/")[0], []).append((keys, text))
    groups |= {"Mouse": list(MOUSE), "Fields": list(FIELDS), "Lists": list(LISTS), "3D view": list(VIEW_KEYS.items())}
    cells = "".join(
        f"<td style='padding-right: 12px'>{''.join(_group(name, groups[name]) for name in column)}</td>"
        for column in COLUMNS
    )
    return f"<table><tr>{cells}</tr></table>"


def _group(name: str, rows: list[tuple[str, str]]) -> str:
    c = theme.colours()
    lines = "".join(
        f"<tr><td style='padding-right: 10px; color: {c.accent}'><b>{html.escape(keys)}</b></td>"
        f"<td>{html.escape(text)}</td></tr>"
        for keys, text in rows
    )
    return f"<p style='color: {c.muted}; margin-bottom: 2px'><b>{name}</b></p><table cellspacing='3'>{lines}</table>"
