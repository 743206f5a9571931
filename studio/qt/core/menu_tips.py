"""Tips of a menu's entries, which go when the menu does."""

from __future__ import annotations

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QMenu, QToolTip


class MenuTips(QObject):
    """Qt's own stay over what is below for ten seconds, or come when the menu is no longer there."""

    def __init__(self, menu: QMenu) -> None:
        super().__init__(menu)
        self.menu = menu
        menu.aboutToShow.connect(self._allow)
        menu.aboutToHide.connect(self._end)

    def _allow(self) -> None:
        self.menu.setToolTipsVisible(True)

    def _end(self) -> None:
        self.menu.setToolTipsVisible(False)
        QToolTip.hideText()


def show_tips(menu: QMenu) -> None:
    """The tips of a menu's entries are shown, however often this is asked for."""
    menu.setToolTipsVisible(True)
    if menu.findChild(MenuTips) is None:
        MenuTips(menu)
