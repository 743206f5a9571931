"""What a person does in the 3D view, at fractions of a pixel."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication

from studio.qt.viewport.viewport import Viewport


def pixel(viewport: Viewport, point: np.ndarray) -> QPointF:
    x, y = viewport.view.eye.project(point, viewport.view.pixels)[0]
    return QPointF(x, y)


def mouse(viewport: Viewport, kind: str, at: QPointF, modifier: Qt.KeyboardModifier) -> None:
    """A mouse event at a fraction of a pixel, through the event queue."""
    types = {
        "press": QMouseEvent.Type.MouseButtonPress,
        "move": QMouseEvent.Type.MouseMove,
        "release": QMouseEvent.Type.MouseButtonRelease,
    }
    left, none = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton
    button = none if kind == "move" else left
    held = none if kind == "release" else left
    event = QMouseEvent(types[kind], at, viewport.view.mapToGlobal(at), button, held, modifier)
    QApplication.sendEvent(viewport.view, event)


def drag(viewport: Viewport, start: QPointF, end: QPointF, modifier: Qt.KeyboardModifier | None = None) -> None:
    modifier = modifier or Qt.KeyboardModifier.NoModifier
    mouse(viewport, "press", start, modifier)
    for share in (0.25, 0.5, 0.75, 1.0):
        mouse(viewport, "move", start + (end - start) * share, modifier)
        QApplication.processEvents()
    mouse(viewport, "release", end, modifier)
