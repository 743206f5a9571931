"""Measures of the part in the 3D view: their lines on the part, and their values in the colour of the verdict."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista as pv
from PySide6.QtCore import QObject
from vtkmodules.vtkRenderingCore import vtkBillboardTextActor3D

from analysis.cloud import at_step
from render.base.arrays import Float
from studio.qt.core import theme
from studio.qt.core.session import Session
from studio.qt.viewport.error_cloud import ErrorCloud
from studio.qt.viewport.view3d import View3D
from studio.qt.viewport.viewport_scene import Lines
from studio.scan.measures_in_3d import MeasureIn3D

MEASURE_PX, FONT_PX = 3.0, 13
ASIDE_PX, ROW_PX = 8, 22
NEAR = 0.15
"""Of the extent of all points: texts of nearer places would cover each other, and stand in lines."""
NOT_IN_THE_FONT = str.maketrans({"✓": None, "✗": None, "\u00a0": " "})
GROUND = 0.9
"""Opacity of what a text stands on, over points of any colour."""


class MeasureMarks(QObject):
    """Seen while the points are that they were read off."""

    def __init__(self, session: Session, view: View3D, cloud: ErrorCloud) -> None:
        super().__init__(view)
        self.session, self.view, self.cloud = session, view, cloud
        self._lines: list[Lines] = []
        self.labels: list[vtkBillboardTextActor3D] = []
        session.measures_changed.connect(self.draw)
        session.step_changed.connect(self.draw)
        cloud.shown_changed.connect(self.draw)
        theme.notice.changed.connect(self.draw)

    def draw(self) -> None:
        """All anew: they are few."""
        for line in self._lines:
            self.view.renderer.RemoveActor(line.actor)
        for label in self.labels:
            self.view.front.RemoveActor(label)
        self._lines, self.labels = [], []
        shown = self.session.measures_in_3d if self.cloud.visible else ()
        for i, one in enumerate(shown):
            self._add(one, self._row_of(one.place, shown[:i]))
        for line in self._lines:
            self.view.renderer.AddActor(line.actor)
        for label in self.labels:  # before all points, which would cover its first letters
            self.view.front.AddActor(label)
        self.view.redraw()

    def _row_of(self, place: Float, before: Sequence[MeasureIn3D]) -> int:
        """How many of the texts before it stand near its own."""
        near = NEAR * float(np.linalg.norm(np.ptp(self.cloud.points, axis=0))) if len(self.cloud.points) else 0.0
        return sum(float(np.linalg.norm(other.place - place)) < near for other in before)

    def _add(self, one: MeasureIn3D, row: int) -> None:
        scene, step = self.session.project.scene, self.session.step
        colour = theme.verdict_colour(one.verdict)
        for line in one.lines:
            drawn = Lines(MEASURE_PX)
            drawn.lines(at_step(line, scene, step), [(i, i + 1) for i in range(len(line) - 1)])
            drawn.colour(colour)
            drawn.actor.PickableOff()
            self._lines.append(drawn)
        label = vtkBillboardTextActor3D()
        label.SetInput(" ".join(one.text.translate(NOT_IN_THE_FONT).split()))
        label.SetPosition(*at_step(one.place[None], scene, step)[0])
        label.SetDisplayOffset(ASIDE_PX, ASIDE_PX + ROW_PX * row)
        look = label.GetTextProperty()
        look.SetFontSize(FONT_PX)
        look.BoldOn()
        look.SetColor(*pv.Color(colour).float_rgb)
        look.SetBackgroundColor(*pv.Color(theme.colours().base).float_rgb)
        look.SetBackgroundOpacity(GROUND)
        label.PickableOff()
        self.labels.append(label)
