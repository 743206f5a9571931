"""The plane of the section in the 3D view, with the line in which it cuts the part: moved along its normal and turned.

The panel of the section has the numbers; both follow `Session.section`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.report.colour import TRUTH
from analysis.section import Plane
from render.base.arrays import Float
from studio.preview.gizmo_geometry import Frame, Handle
from studio.qt.core import theme
from studio.qt.core.session import Session
from studio.qt.viewport.handle_tool import HandleTool
from studio.qt.viewport.view3d import View3D
from studio.qt.viewport.viewport_scene import CURVE_PX, LINE_PX, Lines

HANDLES = (Handle("axis", 2), Handle("ring", 0), Handle("ring", 1))
"""A plane is the same wherever it is shifted in itself, or turned about its normal."""
OPACITY = 0.22
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0))


class SectionPlane(HandleTool):
    """Shown while the session has a section."""

    def __init__(self, session: Session, view: View3D) -> None:
        super().__init__(view, HANDLES)
        self.session = session
        self._before: Plane | None = None
        self._sheet, self._rim, self._cut = Lines(opacity=OPACITY), Lines(LINE_PX), Lines(CURVE_PX)
        for lines in self._all():
            lines.actor.PickableOff()
            view.renderer.AddActor(lines.actor)
        session.section_changed.connect(self.refresh)
        theme.notice.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Draw what the session has."""
        shown = self.session.section
        for lines in self._all():
            lines.actor.SetVisibility(shown is not None)
        if shown is None:
            if self.dragging:
                self.cancel()
            self.hide(True)
        else:
            self._sheet.faces(shown.corners, [[0, 1, 2, 3]])
            self._rim.lines(shown.corners, EDGES)
            points = np.concatenate([np.zeros((0, 3)), *shown.true])
            ends = np.cumsum([len(line) for line in shown.true], dtype=np.int64) - 1
            first = np.setdiff1d(np.arange(max(len(points) - 1, 0)), ends)
            self._cut.lines(points, np.column_stack([first, first + 1]))
        accent = theme.colours().accent
        for lines, colour in ((self._sheet, accent), (self._rim, accent), (self._cut, TRUTH)):
            lines.colour(colour)
        self.view.redraw()

    def frame(self) -> Frame | None:
        shown = self.session.section
        return None if shown is None else self.standing(np.asarray(shown.plane.point), shown.plane.axes.T)

    def begin(self) -> None:
        shown = self.session.section
        self._before = None if shown is None else shown.plane

    def follow(self, motion: Float, turns: bool) -> None:
        if self._before is not None:
            moved = motion[:3, :3] @ self._before.point + motion[:3, 3]
            self._take(Plane(_three(moved), _three(motion[:3, :3] @ self._before.axes[2])))

    def end(self) -> None:
        """What it stands at is what the panel cuts."""

    def put_back(self) -> None:
        if self._before is not None:
            self._take(self._before)

    def _take(self, plane: Plane) -> None:
        shown = self.session.section
        if shown is not None:
            self.session.show_section(replace(shown, plane=plane))

    def _all(self) -> tuple[Lines, ...]:
        return self._sheet, self._rim, self._cut


def _three(vector: Float) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
