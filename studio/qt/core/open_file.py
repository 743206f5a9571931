"""A file in the program that the desktop has for it."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QUrl
from PySide6.QtGui import QDesktopServices

from studio.qt.core.session import Session


def open_file(session: Session, path: Path) -> None:
    """Where no program takes it, it is said where it is."""
    if not QDesktopServices.openUrl(QUrl.fromLocalFile(str(path))):
        session.message.emit("warning", f"This desktop has no program that opens {path}: open it by hand")
