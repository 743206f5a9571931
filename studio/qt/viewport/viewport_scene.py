"""The actors of the 3D view: meshes, rig, light sheets, lit curves, lamps and ground; only what changed is touched.

Meshes are given to the graphics once; a move sets their matrix. What a laser draws is a few thousand points a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.vtkRenderingCore import vtkActor, vtkBillboardTextActor3D, vtkPolyDataMapper

from analysis.report.colour import wavelength_colour
from render.base.arrays import Float
from render.base.pose import transform_points
from render.scene.motion import Turntable
from studio.editing.units import Unit
from studio.preview import rig_drawing
from studio.preview.preview import Body, Look
from studio.project.document import FieldPath
from studio.qt.core.theme import Colours, mixed
from studio.qt.viewport.mesh_actor import mesh_actor

Colour = tuple[float, float, float]

CAMERA: FieldPath = ("scene", "rig", "camera")
LASERS: FieldPath = ("scene", "rig", "lasers")
OBJECTS: FieldPath = ("scene", "objects")
LIGHTS: FieldPath = ("scene", "lights")
MOST_LABELS = 6
"""Numbers along a side of the ground: more lie over each other where the view is small."""
SMALL_PX, AXIS_PX, LINE_PX, CURVE_PX = 1.0, 1.3, 1.6, 3.0


class Lines:
    """One actor of line segments or polygons whose points are replaced at will."""

    def __init__(self, width: float = LINE_PX, opacity: float = 1.0, lit: bool = False, behind: bool = False) -> None:
        self.data = pv.PolyData()
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(self.data)
        mapper.ScalarVisibilityOff()
        # a line that lies on a surface is drawn before it; the ground, behind
        mapper.SetResolveCoincidentTopologyToPolygonOffset()
        mapper.SetRelativeCoincidentTopologyLineOffsetParameters(*((4.0, 40.0) if behind else (-4.0, -40.0)))
        self.actor = vtkActor()
        self.actor.SetMapper(mapper)
        self.look = self.actor.GetProperty()
        self.look.SetLineWidth(width)
        self.look.SetOpacity(opacity)
        self.look.SetLighting(lit)
        self.look.SetAmbient(0.35 if lit else 0.0)  # without light VTK adds it to the colour
        if opacity < 1.0:
            self.actor.ForceTranslucentOn()

    def lines(self, points: Float, pairs: Any) -> None:
        """Segments between pairs (m, 2) of points (n, 3)."""
        pairs = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
        cells = np.concatenate([np.full((len(pairs), 1), 2), pairs], axis=1)
        made = pv.PolyData(points.astype(np.float32), lines=cells.ravel()) if len(pairs) else pv.PolyData()
        self.data.ShallowCopy(made)

    def faces(self, points: Float, faces: Any) -> None:
        """Polygons (m, k) of points (n, 3)."""
        faces = np.asarray(faces, dtype=np.int64)
        cells = np.concatenate([np.full((len(faces), 1), faces.shape[1]), faces], axis=1) if len(faces) else faces
        made = pv.PolyData(points.astype(np.float32), faces=cells.ravel()) if len(faces) else pv.PolyData()
        self.data.ShallowCopy(made)

    def colour(self, colour: str | Colour) -> None:
        self.look.SetColor(*pv.Color(colour).float_rgb)


@dataclass
class LaserActors:
    """What is drawn of one laser."""

    body: Lines = field(default_factory=lambda: Lines(lit=True))
    sheet: Lines = field(default_factory=lambda: Lines(opacity=0.16))
    volume: Lines = field(default_factory=lambda: Lines(SMALL_PX))
    hidden: Lines = field(default_factory=lambda: Lines(LINE_PX, opacity=0.55))
    curve: Lines = field(default_factory=lambda: Lines(CURVE_PX))

    def all(self) -> tuple[Lines, ...]:
        return self.body, self.sheet, self.volume, self.hidden, self.curve


class ViewportScene:
    """Draws looks into a renderer. `paths` tells what a picked actor stands for."""

    def __init__(self, renderer: Any) -> None:
        self.renderer = renderer
        self.paths: dict[Any, FieldPath] = {}
        self.shown = {"sheets": True, "frustum": True, "volume": True, "grid": True}
        self.through: FieldPath = ()
        self.size = 0.0
        self._colours: Colours | None = None
        self._meshes: dict[tuple[int, int], tuple[Body, vtkActor]] = {}
        self._poses: dict[tuple[int, int], tuple[int, Float]] = {}
        self._lasers: list[LaserActors] = []
        self._lamps: list[Lines] = []
        self._frustum, self._camera, self._plane = Lines(SMALL_PX), Lines(lit=True), Lines(opacity=0.35)
        self._grid = Lines(SMALL_PX, behind=True)
        self._axis_x, self._axis_y = Lines(LINE_PX, behind=True), Lines(LINE_PX, behind=True)
        self._outline, self._turning = Lines(LINE_PX), Lines(AXIS_PX)
        self._turning.actor.PickableOff()
        self._labels: list[vtkBillboardTextActor3D] = []
        self._grid_box: tuple[float, ...] = ()
        self.spacing = 0.0
        """Of the ground grid, m."""
        rig = (self._frustum, self._camera, self._plane)
        for lines in (*rig, self._grid, self._axis_x, self._axis_y, self._outline, self._turning):
            renderer.AddActor(lines.actor)
        for lines in rig:
            self.paths[lines.actor] = CAMERA

    def draw(self, look: Look, selections: Sequence[FieldPath], *, settled: bool) -> None:
        """Show a look. settled: nothing is being dragged, so that sizes and the grid may follow too."""
        if settled or not self.size:
            self.size = rig_drawing.glyph_size(look.scene)
        self._draw_meshes(look)
        self._draw_camera(look)
        self._draw_lasers(look)
        self._draw_lamps(look)
        self._draw_turning(look)
        if settled:
            self._draw_grid(*self.bounds(look))
        self.highlight(look, selections)

    def bounds(self, look: Look, path: FieldPath = (), *, lamps: bool = False) -> tuple[Float, Float]:
        """Lowest and highest coordinates, m: of one item, or of everything that has a size; lamps: of these too."""
        scene, step, corners = look.scene, look.step, []
        everything = len(path) < 2 or path == ("scene", "rig")
        for item in look.placed:
            if (len(path) < 2) or path == object_path(look, item.index):
                box = np.stack(np.meshgrid(*item.body.bounds.T), axis=-1).reshape(-1, 3)
                corners.append(transform_points(item.T_world_object, box))
        margin = 2.5 * self.size
        if everything or path == CAMERA:
            corners.append(_around(scene.T_world_camera(step), margin))
        for i in range(len(scene.lasers)):
            if everything or path == (*LASERS, i):
                corners.append(_around(scene.T_world_laser(i, step), margin))
        for i, light in enumerate(scene.lights):
            if path == (*LIGHTS, i) or (lamps and not path):
                corners.append(_around(light.T_world_light.matrix, 2.0 * margin))
        if not corners:
            return self.bounds(look) if path else rig_drawing.bounds_of(np.zeros((0, 3)))
        return rig_drawing.bounds_of(np.concatenate(corners))

    def solids(self) -> list[vtkActor]:
        """What a click gets hold of besides meshes. A line on a mesh is not among it: a click there means the mesh."""
        return [
            *(actors.body.actor for actors in self._lasers),
            self._camera.actor,
            *(lamp.actor for lamp in self._lamps),
        ]

    def veils(self) -> list[vtkActor]:
        """What it gets hold of where there is nothing else."""
        return [*(actors.sheet.actor for actors in self._lasers), self._plane.actor, self._frustum.actor]

    def highlight(self, look: Look, selections: Sequence[FieldPath]) -> None:
        """Mark what is selected: a mesh by the edges of its box, the rest by the accent colour."""
        colours = self._colours
        if colours is None:
            return
        corners, edges = [np.zeros((0, 3))], []
        for item in look.placed:
            if object_path(look, item.index) in selections:
                box, margin = item.body.bounds, 0.01 * np.ptp(item.body.bounds, axis=0).max()
                wide = np.stack([box[0] - margin, box[1] + margin])
                first = 8 * (len(corners) - 1)
                edges += [(first + i, first + (i | bit)) for i in range(8) for bit in (1, 2, 4) if not i & bit]
                own = np.array(np.meshgrid(*wide.T, indexing="ij")).reshape(3, -1).T
                corners.append(transform_points(item.T_world_object, own))
        self._outline.lines(np.concatenate(corners), edges)
        self._outline.colour(colours.accent)
        chosen = CAMERA in selections or ("scene", "rig") in selections
        neutral = colours.muted
        self._camera.colour(colours.accent if chosen else neutral)
        self._frustum.colour(colours.accent if chosen else mixed(colours.text, colours.base, 0.5))
        self._plane.colour(colours.accent if chosen else neutral)
        for i, (actors, laser) in enumerate(zip(self._lasers, look.scene.lasers, strict=False)):
            chosen = (*LASERS, i) in selections
            actors.body.colour(colours.accent if chosen else wavelength_colour(laser.wavelength_nm))
            actors.sheet.look.SetOpacity(0.24 if chosen else 0.16)
        for i, lamp in enumerate(self._lamps):
            lamp.colour(colours.accent if (*LIGHTS, i) in selections else colours.warning)

    def paint(self, colours: Colours) -> None:
        """Take the colours of a theme."""
        self._colours = colours
        self.renderer.SetBackground(*pv.Color(colours.base).float_rgb)
        self._grid.colour(mixed(colours.muted, colours.base, 0.45))
        self._turning.colour(colours.text)
        self._axis_x.colour(mixed(colours.error, colours.base, 0.8))
        self._axis_y.colour(mixed(colours.good, colours.base, 0.8))
        for label in self._labels:
            label.GetTextProperty().SetColor(*pv.Color(colours.muted).float_rgb)

    def show(self, what: str, on: bool) -> None:
        """Show or hide the "sheets", the "frustum", the "volume" or the "grid"."""
        self.shown[what] = on
        self.look_through(self.through)
        for actor in (self._grid.actor, self._axis_x.actor, self._axis_y.actor, *self._labels):
            actor.SetVisibility(self.shown["grid"])

    def look_through(self, path: FieldPath) -> None:
        """Leave out what would stand before the eye of a camera or laser; () for none."""
        self.through = path
        camera = path == CAMERA
        self._camera.actor.SetVisibility(not camera)
        # seen from the camera, the frustum is the border of its image
        self._frustum.actor.SetVisibility(self.shown["frustum"] or camera)
        self._plane.actor.SetVisibility(self.shown["frustum"] and not camera)
        for i, actors in enumerate(self._lasers):
            own = path == (*LASERS, i)
            actors.body.actor.SetVisibility(not own)
            # from the camera, sheets would veil what it sees
            actors.sheet.actor.SetVisibility(self.shown["sheets"] and not own and not camera)
            actors.volume.actor.SetVisibility(self.shown["volume"] and not own and not camera)

    def _draw_meshes(self, look: Look) -> None:
        seen: dict[int, int] = {}
        wanted = set()
        for item in look.placed:
            n = seen[id(item.body)] = seen.get(id(item.body), 0) + 1
            key = (id(item.body), n)
            wanted.add(key)
            if key not in self._meshes:
                self._meshes[key] = (item.body, mesh_actor(item.body.surface))
                self.renderer.AddActor(self._meshes[key][1])
            actor = self._meshes[key][1]
            self.paths[actor] = object_path(look, item.index)
            if key not in self._poses or not np.array_equal(self._poses[key][1], item.T_world_object):
                self._poses[key] = (item.index, item.T_world_object)
                actor.SetUserMatrix(pv.vtkmatrix_from_array(item.T_world_object))
        for key in set(self._meshes) - wanted:
            actor = self._meshes.pop(key)[1]
            self._poses.pop(key, None)
            self.paths.pop(actor, None)
            self.renderer.RemoveActor(actor)

    def _draw_camera(self, look: Look) -> None:
        T, scene = look.scene.T_world_camera(look.step), look.scene
        self._frustum.lines(*_placed(T, *rig_drawing.frustum(scene)))
        self._camera.faces(transform_points(T, rig_drawing.camera_body(self.size)), rig_drawing.BOX_FACES)
        plane = transform_points(T, rig_drawing.image_plane(scene))
        self._plane.faces(plane, [[0, 1, 2], [0, 2, 3], [4, 5, 6]])

    def _draw_lasers(self, look: Look) -> None:
        scene, step = look.scene, look.step
        while len(self._lasers) < len(scene.lasers):
            actors = LaserActors()
            self._lasers.append(actors)
            for lines in actors.all():
                self.renderer.AddActor(lines.actor)
                if lines is not actors.volume:
                    self.paths[lines.actor] = (*LASERS, len(self._lasers) - 1)
        while len(self._lasers) > len(scene.lasers):
            for lines in self._lasers.pop().all():
                self.renderer.RemoveActor(lines.actor)
                self.paths.pop(lines.actor, None)
        self.look_through(self.through)
        T_world_camera = scene.T_world_camera(step)
        fans = [look.fan(i) for i in range(len(scene.lasers))]
        reach = rig_drawing.reach_of(scene, fans)
        for i, (laser, actors) in enumerate(zip(scene.lasers, self._lasers, strict=True)):
            colour = wavelength_colour(laser.wavelength_nm)
            T = scene.T_world_laser(i, step)
            actors.body.faces(transform_points(T, rig_drawing.laser_body(self.size)), rig_drawing.BOX_FACES)
            ends = rig_drawing.fan_points(fans[i], reach)
            rays = np.arange(1, len(ends) - 1)
            actors.sheet.faces(ends, np.stack([np.zeros_like(rays), rays, rays + 1], axis=1))
            edge = rig_drawing.working_volume(scene.camera, laser, scene.T_camera_laser(i), reach)
            around = np.arange(len(edge))
            actors.volume.lines(transform_points(T_world_camera, edge), np.stack([around, np.roll(around, -1)], axis=1))
            actors.hidden.lines(*rig_drawing.hidden_line(fans[i]))
            curve = look.lit_curve(i)
            actors.curve.lines(transform_points(T_world_camera, curve.point), rig_drawing.joined(curve))
            for lines, white in (
                (actors.sheet, 0.15),
                (actors.volume, 0.15),
                (actors.hidden, 0.15),
                (actors.curve, 0.35),
            ):
                r, g, b = (white + (1.0 - white) * value for value in colour)
                lines.colour((r, g, b))

    def _draw_lamps(self, look: Look) -> None:
        lights = look.scene.lights
        while len(self._lamps) < len(lights):
            self._lamps.append(Lines(LINE_PX))
            self.renderer.AddActor(self._lamps[-1].actor)
            self.paths[self._lamps[-1].actor] = (*LIGHTS, len(self._lamps) - 1)
        while len(self._lamps) > len(lights):
            actor = self._lamps.pop().actor
            self.renderer.RemoveActor(actor)
            self.paths.pop(actor, None)
        for light, lamp in zip(lights, self._lamps, strict=True):
            lamp.lines(*_placed(light.T_world_light.matrix, *rig_drawing.lamp(light, 1.5 * self.size)))

    def _draw_turning(self, look: Look) -> None:
        """The axis that a turntable's motion is about; it takes no part in what is clicked or brought into view."""
        motion = look.scene.motion
        if not isinstance(motion, Turntable):
            self._turning.lines(np.zeros((0, 3)), [])
            return
        boxes = [transform_points(item.T_world_object, item.body.bounds) for item in look.placed]
        around = np.concatenate([*boxes, [motion.centre]])
        points, pairs = rig_drawing.turning(motion, around.min(axis=0), around.max(axis=0), self.size)
        self._turning.lines(points, pairs)

    def _draw_grid(self, low: Float, high: Float) -> None:
        step, lines = rig_drawing.grid(low, high)
        box = (step, *lines.reshape(-1, 3).min(axis=0), *lines.reshape(-1, 3).max(axis=0))
        if box == self._grid_box:
            return
        self._grid_box, self.spacing = box, step
        on_axis = np.abs(lines[:, :, :2]).max(axis=1) == 0.0
        for actor, chosen in (
            (self._grid, ~on_axis.any(axis=1)),
            (self._axis_y, on_axis[:, 0]),
            (self._axis_x, on_axis[:, 1]),
        ):
            points = lines[chosen].reshape(-1, 3)
            actor.lines(points, np.arange(len(points)).reshape(-1, 2))
        for label in self._labels:
            self.renderer.RemoveActor(label)
        low, high = lines.reshape(-1, 3).min(axis=0), lines.reshape(-1, 3).max(axis=0)
        self._labels, length = [], Unit.of("m")
        for axis in range(2):
            first, last = round(low[axis] / step), round(high[axis] / step)
            every = -(-(last - first + 1) // MOST_LABELS)
            for k in (k for k in range(first, last + 1) if k % every == 0):
                # along the two sides of the ground that the usual view has in front
                place = (k * step, low[1], 0.0) if axis == 0 else (high[0], k * step, 0.0)
                self._labels.append(_label(f"{length.factor * k * step:g}", place))
        self._labels[-1].SetInput(f"{self._labels[-1].GetInput()} {length.shown}")
        for label in self._labels:
            self.renderer.AddActor(label)
            label.SetVisibility(self.shown["grid"])
        if self._colours is not None:
            self.paint(self._colours)


def object_path(look: Look, visible_index: int) -> FieldPath:
    """Path of the i-th visible object."""
    item = look.scene.visible_objects[visible_index]
    return (*OBJECTS, next(i for i, other in enumerate(look.scene.objects) if other is item))


def _placed(T: Float, points: Float, pairs: list[tuple[int, int]]) -> tuple[Float, list[tuple[int, int]]]:
    return transform_points(T, points), pairs


def _around(T: Float, margin: float) -> Float:
    return np.stack([T[:3, 3] - margin, T[:3, 3] + margin])


def _label(text: str, place: tuple[float, float, float]) -> vtkBillboardTextActor3D:
    label = vtkBillboardTextActor3D()
    label.SetInput(text)
    label.SetPosition(*place)
    label.SetDisplayOffset(2, -4)
    look = label.GetTextProperty()
    look.SetFontSize(11)
    look.SetJustificationToCentered()
    look.SetVerticalJustificationToTop()
    label.PickableOff()
    return label
