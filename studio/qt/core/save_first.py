"""What needs a file of the project, of one that is in none as it is: a person is asked to save it first."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QWidget

from studio.qt.core.dialogs import ask_to_save_first
from studio.qt.core.session import Session


def saved_first(session: Session, parent: QWidget, why: str, saved: Callable[[], bool]) -> bool:
    """Whether the project is saved as is needed, once a person was asked where it is not; why: a sentence."""
    if saved():
        return True
    if not ask_to_save_first(parent.window(), session.project.name, why):
        return False
    session.save_asked.emit()
    return saved()  # or nobody said where
