"""The measured points in the 3D view, coloured by their signed error, their height or their deviation from the nominal.

Pointing at one marks its scan line.
"""

from __future__ import annotations

from operator import is_

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QRect, Signal
from PySide6.QtGui import QColor
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from analysis.cloud import Cloud, T_first_step, at_step, cloud
from render.base.arrays import Float
from render.base.pose import invert
from studio.qt.core import theme
from studio.qt.core.session import Session
from studio.qt.viewport.colour_bar import ColourBar
from studio.qt.viewport.view3d import View3D
from studio.qt.viewport.viewport_scene import LINE_PX, Lines
from studio.scan.colour_scale import PER_METRE, ColourScale
from studio.scan.point_sample import PointSample
from studio.scan.region import Box
from studio.scan.remarks import best
from studio.scan.result_series import ERROR_VIEWS, ErrorView
from studio.scan.stages import Measurement

POINT_PX, RIM_PX, MARK_PX, NEAR_PX = 3.5, 5.5, 9.0, 9.0
OFFSET, RIM_OFFSET = -80.0, -60.0
"""Of the depth buffer, so that a point a little below the surface is seen, and its rim behind it."""
RIM = (0.16, 0.18, 0.21)
"""Around the points, as an error of zero is as white as a white part."""


class ErrorCloud(QObject):
    """Follows the shown render, or a running scan. Shown while it fits the scene, and always on `pinned`."""

    pressed = Signal(int)
    """The scan line of the point that is clicked."""
    shown_changed = Signal()
    """`visible` is another."""
    boxed = Signal(object)
    """A `Box` about points, to be told of."""
    of_scan_changed = Signal(bool)
    """Points are of a scan that runs, or was stopped, and not of what is shown."""

    def __init__(self, session: Session, view: View3D) -> None:
        super().__init__(view)
        self.session, self.view = session, view
        self.error_view: ErrorView = ERROR_VIEWS[0]
        self.pinned = False
        self.all_steps = True
        """Of a scan, the points of all its steps; else those of the step that is looked at."""
        self.points: Float = np.zeros((0, 3))
        self._first: Float = np.zeros((0, 3))
        """Where they are at step 0."""
        self.errors: Float = np.zeros(0)
        self.rows: NDArray[np.int32] = np.zeros(0, dtype=np.int32)
        self.steps: NDArray[np.int32] = np.zeros(0, dtype=np.int32)
        self.scales = {"error": ColourScale(), "height": ColourScale(about_zero=False), "deviation": ColourScale()}
        """Of each thing that colours may mean."""
        self.by_height = False
        self.image_scale = 1.0
        """At which the points were measured, to the scanner's image."""
        self._clouds: list[Cloud] = []
        self._of_scan = False
        self._measured: list[Measurement] = []
        """Whose points are drawn, of a single frame."""
        self._sample, self._scan_scale = PointSample(), 1.0
        self._data, self._actor = _point_actor(POINT_PX)
        self._marks, self._mark_actor = _point_actor(MARK_PX)
        self._rim = _rim_actor(self._data)
        self._rim.GetMapper().AddObserver("StartEvent", self._hold_nothing_back)
        self.box: Box | None = None
        """Which is drawn about its points."""
        self._edges = Lines(LINE_PX)
        self._edges.actor.PickableOff()
        view.renderer.AddActor(self._edges.actor)
        view.renderer.AddObserver("StartEvent", self._come_last)
        self.bar = ColourBar(view)
        self.bar.scaled.connect(self._rescale)
        self.bar.unit_chosen.connect(self._draw)
        self.bar.height_chosen.connect(self.colour_by_height)
        view.hovered.connect(self._hover)
        view.takes_click = self._click
        session.hover_changed.connect(self._mark)
        session.project_changed.connect(self._show_or_hide)
        session.step_changed.connect(self._follow_step)
        session.deviation_changed.connect(self._draw)
        session.document_replaced.connect(self.clear)
        for changed in (session.renders_changed, session.measured):
            changed.connect(self.refresh)
        self.refresh()

    def _come_last(self, *_: object) -> None:
        """After all that a scene has added since, which would cover the rims, as they hold nothing back."""
        renderer = self.view.renderer
        if renderer.GetViewProps().GetLastProp() is not self._mark_actor:
            for actor in (self._rim, self._actor, self._mark_actor):
                renderer.RemoveActor(actor)
                renderer.AddActor(actor)

    def _hold_nothing_back(self, *_: object) -> None:
        """A rim leaves no depth, so that in a small view those of near points do not cover the points behind them."""
        self.view.renderer.GetRenderWindow().GetState().vtkglDepthMask(0)

    @property
    def visible(self) -> bool:
        return bool(self._actor.GetVisibility())

    def pin(self, pinned: bool) -> None:
        """Show the points even where the scene has changed since."""
        self.pinned = pinned
        self._show_or_hide()

    @property
    def meaning(self) -> str:
        """Of the colours: "error", "height", or "deviation" while a panel shows one."""
        return "deviation" if self.session.deviation is not None else "height" if self.by_height else "error"

    @property
    def limit(self) -> float:
        """Largest value of its own colour, in the unit of the bar."""
        return self.bar.limits[1]

    def choose(self, view: ErrorView) -> None:
        """Another kind of error, with limits of its own."""
        self.error_view = view
        self.scales["error"] = self.scales["error"].as_before()
        self._draw()

    def colour_by_height(self, by_height: bool) -> None:
        """The height in the world, in place of the error."""
        self.by_height = by_height
        self._draw()

    def _rescale(self, scale: ColourScale) -> None:
        self.scales[self.meaning] = scale
        self._draw()

    def show_all_steps(self, all_steps: bool) -> None:
        """Of a scan, the points of all its steps, or of one."""
        self.all_steps = all_steps
        self.refresh()

    def clear(self) -> None:
        """Nothing is shown, until something is measured."""
        self._clouds, self._measured = [], []
        self._tell_of_scan(False)
        self._draw()

    def begin_scan(self, image_scale: float) -> None:
        """Points of a running scan are to come; those of an earlier one go."""
        self._sample, self._scan_scale = PointSample(), image_scale
        self.clear()

    def grow(self, columns: Cloud) -> None:
        """More points of a running scan."""
        self._sample.add(columns)
        self._clouds = [self._sample.points]
        self.image_scale = self._scan_scale
        self._tell_of_scan(True)
        self._draw()

    def _tell_of_scan(self, of_scan: bool) -> None:
        if of_scan != self._of_scan:
            self._of_scan = of_scan
            self.of_scan_changed.emit(of_scan)

    def frame(self) -> None:
        """Bring the points into the middle of the view; a few far outliers must not make the others a speck."""
        if len(self.points):
            low, high = np.percentile(self.points, (1.0, 99.0), axis=0)
            self.view.look_from(self.view.eye.framed(low, high, self.view.pixels))

    def take_box(self, rectangle: QRect) -> None:
        """The points within a rectangle of the view, as it is seen now, are the region to tell of."""
        x, y = self.view.eye.project(self.points, self.view.pixels).T if len(self.points) else np.zeros((2, 0))
        with np.errstate(invalid="ignore"):
            inside = (x >= rectangle.left()) & (x <= rectangle.right())
            inside &= (y >= rectangle.top()) & (y <= rectangle.bottom())
        if not (self.visible and inside.any()):
            self.session.message.emit("warning", "no point of the cloud is within the rectangle")
            return
        first = self._first[inside]
        low, high = np.floor(first.min(axis=0) * 1e6) * 1e-6, np.ceil(first.max(axis=0) * 1e6) * 1e-6
        ends = (rectangle.left(), rectangle.top()), (rectangle.right(), rectangle.bottom())
        sides = self.view.eye.sides(ends, self.view.pixels)
        on_part = sides @ invert(T_first_step(self.session.project.scene, self.session.step))
        self.boxed.emit(
            Box(_three(low), _three(high), tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in on_part))
        )

    def show_box(self, region: object) -> None:
        """Draw a region that is a box; any other is drawn elsewhere."""
        self.box = region if isinstance(region, Box) else None
        self._draw_box()

    def _draw_box(self) -> None:
        corners = np.zeros((0, 3))
        if self.box is not None and self.visible:  # without its points it would be about nothing
            ends = np.array([self.box.low, self.box.high]).T
            corners = np.array(np.meshgrid(*ends, indexing="ij")).reshape(3, -1).T
            corners = at_step(corners, self.session.project.scene, self.session.step)
        self._edges.lines(corners, [(i, i | bit) for i in range(len(corners)) for bit in (1, 2, 4) if not i & bit])
        self._edges.colour(theme.colours().accent)
        self.view.redraw()

    def refresh(self) -> None:
        """The points of the shown render, by the project's own method; of a scan those of all its steps, or of one."""
        render = self.session.shown
        if render is not None and render.scan is not None and render.scan.measured and self.all_steps:
            self._clouds, self._measured = [render.scan.points], []
            self._pixel_errors = [np.full(len(self._clouds[0]["x"]), np.nan)]
        elif render is not None and render.measurements:
            found, scene = best(render.measurements, self.session.project), render.project.scene
            drawn = self._measured
            if not self._of_scan and len(found) == len(drawn) and all(map(is_, found, drawn)):
                self._show_or_hide()  # more light came, and nothing is measured of it yet
                return
            self._measured = list(found)
            self._clouds = [cloud(one.points, one.errors, one.laser, one.step, scene) for one in found]
            self._pixel_errors = [one.errors.position[one.points.valid] for one in found]
        else:
            if not self._of_scan:
                self.clear()
            return
        self.image_scale = render.scanner_scale
        self._tell_of_scan(False)
        self._draw()

    def _draw(self) -> None:
        clouds, deviation = self._clouds, self.session.deviation
        if deviation is not None:
            first, self.rows, self.steps = deviation.points, deviation.row, deviation.step
        elif clouds:
            first = np.concatenate([np.stack([one["x"], one["y"], one["z"]], axis=1) for one in clouds])
            self.rows, self.steps = (np.concatenate([one[name] for one in clouds]) for name in ("row", "step"))
        else:
            first, self.rows, self.steps = np.zeros((0, 3)), np.zeros(0, np.int32), np.zeros(0, np.int32)
        # on the part, wherever it stands now
        self._first = first
        self.points = at_step(first, self.session.project.scene, self.session.step) if len(first) else first
        title, unit, self.errors = self._values(first)
        scale, limits = self.scales[self.meaning], self._first_limits(PER_METRE.get(unit, 1.0))
        low, high = self.bar.show_scale(title, unit, scale, self.errors, self.image_scale, limits, self._sides)
        _give(self._data, self.points, scale.colours(self.errors, low, high))
        self._mark()
        self._show_or_hide()
        self._draw_box()

    @property
    def _sides(self) -> tuple[str, str]:
        """In words, what is negative and what is positive: a deviation's sign is not that of an error."""
        if self.meaning == "error" and self.error_view.kind != "position":
            return "too near", "too far"
        return ("inside", "outside") if self.meaning == "deviation" else ("", "")

    def _values(self, first: Float) -> tuple[str, str, Float]:
        """What colours mean, its unit, and it of each point, in this unit."""
        deviation, view = self.session.deviation, self.error_view
        if deviation is not None:
            title, metres = "Deviation", deviation.value
        elif self.by_height:
            title, metres = "Height", first[:, 2]
        else:
            errors = np.concatenate([np.zeros(0), *(self._errors_of(i, one) for i, one in enumerate(self._clouds))])
            if view.kind == "position":
                self.bar.meaning = self.meaning
                return view.title, view.unit, errors
            title, metres = view.title, errors / view.scale
        scale = self.scales[self.meaning]
        largest = 1e6 * scale.limits(metres, self._first_limits(1.0))[1]
        unit = self.bar.unit_of(self.meaning, largest, scale.by_hand is not None)
        return title, unit, metres * PER_METRE[unit]

    def _first_limits(self, per_metre: float) -> tuple[float, float] | None:
        """Of a deviation that has some, in so many units a metre."""
        deviation = self.session.deviation
        if deviation is None or deviation.limit is None:
            return None
        return -deviation.limit * per_metre, deviation.limit * per_metre

    def _errors_of(self, i: int, one: Cloud) -> Float:
        view = self.error_view
        if view.kind == "position":
            return np.asarray(self._pixel_errors[i] if not self._of_scan else np.full(len(one["x"]), np.nan))
        return np.asarray(one["error_depth" if view.kind == "depth" else "error_surface"] * view.scale)

    def _mark(self) -> None:
        render, hovered = self.session.shown, self.session.hovered
        here = self.rows == hovered if hovered is not None else np.zeros(len(self.rows), bool)
        if render is not None and render.scan is not None and not self._of_scan:
            here &= self.steps == render.frame.step
        text = QColor(theme.colours().accent)
        colour = np.tile(np.array([[text.red(), text.green(), text.blue()]], np.uint8), (int(here.sum()), 1))
        _give(self._marks, self.points[here], colour)
        self.view.redraw()

    def _show_or_hide(self) -> None:
        shown = len(self.points) > 0 and (self.pinned or self._of_scan or not self._stale())
        changed = shown != self.visible
        for actor in (self._rim, self._actor, self._mark_actor):
            actor.SetVisibility(shown)
        self.bar.setVisible(shown)
        if changed:
            self._draw_box()
            self.shown_changed.emit()

    def _follow_step(self) -> None:
        motion = self.session.project.scene.motion
        if motion.kind != "none" and motion.moves == "objects":
            self._draw()
        else:
            self._mark()

    def _stale(self) -> bool:
        render = self.session.shown
        return render is not None and not render.shows(self.session.project)

    def _hover(self, x: float, y: float) -> None:
        """The scan line of the point under the mouse, if there is one."""
        row = self._row_at(x, y)
        if row is not None:
            self.session.hover(row)

    def _click(self, x: float, y: float) -> bool:
        """A click on a point keeps its scan line, and does not mean the part below it."""
        row = self._row_at(x, y)
        if row is not None:
            self.pressed.emit(row)
        return row is not None

    def _row_at(self, x: float, y: float) -> int | None:
        if not self.visible:
            return None
        apart = self.view.eye.project(self.points, self.view.pixels) - np.array([x, y])
        squared = np.einsum("ij,ij->i", apart, apart)
        if np.isfinite(squared).any():
            nearest = int(np.nanargmin(squared))
            if squared[nearest] < NEAR_PX**2:
                return int(self.rows[nearest])
        return None


def _three(vector: Float) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def _point_actor(size: float) -> tuple[pv.PolyData, vtkActor]:
    data = pv.PolyData()
    return data, _actor_of(data, size, OFFSET)


def _rim_actor(data: pv.PolyData) -> vtkActor:
    actor = _actor_of(data, RIM_PX, RIM_OFFSET)
    actor.GetMapper().ScalarVisibilityOff()
    actor.GetProperty().SetColor(*RIM)
    return actor


def _actor_of(data: pv.PolyData, size: float, offset: float) -> vtkActor:
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(data)
    mapper.SetColorModeToDirectScalars()
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyPointOffsetParameter(offset)
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.PickableOff()
    actor.UseBoundsOff()  # an outlier at the horizon must not set the clipping planes
    look = actor.GetProperty()
    look.SetPointSize(size)
    look.SetLighting(False)
    return actor


def _give(data: pv.PolyData, points: Float, colours: NDArray[np.uint8]) -> None:
    made = pv.PolyData(points.astype(np.float32)) if len(points) else pv.PolyData()
    if len(points):
        made.point_data.SetScalars(pv.convert_array(np.ascontiguousarray(colours), name="error"))
    data.ShallowCopy(made)
    data.Modified()
