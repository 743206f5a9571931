"""One gizmo for what is selected: three arms to move along, three squares to move across, three rings to turn about.

It is made once and retargeted. A drag is one entry of the undo history.
"""

from __future__ import annotations

import numpy as np

from render.base.arrays import Float
from studio.editing.targets import Target, target
from studio.preview.gizmo_geometry import Frame
from studio.qt.core.live_preview import Live
from studio.qt.core.session import Session
from studio.qt.viewport.handle_tool import HandleTool
from studio.qt.viewport.view3d import View3D


class Gizmo(HandleTool):
    """Moves an item of the scene."""

    def __init__(self, session: Session, live: Live, view: View3D) -> None:
        super().__init__(view)
        self.session, self._live = session, live
        self.local = False
        """Along the item's own axes instead of the world's."""
        self.target: Target | None = None
        self._before: Target | None = None
        self._selection = session.selection
        self._count = 0
        session.selection_changed.connect(self.retarget)
        live.changed.connect(self.retarget)
        self.retarget()

    def retarget(self) -> None:
        """Stand at what is selected, wherever it is now."""
        if self.dragging and self.session.selection != self._selection:
            self.cancel()
        self.target = target(self.session.project, self.session.selection, self._live.step)
        self.hide(self.target is None)
        self.view.redraw()

    def frame(self) -> Frame | None:
        if self.target is None or self.session.section is not None:
            return None  # two sets of handles would lie over each other
        T = self.target.T_world_item
        return self.standing(T[:3, 3], T[:3, :3].copy() if self.local else np.eye(3))

    def set_local(self, local: bool) -> None:
        self.local = local
        self.view.redraw()

    def begin(self) -> None:
        self._before, self._selection = self.target, self.session.selection
        self._count += 1
        self.session.begin_drag()

    def follow(self, motion: Float, turns: bool) -> None:
        before = self._before
        assert before is not None
        pose = before.turned(motion) if turns else before.moved(motion)
        if turns and np.array_equal(motion, np.eye(4)):
            pose = before.pose
        verb = "turn" if turns else "move"
        self.session.set(before.path, pose, f"{verb} {before.name}", merge=f"gizmo {id(self)} {self._count}")

    def end(self) -> None:
        self.session.end_drag()

    def put_back(self) -> None:
        before = self._before
        moved = target(self.session.project, self._selection, self._live.step)
        if before is not None and moved is not None and moved.pose != before.pose:
            self.session.document.undo()
