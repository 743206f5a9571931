"""What keys and the left button of the 3D view do for a while: until it is done, Escape, or the focus goes."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtGui import QKeyEvent

from studio.qt.viewport.view3d import Tool, View3D


class ViewMode(QObject):
    """One at a time: it takes the view's keys, and gives back the tool that was there."""

    told = Signal(str)
    """What to do, or how far it has come; empty when it is over."""

    def __init__(self, view: View3D) -> None:
        super().__init__(view)
        self.view = view
        self.active = False
        self._tool: Tool | None = None
        view.installEventFilter(self)

    def enter(self, hint: str, tool: Tool | None = None, cursor: Qt.CursorShape = Qt.CursorShape.CrossCursor) -> None:
        """tool: which has the left button meanwhile; None: clicks alone count."""
        self.active = True
        self.view.typing, self.view.tool, self._tool = self.type, tool, self.view.tool
        self.view.setCursor(cursor)
        self.told.emit(hint)

    def leave(self) -> None:
        """Keys and button do again what they did."""
        self.active = False
        self.view.typing, self.view.tool = None, self._tool
        self.view.setCursor(Qt.CursorShape.ArrowCursor)
        self.told.emit("")

    def end(self) -> None:
        """Leave it, if it is on, with what has been done so far."""
        raise NotImplementedError

    def cancel(self) -> None:
        """Leave it, as it was before where it has changed something."""
        self.end()

    def type(self, event: QKeyEvent) -> bool:
        """Whether it takes the key."""
        raise NotImplementedError

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Who turns to something else is done."""
        if event.type() == QEvent.Type.FocusOut:
            self.end()
        return super().eventFilter(watched, event)
