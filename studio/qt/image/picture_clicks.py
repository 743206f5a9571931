"""A click into the camera's picture, told as the pixel of the scene's camera that it is on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Qt

from studio.qt.core.session import Session
from studio.qt.image.image_item import PictureView


class PictureClicks(QObject):
    """Who waits for a place of the scene, as aiming a laser does, follows the session."""

    def __init__(self, session: Session, view: PictureView, current: Callable[[], bool]) -> None:
        """current: whether the picture is of the scene as it is now."""
        super().__init__(view)
        self.session, self.view, self.current = session, view, current
        view.scene().sigMouseClicked.connect(self._tell)

    def _tell(self, event: Any) -> None:
        if event.button() != Qt.MouseButton.LeftButton:
            return
        where, (width, height) = self.view.box.mapSceneToView(event.scenePos()), self.view.item.size
        camera = self.session.project.scene.camera
        u, v = (where.x() + 0.5) / width, (where.y() + 0.5) / height
        if 0.0 <= u <= 1.0 and 0.0 <= v <= 1.0:
            self.session.pixel_clicked.emit(u * camera.width - 0.5, v * camera.height - 0.5, self.current())
