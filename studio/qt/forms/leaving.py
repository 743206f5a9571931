"""What is being typed counts as entered, whenever something else is done."""

from __future__ import annotations

from PySide6.QtWidgets import QApplication

from studio.qt.forms.fields import TextField
from studio.qt.forms.unit_box import UnitBox


def leave_typing() -> None:
    """What is being typed anywhere counts from now on, as if its field had been left."""
    field = QApplication.focusWidget()
    if isinstance(field, TextField | UnitBox):
        field.leave()
