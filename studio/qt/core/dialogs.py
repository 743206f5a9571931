"""What the window asks and tells: errors with cause and cure, unsaved changes, recovery, templates."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QMessageBox,
    QVBoxLayout,
    QWidget,
)

from render.base.errors import InputError
from studio.qt.core.session import Session
from studio.runtime.error_messages import Trouble, trouble

Answer = Literal["save", "discard", "cancel"]


def show_trouble(parent: QWidget | None, what: Trouble) -> QMessageBox:
    """A dialog with what failed, why and what to do; the window goes on behind it."""
    box = QMessageBox(QMessageBox.Icon.Warning, "Blazer Studio", what.title, QMessageBox.StandardButton.Ok, parent)
    box.setObjectName("trouble")
    box.setTextFormat(Qt.TextFormat.PlainText)
    box.setInformativeText("\n\n".join(part for part in (what.cause, what.cure) if part))
    if what.details:
        box.setDetailedText(what.details)
    box.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    box.open()
    return box


def ask_unsaved(parent: QWidget, name: str, more: str = "") -> Answer:
    """What to do with changes that no file holds; more: what goes whatever is done with them."""
    what = "\n\n".join(filter(None, ["Without saving they are lost.", more]))
    return ask_to_keep(parent, "unsaved", f"Save the changes to “{name}”?", what)


def ask_to_keep(parent: QWidget, name: str, question: str, what: str, save: str = "Save") -> Answer:
    """What to do with work that no file holds; what: is lost, in sentences; save: the button that keeps it."""
    button = QMessageBox.StandardButton
    buttons = button.Save | button.Discard | button.Cancel
    box = QMessageBox(QMessageBox.Icon.Question, "Unsaved changes", question, buttons, parent)
    box.setObjectName(name)
    box.setInformativeText(what)
    box.button(button.Save).setText(save)
    box.setDefaultButton(button.Save)
    chosen = box.exec()
    return {button.Save: "save", button.Discard: "discard"}.get(button(chosen), "cancel")  # type: ignore[return-value]


def ask_to_save_first(parent: QWidget, name: str, why: str) -> bool:
    """Whether to save the project now, without which something else cannot be; why: a sentence."""
    box = QMessageBox(QMessageBox.Icon.Question, "Save the project first", f"Save “{name}” first?", parent=parent)
    box.setObjectName("save-first")
    box.setInformativeText(why)
    save = box.addButton("Save the project", QMessageBox.ButtonRole.AcceptRole)
    box.setEscapeButton(box.addButton("Cancel", QMessageBox.ButtonRole.RejectRole))
    box.setDefaultButton(save)
    box.exec()
    return box.clickedButton() is save


def ask_changed_on_disk(parent: QWidget, path: Path) -> Literal["over", "elsewhere", "cancel"]:
    """What to do with a file that another window or program has written since it was opened or saved here."""
    title, question = "Changed on disk", f"Save over “{path.name}”, which was changed since?"
    box = QMessageBox(QMessageBox.Icon.Warning, title, question, parent=parent)
    box.setObjectName("changed-on-disk")
    box.setInformativeText(
        "Another window or program has written the file since it was opened or saved here. Saving over it loses what "
        f"was changed there; Save as… keeps both.\n\n{path}"
    )
    over = box.addButton("Save over it", QMessageBox.ButtonRole.DestructiveRole)
    elsewhere = box.addButton("Save as…", QMessageBox.ButtonRole.AcceptRole)
    box.setEscapeButton(box.addButton("Cancel", QMessageBox.ButtonRole.RejectRole))
    box.setDefaultButton(elsewhere)
    box.exec()
    return "over" if box.clickedButton() is over else "elsewhere" if box.clickedButton() is elsewhere else "cancel"


def ask_under_way(parent: QWidget, what: str) -> bool:
    """Whether to go although a render or an export is under way; what: a sentence about it."""
    return _ask_to_go(parent, "under-way", "Under way", "Stop what is under way?", "Stop it", what)


def ask_loss(parent: QWidget, what: str) -> bool:
    """Whether to close, or open another project, although what took long goes with it; what: sentences about it."""
    return _ask_to_go(parent, "not-kept", "Not kept", "Go on all the same?", "Go on", what)


def ask_removal(parent: QWidget, what: str) -> bool:
    """Whether to take files off the disk; what: sentences about them."""
    return _ask_to_go(parent, "removal", "Kept with the project", "Remove it from the disk?", "Remove", what)


def _ask_to_go(parent: QWidget, name: str, title: str, question: str, go: str, what: str) -> bool:
    """go: the button that goes on; Return and Esc stay."""
    box = QMessageBox(QMessageBox.Icon.Question, title, question, parent=parent)
    box.setObjectName(name)
    box.setInformativeText(what)
    gone = box.addButton(go, QMessageBox.ButtonRole.DestructiveRole)
    stay = box.addButton("Stay", QMessageBox.ButtonRole.RejectRole)
    box.setDefaultButton(stay)
    box.setEscapeButton(stay)
    box.exec()
    return box.clickedButton() is gone


def ask_recovery(parent: QWidget | None, name: str, when: str, count: int) -> Literal["open", "discard", "later"]:
    """What to do with the work that a crash left behind; later: it is offered again at the next start."""
    button = QMessageBox.StandardButton
    box = QMessageBox(QMessageBox.Icon.Question, "Recovery", f"Open the unsaved work on “{name}”?", parent=parent)
    box.setObjectName("recovery")
    others = {1: "", 2: " An older one stays for the next time."}.get(
        count, f" {count - 1} older ones stay for the next time."
    )
    box.setInformativeText(f"The program was cut off; it had kept the work of {when}.{others}")
    opened = box.addButton("Open it", QMessageBox.ButtonRole.AcceptRole)
    thrown = box.addButton("Throw it away", QMessageBox.ButtonRole.DestructiveRole)
    box.setEscapeButton(box.addButton("Later", QMessageBox.ButtonRole.RejectRole))
    box.setDefaultButton(button.NoButton)
    box.exec()
    return "open" if box.clickedButton() is opened else "discard" if box.clickedButton() is thrown else "later"


class TemplateDialog(QDialog):
    """The projects that come with the program; `chosen` after it was accepted."""

    def __init__(self, parent: QWidget | None = None) -> None:
        from studio.project.templates import DESCRIPTIONS

        super().__init__(parent)
        self.setWindowTitle("New from template")
        self.setObjectName("templates")
        self.list = QListWidget()
        self.list.setSpacing(3)
        self.list.setWordWrap(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        for key, text in DESCRIPTIONS.items():
            name = key.replace("_", " ").capitalize()
            item = QListWidgetItem(f"{name}\n{text[0].upper()}{text[1:]}")
            item.setData(Qt.ItemDataRole.UserRole, key)
            self.list.addItem(item)
        self.list.setCurrentRow(0)
        self.list.itemDoubleClicked.connect(lambda _: self.accept())
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Open | QDialogButtonBox.StandardButton.Cancel)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.addWidget(QLabel("Start with a copy of"))
        layout.addWidget(self.list)
        layout.addWidget(buttons)
        self.resize(560, 420)

    @property
    def chosen(self) -> str:
        item = self.list.currentItem()
        return str(item.data(Qt.ItemDataRole.UserRole)) if item is not None else ""


def about(parent: QWidget, version: str) -> None:
    """Name, version and what it is made of."""
    from importlib import metadata

    parts = ("PySide6-Essentials", "pyvista", "vtk", "pyqtgraph", "embreex", "numba", "numpy", "open3d")
    versions = []
    for part in parts:
        try:
            versions.append(f"{part} {metadata.version(part)}")
        except metadata.PackageNotFoundError:
            continue
    box = QMessageBox(QMessageBox.Icon.NoIcon, "About", f"Blazer Studio {version}", parent=parent)
    box.setInformativeText(
        "Simulates line laser scanners: what the camera sees, what is reconstructed, and how wrong it is.\n\n"
        f"Python {sys.version.split()[0]}, " + ", ".join(versions)
    )
    box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    box.open()


def beside_project(session: Session, name: str) -> str:
    """A path to begin a file dialog with: a file called after the project, where such files belong."""
    return str(session.place / f"{session.project.name} {name}".replace("/", "-"))


def choose_file(session: Session, parent: QWidget, title: str, kinds: str) -> Path | None:
    """A file by the desktop's dialog, or None."""
    name, _ = QFileDialog.getOpenFileName(parent, title, str(session.place), kinds)
    if name:
        session.chose(Path(name))
    return Path(name) if name else None


def export_csv(parent: QWidget, session: Session, name: str, what: str, write: Callable[[Path], None]) -> None:
    """Ask where, the project's `name` being proposed, and write there; what: cannot be done, if it cannot."""
    chosen, _ = QFileDialog.getSaveFileName(
        parent, "Export", beside_project(session, f"{name}.csv"), "CSV table (*.csv)"
    )
    if not chosen:
        return
    path = Path(chosen)
    session.chose(path)
    try:
        write(path if path.suffix.lower() == ".csv" else path.with_name(f"{path.name}.csv"))
    except InputError as error:
        show_trouble(parent, trouble(error, f"export {what}"))
