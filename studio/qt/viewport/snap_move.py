"""V: what is selected is taken by a corner or a face, and put on those of something else, or on the ground."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent

from render.base.arrays import Float
from studio.preview.ray_pick import Spot, spot_at
from studio.qt.core import theme
from studio.qt.core.live_preview import Live
from studio.qt.viewport.gizmo import Gizmo
from studio.qt.viewport.view3d import View3D
from studio.qt.viewport.view_mode import ViewMode
from studio.qt.viewport.viewport_scene import LINE_PX, Lines, object_path

MARK_PX = 7.0
GROUND = 0.0
"""m, the height of the grid."""
TAKE = "click a corner or a face of what is selected; Esc: back"
PUT = "click where it goes: a corner, a face, or the ground; Esc: back"
WORDS = {"corner": "this corner", "surface": "this face", "ground": "the ground"}


class SnapMove(ViewMode):
    """Two clicks, of which the second moves by the way between them: one step to undo."""

    def __init__(self, gizmo: Gizmo, live: Live, view: View3D) -> None:
        super().__init__(view)
        self.gizmo = gizmo
        self._live = live
        self._taken: Float | None = None
        """(3,) m, of what is selected, where it was taken."""
        self._mark = Lines(2.0 * LINE_PX)
        self._mark.actor.PickableOff()
        view.front.AddActor(self._mark.actor)
        view.hovered.connect(self._show)
        gizmo.session.selection_changed.connect(self.end)
        gizmo.session.document_replaced.connect(self.end)

    def begin(self) -> None:
        """Of what is selected; what has no surface is taken by its origin at once."""
        session = self.gizmo.session
        if self.active or session.dragging:
            self.end()
            return
        target = self.gizmo.target
        if target is None:
            session.message.emit("info", "nothing that can be moved is selected; click on it")
            return
        self.gizmo.away = True  # its handles would lie over the corners
        self._taken = None if self._own_meshes() else target.T_world_item[:3, 3].copy()
        self.enter(TAKE if self._taken is None else PUT)

    def click(self, x: float, y: float) -> None:
        """Take it there, or put it there."""
        spot = self._spot(x, y)
        if spot is None:
            what = "what is selected" if self._taken is None else "something else"
            self.gizmo.session.message.emit("error", f"that is no place of {what}")
        elif self._taken is None:
            self._taken = spot.point
            self._draw(None)
            self.told.emit(PUT)
        else:
            motion = np.eye(4)
            motion[:3, 3] = spot.point - self._taken
            self.end()
            self.gizmo.begin()
            self.gizmo.follow(motion, turns=False)
            self.gizmo.end()

    def end(self) -> None:
        """It stays where it is."""
        if self.active:
            self.gizmo.away = False
            self.leave()
            self._draw(None)

    def type(self, event: QKeyEvent) -> bool:
        """Escape is taken; any other key keeps its meaning, but for those that would move it otherwise."""
        if Qt.Key(event.key()) == Qt.Key.Key_Escape:
            if event.type() == QEvent.Type.KeyPress:
                self.end()
            return True
        if Qt.Key(event.key()) in (Qt.Key.Key_B, Qt.Key.Key_G, Qt.Key.Key_R, Qt.Key.Key_T):
            self.end()
        return False

    def _spot(self, x: float, y: float) -> Spot | None:
        """Of what is selected, or of all else."""
        own, takes = self._own_meshes(), self._taken is None
        ground = None if takes else GROUND
        pixels = self.view.pixels
        return spot_at(self._live.look, self.view.eye, (x, y), pixels, lambda index: (index in own) == takes, ground)

    def _own_meshes(self) -> set[int]:
        """By their index among the visible objects."""
        look, moved = self._live.look, {one.path[:-1] for one in self.gizmo.targets}
        return {item.index for item in look.placed if object_path(look, item.index) in moved}

    def _show(self, x: float, y: float) -> None:
        """Mark what a click would take or meet."""
        if self.active:
            spot = self._spot(x, y)
            self._draw(spot)
            hint = TAKE if self._taken is None else PUT
            self.told.emit(hint if spot is None else f"{'from' if self._taken is None else 'to'} {WORDS[spot.kind]}")

    def _draw(self, spot: Spot | None) -> None:
        ends = np.zeros((0, 3))
        if spot is not None:
            arm = MARK_PX * self.view.eye.metres_per_pixel(spot.point, self.view.pixels)
            right, up = self.view.eye.rotation[:, 0], self.view.eye.rotation[:, 1]
            # a cross on a face, a square about a corner
            turned = [right + up, up - right, -right - up, right - up]
            ends = spot.point + arm * np.array(turned if spot.kind == "corner" else [right, up, -right, -up])
        is_corner = spot is not None and spot.kind == "corner"
        pairs = [(0, 1), (1, 2), (2, 3), (3, 0)] if is_corner else [(0, 2), (1, 3)]
        self._mark.lines(ends, pairs if len(ends) else [])
        self._mark.colour(theme.colours().accent)
        self.view.redraw()
