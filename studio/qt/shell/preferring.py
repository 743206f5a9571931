"""Ctrl+,: what a person wants of every project, asked in one dialog and taken on at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from PySide6.QtCore import QObject, Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QLabel,
    QVBoxLayout,
)

from render.base.threads import thread_count, use_at_most
from studio.editing.units import show_lengths_in
from studio.project.document import Document
from studio.qt.core.boxes import ChoiceBox, WholeBox
from studio.runtime.preferences import Preferences

if TYPE_CHECKING:
    from studio.qt.shell.window import MainWindow

THEMES = {"system": "As the desktop", "dark": "Dark", "light": "Light"}
LENGTHS = {"mm": "Millimetres", "um": "Micrometres", "cm": "Centimetres", "m": "Metres", "in": "Inches"}
SCALES = {"full": (1.0, "Full"), "half": (0.5, "Half"), "quarter": (0.25, "A quarter"), "eighth": (0.125, "An eighth")}


def take_units(values: Preferences) -> None:
    """Before any form is made."""
    show_lengths_in(values.length_unit)


class Preferring(QObject):
    """Makes the preferences felt in a window, and asks for others."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        self.window = window
        self.take_on()
        self._take_scale()
        window.commands.connect("preferences", self.ask)

    def ask(self) -> PreferencesDialog:
        """Open the dialog; the window goes on behind it."""
        dialog = PreferencesDialog(self.window, self.window.preferences.values)
        dialog.accepted.connect(lambda: self.change(dialog.chosen()))
        dialog.open()
        return dialog

    def change(self, chosen: dict[str, Any]) -> None:
        """Remember what was chosen, and take it on."""
        before = self.window.preferences.values
        self.window.preferences.change(**chosen)
        self.take_on()
        if chosen["theme"] != before.theme:
            self.window.choose_theme(chosen["theme"])
        if chosen["image_scale"] != before.image_scale:
            self._take_scale()
        if chosen["length_unit"] != before.length_unit:
            self.window.session.message.emit("info", "Lengths are shown in the other unit from the next start")

    def take_on(self) -> None:
        """All but what holds from the next start."""
        values = self.window.preferences.values
        use_at_most(values.threads)
        Document.depth = values.undo_depth
        self.window.files.keep_every(values.autosave_every if values.autosave else None)

    def _take_scale(self) -> None:
        for panel in ("render", "motion"):
            box = cast(Any, self.window.panels[panel]).scale
            box.setCurrentIndex(max(0, box.findData(SCALES[self.window.preferences.values.image_scale][0])))


class PreferencesDialog(QDialog):
    """A row for each preference."""

    def __init__(self, window: MainWindow, values: Preferences) -> None:
        super().__init__(window)
        self.setObjectName("preferences")
        self.setWindowTitle("Preferences")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.theme = _choice(THEMES)
        self.length = _choice(LENGTHS)
        self.threads = _number(0, max(thread_count(1024), 1), "")
        self.threads.setSpecialValueText("all processors")
        self.threads.setToolTip("Of renders and measurements in the window, at most; no number depends on it")
        self.scale = _choice({key: name for key, (_, name) in SCALES.items()})
        self.autosave = QCheckBox("Keep unsaved work in case of a crash")
        self.every = _number(5, 3600, " s")
        self.autosave.toggled.connect(self.every.setEnabled)
        self.undo = _number(10, 10_000, " edits")
        form = QFormLayout()
        form.setLabelAlignment(Qt.AlignmentFlag.AlignRight)
        form.addRow("Theme", self.theme)
        form.addRow("Lengths in", self.length)
        note = QLabel(
            "Of fields and design, from the next start; results stay in mm and µm.\nWhat is typed may have any unit."
        )
        note.setObjectName("muted")
        form.addRow("", note)
        form.addRow("Threads", self.threads)
        form.addRow("Image size", self.scale)
        form.addRow("Autosave", self.autosave)
        form.addRow("At least every", self.every)
        form.addRow("Undo", self.undo)
        button = QDialogButtonBox.StandardButton
        buttons = QDialogButtonBox(button.Ok | button.Cancel | button.RestoreDefaults)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        buttons.button(button.RestoreDefaults).clicked.connect(lambda: self.show_values(Preferences()))
        column = QVBoxLayout(self)
        column.setSpacing(14)
        column.addLayout(form)
        column.addWidget(buttons)
        self.show_values(values)

    def show_values(self, values: Preferences) -> None:
        """In the rows; nothing is taken on before OK."""
        self.theme.setCurrentIndex(self.theme.findData(values.theme))
        self.length.setCurrentIndex(self.length.findData(values.length_unit))
        self.threads.setValue(values.threads or 0)
        self.scale.setCurrentIndex(self.scale.findData(values.image_scale))
        self.autosave.setChecked(values.autosave)
        self.every.setEnabled(values.autosave)  # a box that stays unchecked tells of no change
        self.every.setValue(round(values.autosave_every))
        self.undo.setValue(values.undo_depth)

    def chosen(self) -> dict[str, Any]:
        """By the names of `Preferences`."""
        return {
            "theme": self.theme.currentData(),
            "length_unit": self.length.currentData(),
            "threads": self.threads.value() or None,
            "image_scale": self.scale.currentData(),
            "autosave": self.autosave.isChecked(),
            "autosave_every": float(self.every.value()),
            "undo_depth": self.undo.value(),
        }


def _choice(names: dict[str, str]) -> ChoiceBox:
    box = ChoiceBox()
    for key, name in names.items():
        box.addItem(name, key)
    return box


def _number(low: int, high: int, suffix: str) -> WholeBox:
    box = WholeBox()
    box.setRange(low, high)
    box.setSuffix(suffix)
    return box
