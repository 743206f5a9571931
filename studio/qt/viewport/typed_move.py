"""G and R: what is selected follows the mouse, or a typed number, along or about an axis, until Return or a click."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QCursor, QKeyEvent

from render.base.arrays import Float
from render.base.errors import InputError
from studio.editing.units import Unit
from studio.preview.gizmo_geometry import Drag, Frame, Handle, Kind, turned_about
from studio.qt.viewport.gizmo import Gizmo
from studio.qt.viewport.view3d import View3D
from studio.qt.viewport.view_mode import ViewMode

AXES = {Qt.Key.Key_X: 0, Qt.Key.Key_Y: 1, Qt.Key.Key_Z: 2}
COMMANDS = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier | Qt.KeyboardModifier.MetaModifier
NUMBER = "0123456789.,+-*/()"
HINT = "X, Y, Z: the axis, twice for the part's own; a number; Return or a click: done; Esc: back"


class TypedMove(ViewMode):
    """One move or turn at a time, by what the gizmo moves, and one step to undo."""

    def __init__(self, gizmo: Gizmo, view: View3D) -> None:
        super().__init__(view)
        self.gizmo = gizmo
        self.turns = False
        self.axis: int | None = None
        self.own = False
        """Along the axes of the item in place of the world's."""
        self.text = ""
        """The number as far as it is typed, in the unit that lengths are shown in, or degrees."""
        self._at: Frame | None = None
        """Where the item stood; the world's axes. None: nothing is being moved."""
        self._own_axes = np.eye(3)
        self._drag: Drag | None = None
        view.hovered.connect(self._follow_mouse)
        gizmo.session.selection_changed.connect(self.cancel)
        gizmo.session.document_replaced.connect(self.end)

    def begin(self, turns: bool) -> None:
        """Of what is selected; while one goes on, the other kind takes its place."""
        self.cancel()
        target, session = self.gizmo.target, self.gizmo.session
        if target is None:
            session.message.emit("info", "nothing that can be moved is selected; click on it")
            return
        if session.dragging:
            return
        T = target.T_world_item
        pixel = self.view.eye.metres_per_pixel(T[:3, 3], self.view.pixels)
        self.turns, self.axis, self.own, self.text = turns, None, False, ""
        self._at, self._own_axes = Frame(T[:3, 3].copy(), np.eye(3), pixel), T[:3, :3].copy()
        self.gizmo.begin()
        self._begin_drag()
        # without a tool, as the click that ends it may be on a handle
        self.enter(HINT, cursor=Qt.CursorShape.ArrowCursor)

    def end(self) -> None:
        """It stays where it is."""
        if self.active:
            self._at = self._drag = None
            self.leave()
            self.gizmo.end()

    def cancel(self) -> None:
        """As it was before."""
        if self.active:
            self.end()
            self.gizmo.put_back()

    def type(self, event: QKeyEvent) -> bool:
        """Take a key: every plain one, so that none does something else meanwhile; a command ends it."""
        key, text = Qt.Key(event.key()), event.text()
        if text and event.modifiers() & COMMANDS:
            self.end()
            return False
        if event.type() == QEvent.Type.ShortcutOverride:
            return bool(text) or key == Qt.Key.Key_Escape
        if key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.end()
        elif key == Qt.Key.Key_Escape:
            self.cancel()
        elif key in AXES:
            self.own = not self.own if self.axis == AXES[key] else False
            self.axis = AXES[key]
            self._begin_drag()
            self._move()
        elif key == Qt.Key.Key_Backspace:
            self.text = self.text[:-1]
            self._move()
        elif text and text in NUMBER:
            self.text += text
            self.axis = 0 if self.axis is None else self.axis
            self._move()
        elif key in (Qt.Key.Key_G, Qt.Key.Key_R):
            self.begin(key == Qt.Key.Key_R)
        return bool(text)

    def _frame(self) -> Frame:
        """The axes that it goes along: the view's while none is chosen."""
        assert self._at is not None
        axes = self.view.eye.rotation if self.axis is None else self._own_axes if self.own else np.eye(3)
        return Frame(self._at.centre, axes, self._at.pixel)

    def _begin_drag(self) -> None:
        """From where the mouse is now."""
        kind: Kind = "ring" if self.turns else "plane" if self.axis is None else "axis"
        at = QPointF(self.view.mapFromGlobal(QCursor.pos()))
        ray = self.view.eye.ray(at.x(), at.y(), self.view.pixels)
        self._drag = Drag(self._frame(), Handle(kind, 2 if self.axis is None else self.axis), *ray)

    def _follow_mouse(self, x: float, y: float) -> None:
        if self._drag is not None and not self.text:
            motion = self._drag.to(*self.view.eye.ray(x, y, self.view.pixels))
            if motion is not None:
                self._apply(motion, self._drag.angle)

    def _move(self) -> None:
        """By the number, if there is one."""
        if not self.text:
            self._apply(np.eye(4), 0.0)
            return
        unit = Unit.of("rad" if self.turns else "m")
        try:
            amount = unit.parse(self.text)
        except InputError:
            self.told.emit(f"{self._words()} {self.text}…")
            return
        frame, axis = self._frame(), self.axis or 0
        if self.turns:
            self._apply(turned_about(frame, axis, amount), amount)
        else:
            motion = np.eye(4)
            motion[:3, 3] = amount * frame.axes[:, axis]
            self._apply(motion, 0.0)

    def _apply(self, motion: Float, angle: float) -> None:
        self.gizmo.follow(motion, self.turns)
        frame = self._frame()
        if self.turns:
            far = f"{math.degrees(angle):+.4g}°"
        elif self.axis is None:
            far = f"{1e3 * np.linalg.norm(motion[:3, 3]):.2f} mm"
        else:
            far = f"{1e3 * motion[:3, 3] @ frame.axes[:, self.axis]:+.6g} mm"
        typed = f" ({self.text})" if self.text else ""
        self.told.emit(f"{self._words()} {far}{typed}")

    def _words(self) -> str:
        verb = "turn about" if self.turns else "move along"
        if self.axis is None:
            return "turn" if self.turns else "move"
        return f"{verb} {'its own ' if self.own else ''}{'xyz'[self.axis]}"
