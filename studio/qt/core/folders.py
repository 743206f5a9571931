"""Asking for the folder that results go into: one that is there, or a new one by its name."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QDialogButtonBox, QFileDialog, QLineEdit, QMessageBox, QWidget

from studio.qt.core.dialogs import show_trouble
from studio.runtime.error_messages import trouble

LONGEST = 80


class ResultsFolder(QFileDialog):
    """Qt's own choice of a folder knows only those that there are; here a name that is new makes one."""

    def __init__(self, parent: QWidget | None, title: str, suggested: Path) -> None:
        super().__init__(parent, title, str(suggested.parent))
        self.setFileMode(QFileDialog.FileMode.Directory)
        self.setOption(QFileDialog.Option.ShowDirsOnly)
        self.setLabelText(QFileDialog.DialogLabel.FileName, "Folder:")
        self.setLabelText(QFileDialog.DialogLabel.Accept, "Choose")
        self.selectFile(suggested.name)
        typed, buttons = self.findChild(QLineEdit), self.findChild(QDialogButtonBox)
        if isinstance(typed, QLineEdit) and isinstance(buttons, QDialogButtonBox):  # no system's own dialog
            # Qt switches the button off for what is not there yet: each time, so that it is switched on after each
            for signal in (typed.textChanged, self.directoryEntered, self.currentChanged):
                signal.connect(partial(self._allow, buttons))
            self._allow(buttons)

    def _allow(self, buttons: QDialogButtonBox, *_: str) -> None:
        for button in buttons.buttons():
            if buttons.buttonRole(button) == QDialogButtonBox.ButtonRole.AcceptRole:
                button.setEnabled(True)

    def accept(self) -> None:
        for path in map(Path, self.selectedFiles()):
            if path.parent.is_dir() and not path.exists():
                try:
                    path.mkdir()
                except OSError as error:
                    show_trouble(self, trouble(error, "make the folder"))
                    return
        super().accept()


def readable_folder(name: str) -> str:
    """A name of any characters as one that every system takes, still to be read."""
    return re.sub(r"[\\/:*?\"<>|\x00-\x1f]+", "-", name).strip(". ")[:LONGEST] or "results"


def ask_results_folder(parent: QWidget, title: str, place: Path, name: str) -> Path | None:
    """None: the person thought better of it. place, name: where a new one is suggested, and what it could be called."""
    dialog = ResultsFolder(parent, title, place / readable_folder(name))
    chosen = dialog.selectedFiles()[0] if dialog.exec() else ""
    dialog.deleteLater()
    return Path(chosen) if chosen else None


def unused_name(place: Path, name: str) -> str:
    """The name itself, or with the next number under which there is nothing yet."""
    name, number = readable_folder(name), 2
    unused = name
    while (place / unused).exists():
        unused, number = f"{name} {number}", number + 1
    return unused


def may_replace_scan(parent: QWidget | None, folder: Path) -> bool:
    """What a folder holds of an earlier scan goes when another one begins there: the person is asked first."""
    box = QMessageBox(
        QMessageBox.Icon.Warning, "Replace the scan", f"Replace the scan in “{folder.name}”?", parent=parent
    )
    box.setObjectName("replace")
    box.setInformativeText(
        f"Its frames, points and report are deleted as soon as the new one begins, and cannot be had back:\n{folder}"
    )
    replace = box.addButton("Replace", QMessageBox.ButtonRole.DestructiveRole)
    box.setDefaultButton(box.addButton(QMessageBox.StandardButton.Cancel))
    box.exec()
    return box.clickedButton() is replace
