"""The slim bar over the 3D view: standard views, what is shown, the gizmo's axes and steps, and what a drag says."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QFormLayout,
    QHBoxLayout,
    QMenu,
    QToolButton,
    QWidget,
    QWidgetAction,
)

from studio.editing.units import Unit
from studio.project.document import FieldPath
from studio.qt.core.widgets import ElidedLabel
from studio.qt.forms.fields import tool_button
from studio.qt.forms.unit_box import UnitBox

if TYPE_CHECKING:
    from studio.qt.viewport.viewport import Viewport

VIEWS = (("front", "Front", "1"), ("left", "Left", "2"), ("top", "Top", "3"), ("iso", "From above", "4"))
PARTS = (
    ("sheets", "Light sheets"),
    ("frustum", "Camera frustum"),
    ("volume", "Working volume"),
    ("grid", "Ground grid"),
)


class ViewportBar(QWidget):
    """Buttons that call the viewport, and a line of text that it fills."""

    def __init__(self, viewport: Viewport) -> None:
        super().__init__(viewport)
        self._viewport = viewport
        layout = self._layout = QHBoxLayout(self)
        layout.setContentsMargins(6, 3, 8, 3)
        layout.setSpacing(2)
        views = QMenu(self)
        for name, text, key in VIEWS:
            self._add(views, text, key, lambda name=name: viewport.look_along(name))
        views.addSeparator()
        self._add(views, "Through the camera", "C", lambda: viewport.look_through(("scene", "rig", "camera")))
        self._add(views, "Through the laser", "L", viewport.look_through_laser)
        views.addSeparator()
        self._add(views, "Selection", "F", lambda: viewport.frame(viewport.session.selection))
        self._add(views, "Everything", "A", viewport.frame)
        views.addSeparator()
        self._add(views, "Parallel or perspective", "5", lambda: viewport.set_parallel(not viewport.view.eye.parallel))
        self._button("View", "Standard views, and what to look through", views)
        shown = QMenu(self)
        for part, text in PARTS:
            action = shown.addAction(text)
            action.setCheckable(True)
            action.setChecked(True)
            action.toggled.connect(lambda on, part=part: viewport.show_part(part, on))
        self._button("Show", "What is drawn besides the objects", shown)
        self._button("Snap", "Steps of a drag while Ctrl is held", self._snap_menu())
        self._axes = self._toggle("World axes", "The gizmo moves along the world's axes, or the item's own (X)")
        self._axes.clicked.connect(viewport.set_local)
        self.aim = self._toggle("Aim", "The next click says what the selected laser, else the first, is to light (T)")
        self.aim.toggled.connect(viewport.begin_aim)
        self._text, self._grid = ElidedLabel(), ElidedLabel()
        self._grid.setObjectName("muted")
        layout.addStretch(1)
        layout.addWidget(self._text)
        layout.addSpacing(10)
        layout.addWidget(self._grid)
        self._spacing, self._loading, self._through = "", False, ""

    def tell(self, text: str) -> None:
        """How far a drag has come."""
        self._text.setText(text or self._through)

    def tell_local(self, local: bool) -> None:
        self._axes.setChecked(local)
        self._axes.setText("Own axes" if local else "World axes")

    def tell_loading(self, loading: bool) -> None:
        self._loading = loading
        self._tell_right()

    def tell_spacing(self, metres: float) -> None:
        """Of the ground grid."""
        self._spacing = f"grid {Unit.of('m').with_unit(metres)}" if metres else ""
        self._tell_right()

    def tell_through(self, path: FieldPath) -> None:
        self._through = "" if not path else "through the camera" if path[-1] == "camera" else "through the laser"
        self._text.setText(self._through)

    def _tell_right(self) -> None:
        self._grid.setText("loading meshes…" if self._loading else self._spacing)

    def _add(self, menu: QMenu, text: str, key: str, handler: object) -> None:
        # the key itself belongs to the viewport; here it is only named
        action = QAction(f"{text}\t{key}", menu)
        action.triggered.connect(lambda _checked=False: handler())  # type: ignore[operator]
        menu.addAction(action)

    def _toggle(self, text: str, tip: str) -> QToolButton:
        button = tool_button(text, tip)
        button.setCheckable(True)
        self._layout.addWidget(button)
        return button

    def _button(self, text: str, tip: str, menu: QMenu) -> None:
        button = tool_button(text, tip)
        button.setMenu(menu)
        button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
        self._layout.addWidget(button)

    def _snap_menu(self) -> QMenu:
        gizmo = self._viewport.gizmo
        menu, inner = QMenu(self), QWidget()
        form = QFormLayout(inner)
        move, turn = UnitBox(Unit.named("mm"), 0.01, 1000.0, 2), UnitBox(Unit.named("°"), 0.01, 90.0, 2)
        move.setValue(1e3 * gizmo.move_step)
        turn.setValue(math.degrees(gizmo.turn_step))
        for box in (move, turn):
            box.refused.connect(partial(gizmo.session.message.emit, "warning"))
        move.valueChanged.connect(lambda value: setattr(gizmo, "move_step", 1e-3 * value))
        turn.valueChanged.connect(lambda value: setattr(gizmo, "turn_step", math.radians(value)))
        form.addRow("Move with Ctrl", move)
        form.addRow("Turn with Ctrl", turn)
        action = QWidgetAction(menu)
        action.setDefaultWidget(inner)
        menu.addAction(action)
        menu.addSeparator()
        self._add(menu, "Put a corner or face on another", "V", self._viewport.snap.begin)
        return menu
