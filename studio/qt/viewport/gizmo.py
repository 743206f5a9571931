"""One gizmo for what is selected: three arms to move along, three squares to move across, three rings to turn about.

It is made once and retargeted. A drag is one entry of the undo history.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from PySide6.QtCore import QObject, Signal

from render.base.arrays import Float
from studio.editing.targets import Target, target
from studio.preview import gizmo_geometry
from studio.preview.gizmo_geometry import HANDLES, Drag, Frame, Handle
from studio.qt.core.live_preview import Live
from studio.qt.core.session import Session
from studio.qt.viewport.view3d import View3D
from studio.qt.viewport.viewport_scene import Lines

COLOURS = ("#e5534b", "#4aa851", "#3f86e8")
"""Of the axes x, y, z, as everywhere in 3D programs."""
HELD = "#ffcc33"
NEAREST = 1e-3
"""Of the distance to what is looked at: nearer to the eye there is no gizmo. Drawn at no size it ends the program."""
TIP_PX, TIP_RADIUS_PX, TIP_SIDES = 15.0, 5.5, 12


class Gizmo(QObject):
    """A `studio.qt.viewport.view3d.Tool`."""

    told = Signal(str)
    """How far the drag has come, in words; empty when it is over."""

    def __init__(self, session: Session, live: Live, view: View3D) -> None:
        super().__init__(view)
        self.session, self.view, self._live = session, view, live
        self.local = False
        """Along the item's own axes instead of the world's."""
        self.move_step, self.turn_step = 1e-3, math.radians(5.0)
        """m, rad; what a drag with Ctrl snaps to."""
        self.target: Target | None = None
        self._hovered: Handle | None = None
        self._drag: Drag | None = None
        self._before: Target | None = None
        self._selection = session.selection
        self._count = 0
        self._shapes = {handle: Lines(2.5, opacity=0.45 if handle.kind == "plane" else 1.0) for handle in HANDLES}
        self._tips = [Lines() for _ in range(3)]
        for lines in (*self._shapes.values(), *self._tips):
            view.front.AddActor(lines.actor)
        self._hide(True)
        session.selection_changed.connect(self.retarget)
        live.changed.connect(self.retarget)
        self.retarget()

    @property
    def dragging(self) -> bool:
        return self._drag is not None

    def retarget(self) -> None:
        """Stand at what is selected, wherever it is now."""
        if self._drag is not None and self.session.selection != self._selection:
            self.cancel()
        self.target = target(self.session.project, self.session.selection, self._live.step)
        self._hide(self.target is None)
        self.view.redraw()

    def frame(self) -> Frame | None:
        """Where it stands on the screen, as large as it is drawn there; None where the eye itself stands."""
        if self.target is None:
            return None
        T, eye = self.target.T_world_item, self.view.eye
        if not eye.parallel and (eye.position - T[:3, 3]) @ eye.rotation[:, 2] < NEAREST * eye.distance:
            return None
        axes = T[:3, :3].copy() if self.local else np.eye(3)
        return Frame(T[:3, 3], axes, self.view.eye.metres_per_pixel(T[:3, 3], self.view.pixels))

    def set_local(self, local: bool) -> None:
        self.local = local
        self.view.redraw()

    def hover(self, x: float, y: float) -> bool:
        frame = self.frame()
        found = None if frame is None else gizmo_geometry.handle_at(frame, self.view.eye, x, y, self.view.pixels)
        if found != self._hovered:
            self._hovered = found
            self.view.redraw()
        return found is not None

    def press(self, x: float, y: float) -> bool:
        frame = self.frame()
        handle = None if frame is None else gizmo_geometry.handle_at(frame, self.view.eye, x, y, self.view.pixels)
        if frame is None or handle is None or self.target is None:
            return False
        self._drag = Drag(frame, handle, *self.view.eye.ray(x, y, self.view.pixels))
        self._hovered, self._before, self._selection = handle, self.target, self.session.selection
        self._count += 1
        self.session.begin_drag()
        self.view.redraw()
        return True

    def drag(self, x: float, y: float, snap: bool) -> None:
        if self._drag is None or self._before is None:
            return
        steps = (self.move_step, self.turn_step) if snap else (0.0, 0.0)
        motion = self._drag.to(*self.view.eye.ray(x, y, self.view.pixels), *steps)
        if motion is None:
            return
        before, turns = self._before, self._drag.handle.kind == "ring"
        pose = before.turned(motion) if turns else before.moved(motion)
        if turns and np.array_equal(motion, np.eye(4)):
            pose = before.pose
        verb = "turn" if turns else "move"
        self.session.set(before.path, pose, f"{verb} {before.name}", merge=f"gizmo {id(self)} {self._count}")
        self.told.emit(self._words(motion))

    def release(self) -> None:
        if self._drag is not None:
            self._drag = self._before = None
            self.session.end_drag()
            self.told.emit("")
            self.view.redraw()

    def cancel(self) -> None:
        """Put back what the drag has moved (Escape)."""
        if self._drag is None or self._before is None:
            return
        before = self._before
        moved = target(self.session.project, self._selection, self._live.step)
        self.view.let_go()
        self.release()
        if moved is not None and moved.pose != before.pose:
            self.session.document.undo()

    def draw(self) -> None:
        """Before each painting: as large on the screen as ever, and only what can be got hold of from here."""
        frame = self.frame()
        if frame is None:
            self._hide(True)
            return
        held = self._drag.handle if self._drag is not None else None
        eye, pixel = self.view.eye, frame.pixel
        for handle, lines in self._shapes.items():
            shown = handle == held if held is not None else gizmo_geometry.offered(frame, eye, handle)
            lines.actor.SetVisibility(shown)
            if handle.kind == "axis":
                self._tips[handle.axis].actor.SetVisibility(shown)
            if not shown:
                continue
            colour = HELD if handle in (held, self._hovered) else COLOURS[handle.axis]
            lines.colour(colour)
            if handle.kind == "axis":
                end = gizmo_geometry.arm_end(frame, handle.axis)
                lines.lines(np.stack([frame.centre, end]), [(0, 1)])
                self._tips[handle.axis].faces(*_cone(end, frame.axes, handle.axis, pixel))
                self._tips[handle.axis].colour(colour)
            elif handle.kind == "plane":
                lines.faces(gizmo_geometry.plane_corners(frame, handle.axis), [[0, 1, 2, 3]])
            else:
                points = gizmo_geometry.ring_points(frame, handle.axis)
                lines.lines(points, [(i, i + 1) for i in range(len(points) - 1)])

    def _hide(self, hidden: bool) -> None:
        for lines in (*self._shapes.values(), *self._tips):
            lines.actor.SetVisibility(not hidden)

    def _words(self, motion: Float) -> str:
        assert self._drag is not None
        if self._drag.handle.kind == "ring":
            return f"{math.degrees(self._drag.angle):+.1f}°"
        along = 1e3 * motion[:3, 3] @ self._drag.frame.axes
        names = [f"{name} {value:+.2f}" for name, value in zip("xyz", along, strict=True) if abs(value) > 5e-3]
        return (", ".join(names) or "0.00") + " mm"


def _cone(tip: Float, axes: Float, axis: int, pixel: float) -> tuple[Float, Any]:
    """Points and triangles of an arrow's head."""
    turn = np.linspace(0.0, 2.0 * math.pi, TIP_SIDES, endpoint=False)[:, None]
    a, b = axes[:, (axis + 1) % 3], axes[:, (axis + 2) % 3]
    rim = tip + TIP_RADIUS_PX * pixel * (np.cos(turn) * a + np.sin(turn) * b)
    points = np.concatenate([(tip + TIP_PX * pixel * axes[:, axis])[None], rim])
    i = np.arange(TIP_SIDES)
    return points, np.stack([np.zeros_like(i), i + 1, (i + 1) % TIP_SIDES + 1], axis=1)
