"""Measures of the part in the 3D view: their lines on the part, and their values in the colour of the verdict."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from PySide6.QtCore import QObject
from vtkmodules.vtkRenderingCore import vtkBillboardTextActor3D, vtkTextRenderer

from analysis.cloud import at_step
from render.base.arrays import Float
from studio.qt.core import theme
from studio.qt.core.session import Session
from studio.qt.viewport.error_cloud import ErrorCloud
from studio.qt.viewport.view3d import View3D
from studio.qt.viewport.viewport_scene import Lines
from studio.scan.measures_in_3d import MeasureIn3D

MEASURE_PX, FONT_PX = 3.0, 13
ASIDE_PX, APART_PX = 8, 4
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
        self._drawn_before, view.before_paint = view.before_paint, self._before_paint
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
        for one in shown:
            self._add(one)
        self.arrange()
        for line in self._lines:
            self.view.renderer.AddActor(line.actor)
        for label in self.labels:  # before all points, which would cover its first letters
            self.view.front.AddActor(label)
        self.view.redraw()

    def _before_paint(self) -> None:
        self._drawn_before()
        self.arrange()

    def arrange(self) -> None:
        """Each text aside of its place as it is seen now, above those that would cover it."""
        if not self.labels:
            return
        scale, dpi = self.view.devicePixelRatioF(), self.view.ren_win.GetDPI()
        places = np.array([label.GetPosition() for label in self.labels])
        seen = scale * self.view.eye.project(places, self.view.pixels) * [1.0, -1.0]
        taken: list[Float] = []
        for label, at in zip(self.labels, seen, strict=True):
            box = [0, 0, 0, 0]
            vtkTextRenderer.GetInstance().GetBoundingBox(label.GetTextProperty(), label.GetInput(), box, dpi)
            size = np.array([box[1] - box[0], box[3] - box[2]]) + APART_PX
            low = at + ASIDE_PX
            while covering := [one for one in taken if np.all(low < one[1]) and np.all(one[0] < low + size)]:
                low = np.array([low[0], max(one[1][1] for one in covering)])
            label.SetDisplayOffset(ASIDE_PX, round(float(low[1] - at[1])) if np.isfinite(at).all() else ASIDE_PX)
            taken.append(np.array([low, low + size]))

    def _add(self, one: MeasureIn3D) -> None:
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
        look = label.GetTextProperty()
        look.SetFontSize(FONT_PX)
        look.BoldOn()
        look.SetColor(*pv.Color(colour).float_rgb)
        look.SetBackgroundColor(*pv.Color(theme.colours().base).float_rgb)
        look.SetBackgroundOpacity(GROUND)
        label.PickableOff()
        self.labels.append(label)
