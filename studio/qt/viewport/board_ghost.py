"""The calibration board in the 3D view where it is to be held next, half seen through."""

from __future__ import annotations

from typing import Any

import numpy as np
from PySide6.QtCore import QObject

from render.base.pose import transform_points
from studio.qt.core import theme
from studio.qt.core.session import Session
from studio.qt.viewport.viewport_scene import Lines

OPACITY = 0.6


class BoardGhost(QObject):
    """Follows the session's ghost, and the scene's camera, before which it is."""

    def __init__(self, session: Session, view: Any) -> None:
        super().__init__(view)
        self.session, self.view = session, view
        self._wanted = True
        self.shapes = Lines(opacity=OPACITY)
        self.shapes.actor.PickableOff()
        view.renderer.AddActor(self.shapes.actor)
        for changed in (session.ghost_changed, session.project_changed, session.step_changed):
            changed.connect(self.refresh)
        self.refresh()

    def show(self, wanted: bool) -> None:
        """Or hide it: where points are looked at, it would stand before them."""
        if wanted != self._wanted:
            self._wanted = wanted
            self.refresh()

    def refresh(self) -> None:
        ghost, scene = self.session.ghost, self.session.project.scene
        self.shapes.colour(theme.colours().accent)
        self.shapes.actor.SetVisibility(self._wanted and len(ghost) > 0)
        points = transform_points(scene.T_world_camera(self.session.step), ghost.reshape(-1, 3))
        self.shapes.faces(points, np.arange(len(points)).reshape(ghost.shape[:2]))
        self.view.redraw()
