"""One gizmo for all that is selected: three arms to move along, three squares to move across, three rings to turn by.

It is made once and retargeted; it stands where the item does that was selected last. A drag is one entry of the undo
history.
"""

from __future__ import annotations

import numpy as np

from render.base.arrays import Float
from render.base.errors import InputError
from studio.editing.targets import Target, carried, targets
from studio.preview.gizmo_geometry import Frame
from studio.qt.core.live_preview import Live
from studio.qt.core.session import Session
from studio.qt.viewport.handle_tool import HandleTool
from studio.qt.viewport.view3d import View3D


class Gizmo(HandleTool):
    """Moves items of the scene."""

    def __init__(self, session: Session, live: Live, view: View3D) -> None:
        super().__init__(view)
        self.session, self._live = session, live
        self.local = False
        """Along the item's own axes instead of the world's."""
        self.away = False
        """Not shown, while something else is done with what is selected."""
        self.targets: tuple[Target, ...] = ()
        self._before: tuple[Target, ...] = ()
        self._selections = session.selections
        self._count = 0
        session.selection_changed.connect(self.retarget)
        live.changed.connect(self.retarget)
        self.retarget()

    def retarget(self) -> None:
        """Stand at what is selected, wherever it is now."""
        if self.dragging and self.session.selections != self._selections:
            self.cancel()
        self.targets = targets(self.session.project, self.session.selections, self._live.step)
        self.hide(self.target is None)
        self.view.redraw()

    @property
    def target(self) -> Target | None:
        """Where it stands."""
        return self.targets[-1] if self.targets else None

    def frame(self) -> Frame | None:
        if self.target is None or self.away or self.session.section is not None:
            return None  # two sets of handles would lie over each other
        T = self.target.T_world_item
        return self.standing(T[:3, 3], T[:3, :3].copy() if self.local else np.eye(3))

    def set_local(self, local: bool) -> None:
        self.local = local
        self.view.redraw()

    def begin(self) -> None:
        self._before, self._selections = self.targets, self.session.selections
        self._count += 1
        self.session.begin_drag()

    def follow(self, motion: Float, turns: bool) -> None:
        before, session = self._before, self.session
        what = before[-1].name if len(before) == 1 else f"{len(before)} items"
        try:
            project = carried(session.project, before, motion, turns)
        except InputError as error:
            session.message.emit("error", str(error))
            return
        label = f"{'turn' if turns else 'move'} {what}"
        session.document.apply(label, project, merge=f"gizmo {id(self)} {self._count}")

    def end(self) -> None:
        self.session.end_drag()

    def put_back(self) -> None:
        now = targets(self.session.project, self._selections, self._live.step)
        if [one.pose for one in now] != [one.pose for one in self._before]:
            self.session.document.undo()
