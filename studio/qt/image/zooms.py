"""How large a picture is shown: two buttons, one with the other in its menu where there is little room, and a menu."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QCursor
from PySide6.QtWidgets import QHBoxLayout, QMenu, QToolButton, QWidget

from studio.qt.image.image_item import PictureView


class Zooms(QWidget):
    """Of one view, whose picture has the same by a right click."""

    def __init__(self, view: PictureView) -> None:
        super().__init__()
        self.menu = QMenu(self)
        self.buttons: list[QToolButton] = []
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        fit = "Fit", "The whole image (F in it)", view.fit
        one_to_one = "1:1", "One screen pixel a pixel", view.one_to_one
        for text, tip, act in (fit, one_to_one):
            action = QAction(text, self)
            action.setToolTip(tip)
            action.triggered.connect(lambda _checked, act=act: act())
            self.menu.addAction(action)
            button = QToolButton()
            button.setDefaultAction(action)
            self.buttons.append(button)
            row.addWidget(button)
        self.more = QToolButton()
        self.more.setText("Fit")
        self.more.setToolTip("The whole image (F in it); 1:1 by the arrow, or by a right click into the picture")
        self.more.setMenu(self.menu)
        self.more.setPopupMode(QToolButton.ToolButtonPopupMode.MenuButtonPopup)
        self.more.clicked.connect(view.fit)
        row.addWidget(self.more)
        self.setMinimumWidth(self.more.sizeHint().width())  # two buttons must not widen a window that has no room
        self.spread(True)
        view.scene().sigMouseClicked.connect(self._open)

    def spread(self, wide: bool) -> None:
        """wide: a button for each."""
        for button in self.buttons:
            button.setVisible(wide)
        self.more.setVisible(not wide)

    def _open(self, event: Any) -> None:
        if event.button() == Qt.MouseButton.RightButton:
            self.menu.popup(QCursor.pos())
