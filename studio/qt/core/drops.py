"""Files dragged onto the window are copied from, never moved: a source that is told "moved" deletes its own."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QDropEvent

COPY = Qt.DropAction.CopyAction


def dragged_files(event: QDropEvent) -> list[Path]:
    """What a drag offers of this machine's files and folders; none where it does not let them be copied."""
    if not event.possibleActions() & COPY:
        return []
    return [Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()]


def accept_copy(event: QDropEvent) -> None:
    """Take what is dragged, as a copy, whatever the source or a key proposes."""
    event.setDropAction(COPY)
    event.accept()
