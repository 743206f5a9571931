"""Arms to move along, squares to move across and rings to turn about, drawn before the scene and dragged by the mouse.

What they move is for the classes made of it to say: an item of the scene, or the plane of a section.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from PySide6.QtCore import QObject, Signal

from render.base.arrays import Float
from studio.preview import gizmo_geometry
from studio.preview.gizmo_geometry import HANDLES, Drag, Frame, Handle
from studio.qt.viewport.view3d import View3D
from studio.qt.viewport.viewport_scene import Lines

COLOURS = ("#e5534b", "#4aa851", "#3f86e8")
"""Of the axes x, y, z, as everywhere in 3D programs."""
HELD = "#ffcc33"
NEAREST = 1e-3
"""Of the distance to what is looked at: nearer to the eye there are no handles. Drawn at no size they end the
program."""
TIP_PX, TIP_RADIUS_PX, TIP_SIDES = 15.0, 5.5, 12


class HandleTool(QObject):
    """A `studio.qt.viewport.view3d.Tool`, made once; `frame` says where it stands, if anywhere."""

    told = Signal(str)
    """How far the drag has come, in words; empty when it is over."""

    def __init__(self, view: View3D, handles: tuple[Handle, ...] = HANDLES) -> None:
        super().__init__(view)
        self.view, self.handles = view, handles
        self.move_step, self.turn_step = 1e-3, math.radians(5.0)
        """m, rad; what a drag with Ctrl snaps to."""
        self._hovered: Handle | None = None
        self._drag: Drag | None = None
        self._shapes = {handle: Lines(2.5, opacity=0.45 if handle.kind == "plane" else 1.0) for handle in handles}
        self._tips = {handle.axis: Lines() for handle in handles if handle.kind == "axis"}
        for lines in (*self._shapes.values(), *self._tips.values()):
            view.front.AddActor(lines.actor)
        self.hide(True)

    @property
    def dragging(self) -> bool:
        return self._drag is not None

    def frame(self) -> Frame | None:
        """Where it stands on the screen, as large as it is drawn there; None: nowhere."""
        raise NotImplementedError

    def begin(self) -> None:
        """A handle was got hold of."""
        raise NotImplementedError

    def follow(self, motion: Float, turns: bool) -> None:
        """(4, 4) motion in the world since `begin`; turns: it is of a ring."""
        raise NotImplementedError

    def end(self) -> None:
        """The handle was let go."""
        raise NotImplementedError

    def put_back(self) -> None:
        """After `end`: as it was at `begin` (Escape)."""
        raise NotImplementedError

    def standing(self, centre: Float, axes: Float) -> Frame | None:
        """A frame at (3,) centre with the columns of (3, 3) axes; None where the eye itself stands."""
        eye = self.view.eye
        if not eye.parallel and (eye.position - centre) @ eye.rotation[:, 2] < NEAREST * eye.distance:
            return None
        return Frame(centre, axes, eye.metres_per_pixel(centre, self.view.pixels))

    def hover(self, x: float, y: float) -> bool:
        found = self._at(self.frame(), x, y)
        if found != self._hovered:
            self._hovered = found
            self.view.redraw()
        return found is not None

    def press(self, x: float, y: float) -> bool:
        frame = self.frame()
        handle = self._at(frame, x, y)
        if frame is None or handle is None:
            return False
        self._drag = Drag(frame, handle, *self.view.eye.ray(x, y, self.view.pixels))
        self._hovered = handle
        self.begin()
        self.view.redraw()
        return True

    def drag(self, x: float, y: float, snap: bool) -> None:
        if self._drag is None:
            return
        steps = (self.move_step, self.turn_step) if snap else (0.0, 0.0)
        motion = self._drag.to(*self.view.eye.ray(x, y, self.view.pixels), *steps)
        if motion is not None:
            self.follow(motion, self._drag.handle.kind == "ring")
            self.told.emit(self._words(motion))

    def release(self) -> None:
        if self._drag is not None:
            self._drag = None
            self.end()
            self.told.emit("")
            self.view.redraw()

    def cancel(self) -> None:
        """Put back what the drag has moved (Escape)."""
        if self._drag is not None:
            self.view.let_go()
            self.release()
            self.put_back()

    def draw(self) -> None:
        """Before each painting: as large on the screen as ever, and only what can be got hold of from here."""
        frame = self.frame()
        if frame is None:
            self.hide(True)
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

    def hide(self, hidden: bool) -> None:
        for lines in (*self._shapes.values(), *self._tips.values()):
            lines.actor.SetVisibility(not hidden)

    def _at(self, frame: Frame | None, x: float, y: float) -> Handle | None:
        if frame is None:
            return None
        return gizmo_geometry.handle_at(frame, self.view.eye, x, y, self.view.pixels, self.handles)

    def _words(self, motion: Float) -> str:
        assert self._drag is not None
        if self._drag.handle.kind == "ring":
            return f"{math.degrees(self._drag.angle):+.1f}°"
        along = 1e3 * motion[:3, 3] @ self._drag.frame.axes
        names = [f"{name} {value:+.2f}" for name, value in zip("xyz", along, strict=True) if abs(value) > 5e-3]
        return (", ".join(names) or "0.00") + " mm"


class Tools:
    """Several in one view: the first that the mouse is on follows it."""

    def __init__(self, *tools: HandleTool) -> None:
        self.tools = tools
        self._held: HandleTool | None = None

    def press(self, x: float, y: float) -> bool:
        self._held = next((tool for tool in self.tools if tool.press(x, y)), None)
        return self._held is not None

    def drag(self, x: float, y: float, snap: bool) -> None:
        if self._held is not None:
            self._held.drag(x, y, snap)

    def release(self) -> None:
        if self._held is not None:
            self._held.release()

    def cancel(self) -> None:
        if self._held is not None:
            self._held.cancel()

    def hover(self, x: float, y: float) -> bool:
        # each of them hears of it, so that the one the mouse has left is no longer marked
        return any([tool.hover(x, y) for tool in self.tools])

    def draw(self) -> None:
        for tool in self.tools:
            tool.draw()


def _cone(tip: Float, axes: Float, axis: int, pixel: float) -> tuple[Float, Any]:
    """Points and triangles of an arrow's head."""
    turn = np.linspace(0.0, 2.0 * math.pi, TIP_SIDES, endpoint=False)[:, None]
    a, b = axes[:, (axis + 1) % 3], axes[:, (axis + 2) % 3]
    rim = tip + TIP_RADIUS_PX * pixel * (np.cos(turn) * a + np.sin(turn) * b)
    points = np.concatenate([(tip + TIP_PX * pixel * axes[:, axis])[None], rim])
    i = np.arange(TIP_SIDES)
    return points, np.stack([np.zeros_like(i), i + 1, (i + 1) % TIP_SIDES + 1], axis=1)
