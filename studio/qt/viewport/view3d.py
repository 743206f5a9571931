"""The window of the 3D view: turns, shifts and zooms its eye with the mouse, and paints once for each change.

The mouse goes to the view's own handlers, never to VTK's interactor, which would draw every event twice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from PySide6.QtCore import QEvent, QPointF, Qt, Signal
from PySide6.QtGui import QCloseEvent, QEnterEvent, QKeyEvent, QMouseEvent, QWheelEvent
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QPlainTextEdit,
    QTextEdit,
    QWidget,
)
from pyvistaqt import QtInteractor
from vtkmodules.vtkRenderingCore import vtkRenderer

from studio.preview.view_camera import ANGLE, Eye

DEGREES_PER_PIXEL = 0.4
ZOOM_PER_NOTCH = 1.15
NOTCH = 120.0


class Tool(Protocol):
    """Something in the view that the left button may get hold of."""

    def press(self, x: float, y: float) -> bool:
        """The mouse is on it, and it follows the mouse from now on."""

    def drag(self, x: float, y: float, snap: bool) -> None: ...

    def release(self) -> None: ...

    def cancel(self) -> None:
        """Put back what was dragged."""

    def hover(self, x: float, y: float) -> bool:
        """The mouse is over it."""


class View3D(QtInteractor):  # type: ignore[misc]
    """A renderer for the scene and one before it for handles, both seen from `eye`."""

    clicked = Signal(float, float)
    double_clicked = Signal(float, float)
    hovered = Signal(float, float)
    """The mouse rests over the scene, or moves without a button."""
    left = Signal()
    navigated = Signal()
    """A person turned, shifted or zoomed."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent, multi_samples=0, auto_update=False)
        self.setAcceptDrops(False)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMinimumSize(160, 80)
        self.eye = Eye.standing(np.zeros(3), 1.0, -60.0, 30.0)
        self.tool: Tool | None = None
        self.before_paint: Callable[[], None] = lambda: None
        self.takes_click: Callable[[float, float], bool] = lambda x, y: False
        """Whether something drawn over the scene is clicked, which the scene then does not hear of."""
        self.typing: Callable[[QKeyEvent], bool] | None = None
        """What takes the keys while something is moved by them; it says whether it wants this one."""
        self.paints = 0
        """How often the view has been drawn."""
        self.front = vtkRenderer()
        self.front.SetLayer(1)
        self.front.InteractiveOff()
        self.front.SetActiveCamera(self.renderer.GetActiveCamera())
        self.ren_win.SetNumberOfLayers(2)
        self.ren_win.AddRenderer(self.front)
        self._grip = ""
        self._last = QPointF()
        self._start = QPointF()

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height, in the pixels that mouse events count."""
        return max(self.width(), 1), max(self.height(), 1)

    def look_from(self, eye: Eye) -> None:
        """Move the eye; the view is drawn anew soon."""
        self.eye = eye
        self.redraw()

    def redraw(self) -> None:
        """Draw soon, once, however often this is called."""
        self.update()

    def render(self, *_args: Any, **_kwargs: Any) -> None:
        """PyVista's own calls draw no sooner either."""
        self.update()

    def paintGL(self) -> None:
        if self._closed or self._RenderWindow is None:
            return
        self.paints += 1
        self.aim()
        self.before_paint()
        super().paintGL()

    def aim(self) -> None:
        """Give the eye to VTK, which picks and draws with its own camera."""
        eye, camera = self.eye, self.renderer.GetActiveCamera()
        camera.SetPosition(*eye.position)
        camera.SetFocalPoint(*eye.centre)
        camera.SetViewUp(*eye.rotation[:, 1])
        camera.SetViewAngle(eye.angle)
        camera.SetParallelProjection(eye.parallel)
        camera.SetParallelScale(eye.half_height)
        self.renderer.ResetCameraClippingRange()
        near, far = camera.GetClippingRange()
        # the handles stand at the centre of things, but may be larger than these
        camera.SetClippingRange(min(near, 0.2 * eye.distance), max(far, 3.0 * eye.distance))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if self._grip:
            return
        at, button = event.position(), event.button()
        self._start = self._last = at
        shift = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        if button == Qt.MouseButton.LeftButton and not shift:
            held = self.tool is not None and self.tool.press(at.x(), at.y())
            self._grip = "tool" if held else "click"
        elif button in (Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton, Qt.MouseButton.RightButton):
            self._grip = "pan"

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        at = event.position()
        step = at - self._last
        self._last = at
        if self._grip == "tool" and self.tool is not None:
            self.tool.drag(at.x(), at.y(), bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier))
        elif self._grip == "click":
            if (at - self._start).manhattanLength() >= QApplication.startDragDistance():
                self._grip = "orbit"
                self._navigate(self._plain().orbit(*_turn(at - self._start)))
        elif self._grip == "orbit":
            self._navigate(self.eye.orbit(*_turn(step)))
        elif self._grip == "pan":
            self._navigate(self.eye.pan(step.x(), step.y(), self.pixels))
        else:
            over = self.tool is not None and self.tool.hover(at.x(), at.y())
            if not over:
                self.hovered.emit(at.x(), at.y())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.buttons() & (Qt.MouseButton.LeftButton | Qt.MouseButton.MiddleButton | Qt.MouseButton.RightButton):
            return
        grip, self._grip = self._grip, ""
        far = (event.position() - self._start).manhattanLength() >= QApplication.startDragDistance()
        if grip == "tool" and self.tool is not None:
            if not far and event.modifiers() & Qt.KeyboardModifier.ControlModifier:
                # what is to be selected as well may lie behind a handle
                self.tool.cancel()
                self.clicked.emit(event.position().x(), event.position().y())
            else:
                self.tool.release()
        elif grip == "click":
            x, y = event.position().x(), event.position().y()
            # without a tool the next click is another's: that of what the laser is to light
            if self.tool is None or not self.takes_click(x, y):
                self.clicked.emit(x, y)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.double_clicked.emit(event.position().x(), event.position().y())

    def wheelEvent(self, event: QWheelEvent) -> None:
        notches = event.angleDelta().y() / NOTCH
        at = event.position()
        self._navigate(self._plain().zoom(ZOOM_PER_NOTCH**notches, at.x(), at.y(), self.pixels))
        event.accept()

    def enterEvent(self, event: QEnterEvent) -> None:
        # its keys are for what the mouse is over, as in Blender, but in what is being typed they are letters
        if not _takes_text(self.window().focusWidget()):
            self.setFocus(Qt.FocusReason.MouseFocusReason)
        event.accept()

    def leaveEvent(self, event: Any) -> None:
        if self.tool is not None and not self._grip:
            self.tool.hover(-1.0, -1.0)
        self.left.emit()

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ShortcutOverride and self.typing is not None:
            assert isinstance(event, QKeyEvent)
            if self.typing(event):
                event.accept()
                return True
        # while something is held Escape lets go of it, whatever it means to the window
        if event.type() == QEvent.Type.ShortcutOverride and self._grip == "tool":
            assert isinstance(event, QKeyEvent)
            if event.key() == Qt.Key.Key_Escape:
                event.accept()
                return True
        return bool(super().event(event))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if self.typing is not None and self.typing(event):
            return
        if event.key() == Qt.Key.Key_Escape and self._grip == "tool" and self.tool is not None:
            self.tool.cancel()
            return
        # VTK's own keys would quit, show wires, and more
        event.ignore()

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        event.ignore()

    def closeEvent(self, event: QCloseEvent) -> None:
        self.before_paint = lambda: None
        self.takes_click = lambda x, y: False
        self.tool = self.typing = None
        super().closeEvent(event)

    def let_go(self) -> None:
        """Forget the button that is held."""
        self._grip = ""

    def _navigate(self, eye: Eye) -> None:
        self.look_from(eye)
        self.navigated.emit()

    def _plain(self) -> Eye:
        """With the usual angle of view: that of a camera which was looked through is left when one moves on."""
        eye = self.eye
        if eye.angle == ANGLE:
            return eye
        factor = np.tan(np.radians(eye.angle / 2)) / np.tan(np.radians(ANGLE / 2))
        return replace(eye, distance=eye.distance * float(factor), angle=ANGLE)


def _takes_text(widget: QWidget | None) -> bool:
    typed = isinstance(widget, QLineEdit | QAbstractSpinBox | QTextEdit | QPlainTextEdit) and not widget.isReadOnly()
    return typed or (isinstance(widget, QComboBox) and widget.isEditable())


def _turn(step: QPointF) -> tuple[float, float]:
    return step.x() * DEGREES_PER_PIXEL, step.y() * DEGREES_PER_PIXEL
