"""Of a mesh file's object: replace it, choose what is up, fit it to the view, put it on the ground; a click each."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QActionGroup
from PySide6.QtWidgets import QGridLayout, QLabel, QMenu, QSizePolicy, QVBoxLayout, QWidget

from render.base.arrays import Float
from render.base.errors import InputError
from render.base.pose import transform_points
from render.scene.motion import Turntable
from render.scene.scene import SceneObject
from render.scene.shape import UNITS, MeshFile
from studio.editing import mesh_placing
from studio.editing.scene_edits import OBJECTS, replace_mesh_of
from studio.editing.units import Unit
from studio.preview.inside import CURE, inside
from studio.preview.preview import Placed
from studio.project.document import FieldPath, replaced, value_at
from studio.project.mesh_import import ImportedMesh
from studio.project.project import Project
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session
from studio.qt.core.widgets import text_button
from studio.qt.scene import mesh_importer

REPLACES = "Another mesh file in its place, shaded as an import of it is; pose, scale and material stay"
SCALES = "Changes its size: it fills the camera's view, in the middle of that, or where it stands on another part"
ON_TOP = "Its lowest point as high as the highest place of other objects below or around it, seen from above"
CENTRE = "The middle of its box over the turntable's axis point, or the origin where nothing turns; its height stays"

LEAST_MOVE = 1e-3
"""mm; less is rounding."""
LINES = 3
"""For which there is room below the buttons."""


class MeshBar(QWidget):
    """Shown while an object of a mesh file is selected."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.replace = text_button("Replace…", REPLACES)
        self.up = text_button("", "Which axis of the file points up", "choice")
        self.fit = text_button("Scale to fit", SCALES)
        self.ground = text_button("On the ground", "Its lowest point at height zero")
        self.top = text_button("On top", ON_TOP)
        self.centre = text_button("Centre", CENTRE)
        self.told = QLabel(wordWrap=True)
        self.told.setObjectName("muted")
        # the fields below stay where they are while its words change
        self.told.setMinimumHeight(LINES * self.told.fontMetrics().lineSpacing())
        self.told.setAlignment(Qt.AlignmentFlag.AlignTop)
        menu, group = QMenu(self.up), QActionGroup(self)
        self.axes = {}
        for axis in mesh_placing.UP_AXES:
            action = self.axes[axis] = menu.addAction(f"{axis} is up")
            action.setCheckable(True)
            group.addAction(action)
            action.triggered.connect(partial(self._turn_up, axis))
        self.up.setMenu(menu)
        self.up.setSizePolicy(QSizePolicy.Policy.Minimum, QSizePolicy.Policy.Ignored)  # as high as the others
        grid = QGridLayout()
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(4)
        for k, button in enumerate((self.replace, self.up, self.fit, self.centre, self.ground, self.top)):
            grid.addWidget(button, k // 2, k % 2)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(3)
        column.addLayout(grid)
        column.addWidget(self.told)
        self.replace.clicked.connect(lambda: replace_mesh(session, self))
        self.fit.clicked.connect(self._fit)
        self.ground.clicked.connect(self._put_down)
        self.top.clicked.connect(self._put_on_top)
        self.centre.clicked.connect(self._put_in_the_middle)
        live(session).changed.connect(self.refresh)
        session.selection_changed.connect(self.refresh)
        session.project_changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Follow what is selected."""
        item = selected_mesh(self.session)
        self.setVisible(item is not None)
        if item is None:
            return
        vertices = self._vertices(item)
        for button in (self.up, self.fit, self.ground, self.top, self.centre):
            if vertices is None and button.hasFocus():
                self.setFocus()  # Qt would give it to the next field, and keys of the 3D view would be typed there
            button.setEnabled(vertices is not None)
        axis = mesh_placing.up_axis(item)
        self.up.setText(f"{axis or 'Which'} is up")
        for name, action in self.axes.items():
            action.setChecked(name == axis)
        if vertices is None:
            self.told.setText("Hidden." if not item.visible else "Not read yet.")
        else:
            sides = vertices.max(axis=0) - vertices.min(axis=0)
            size = " x ".join(f"{1e3 * side:.4g}" for side in sides) + " mm along x, y, z of the file"
            met, around = self._met(item), self._around(item)
            may = f". May stand in {met}: their boxes overlap." if met else ""
            self.told.setText(f"{size}{around or may}")

    def _turn_up(self, axis: mesh_placing.UpAxis) -> None:
        def turned(item: SceneObject, vertices: Float) -> SceneObject:
            return mesh_placing.with_axis_up(item, vertices, axis)

        if self._place(f"{axis} up", turned) and (now := selected_mesh(self.session)) is not None:
            self.session.message.emit("info", f"{now.name} stands with {axis} of its file up; Ctrl+Z takes it back")

    def _fit(self) -> None:
        """The size of a part is what is measured: that it is another one now is said."""
        item, scene = selected_mesh(self.session), self.session.project.scene
        vertices = None if item is None else self._vertices(item)
        others = [] if item is None else self._others(item)
        self._place("scale to fit", lambda item, vertices: mesh_placing.fitted(item, vertices, scene, others))
        now = selected_mesh(self.session)
        if item is None or now is None or vertices is None or now is item:
            return
        by, length = now.scale / item.scale, Unit.of("m")
        before = float((vertices.max(axis=0) - vertices.min(axis=0)).max())
        sizes = " became ".join(f"{length.factor * size:.4g} {length.shown}" for size in (before, by * before))
        on_others = mesh_placing.rests(item, vertices, others)
        where = "the ground" if mesh_placing.stands(item, vertices) else "what is below it" if on_others else ""
        still = f"; it still stands on {where}" if where else ""
        self.session.message.emit("info", f"{now.name} is scaled by {by:.3g}: {sizes}{still}; Ctrl+Z takes it back")

    def _put_down(self) -> None:
        """How far it moved is said, or that it stood there."""
        before = selected_mesh(self.session)
        if before is None or not self._place("put on the ground", mesh_placing.on_ground):
            return
        now = selected_mesh(self.session) or before
        by = now.T_world_object.translation[2] - before.T_world_object.translation[2]
        told = f"{now.name} stood on the ground already: its lowest point is at height zero"
        if by != 0.0:
            far = f"{1e3 * abs(by):.4g} mm {'up' if by > 0.0 else 'down'}"
            told = f"{now.name} moved {far}, its lowest point to height zero; Ctrl+Z takes it back"
        self.session.message.emit("info", told)

    def _put_on_top(self) -> None:
        """Of what shares its place, seen from above."""
        item = selected_mesh(self.session)
        if item is None:
            return
        triangles = self._others(item)
        if self._place("put on top", lambda item, vertices: mesh_placing.on_top(item, vertices, triangles)):
            self._tell_move(item, "its lowest point to the top of what is below it, or to the ground", "on top")

    def _put_in_the_middle(self) -> None:
        item, motion = selected_mesh(self.session), self.session.project.scene.motion
        if item is None:
            return
        turns = isinstance(motion, Turntable)
        place = motion.centre if isinstance(motion, Turntable) else (0.0, 0.0, 0.0)
        if self._place("centre", lambda item, vertices: mesh_placing.centred(item, vertices, place)):
            over = "the turntable's axis point" if turns else "the origin"
            self._tell_move(item, f"the middle of its box over {over}", f"over {over}")

    def _tell_move(self, before: SceneObject, where: str, already: str) -> None:
        now = selected_mesh(self.session) or before
        by = np.subtract(now.T_world_object.translation, before.T_world_object.translation)
        far = 1e3 * float(np.linalg.norm(by))  # mm
        sense = "" if np.any(np.abs(by[:2]) > 1e-9) else " up" if by[2] > 0.0 else " down"
        moved = f"{now.name} moved {far:.4g} mm{sense}, {where}; Ctrl+Z takes it back"
        self.session.message.emit("info", moved if far >= LEAST_MOVE else f"{now.name} stood {already} already")

    def _others(self, item: SceneObject) -> list[Float]:
        """(t, 3, 3) m corners in the world of each other object."""
        look = live(self.session).look
        return [_triangles(one) for one in look.placed if _size(look.scene.visible_objects[one.index]) != _size(item)]

    def _place(self, label: str, change: Callable[[SceneObject, Float], SceneObject]) -> bool:
        """False: it cannot be done, which is told where there is something to tell."""
        item, session = selected_mesh(self.session), self.session
        vertices = None if item is None else self._vertices(item)
        if item is None or vertices is None:
            return False
        try:
            project = replaced(session.project, session.selection[:3], change(item, vertices))
        except InputError as error:
            session.message.emit("error", str(error))
            return False
        session.document.apply(f"{label}: {item.name}", project)
        return True

    def _met(self, item: SceneObject) -> str:
        """Names of what it may stand in."""
        look = live(self.session).look
        visible = [look.scene.visible_objects[one.index] for one in look.placed]
        index = next(i for i, one in enumerate(visible) if _size(one) == _size(item))
        boxes = [(one.body.bounds, one.T_world_object) for one in look.placed]
        own = transform_points(look.placed[index].T_world_object, look.placed[index].body.surface.vertices)
        near = mesh_placing.meeting(boxes, index)
        met = [k for k in near if mesh_placing.reaches_into(own, _triangles(look.placed[k]))]
        names = [visible[k].name for k in met]
        return ", ".join(names[:2]) + (f" and {len(names) - 2} more" if len(names) > 2 else "")

    def _around(self, item: SceneObject) -> str:
        """That camera or lasers are in it, as a sentence; empty: they are not."""
        look = live(self.session).look
        for one in inside(look):
            if _size(look.scene.visible_objects[one.index]) == _size(item):
                told = one.of("it")
                return f". {told[0].upper()}{told[1:]}; {CURE}"
        return ""

    def after_edit(self, owner: FieldPath, before: Project, after: Project) -> Project:
        """In another unit a part stands where it stood: about an origin elsewhere it would vanish below its table."""
        path = owner[:3]
        if path[:2] != OBJECTS or len(path) < 3:
            return after
        was, now = value_at(before, path), value_at(after, path)
        if (
            not (isinstance(was.shape, MeshFile) and isinstance(now.shape, MeshFile))
            or was.shape.unit == now.shape.unit
        ):
            return after
        vertices = self._vertices(was)
        factor = UNITS[now.shape.unit] / UNITS[was.shape.unit]
        return after if vertices is None else replaced(after, path, mesh_placing.on_its_foot(now, vertices, factor))

    def _vertices(self, item: SceneObject) -> Float | None:
        """(n, 3) m in the object's frame, as drawn, wherever that is; None: they are not, or of another size."""
        look = live(self.session).look
        found = (one for one in look.placed if _size(look.scene.visible_objects[one.index]) == _size(item))
        placed = next(found, None)
        return None if placed is None else placed.body.surface.vertices


def _triangles(placed: Placed) -> Float:
    """(t, 3, 3) m corners in the world."""
    surface = placed.body.surface
    return transform_points(placed.T_world_object, surface.vertices)[surface.triangles]


def _size(item: SceneObject) -> tuple[object, ...]:
    """All that its vertices hang on, and whose they are."""
    return item.name, item.shape, item.scale


def selected_mesh(session: Session) -> SceneObject | None:
    """The selected object, if it is one of a mesh file."""
    path = session.selection[:3]
    if path[:2] != OBJECTS or len(path) < 3:
        return None
    try:
        item = value_at(session.project, path)
    except KeyError:
        return None
    return item if isinstance(item, SceneObject) and isinstance(item.shape, MeshFile) else None


def replace_mesh(session: Session, parent: QWidget) -> None:
    """A mesh for the selected object, of a file or not, as a person picks it; told where none is selected."""
    path = session.selection[:3]
    if path[:2] != OBJECTS or len(path) < 3:
        session.message.emit("error", "select an object first: the mesh takes the place of its shape")
        return
    file = mesh_importer.choose_mesh(session, parent)
    if file is not None:
        take = partial(take_mesh, session, path)
        mesh_importer.import_meshes(session, [file], parent, take)


def take_mesh(session: Session, path: FieldPath, mesh: ImportedMesh) -> None:
    """Make a mesh that was read the shape of an object, unless that is gone meanwhile."""
    try:
        project = replace_mesh_of(session.project, path, mesh)
    except KeyError:
        session.message.emit("error", "the object whose mesh was to be replaced is no longer there")
        return
    session.document.apply(f"use {Path(mesh.path).name}", project)
    now = value_at(project, path)
    if now.scale != 1.0:
        size = " x ".join(f"{1e3 * now.scale * side:.4g}" for side in mesh.size)
        told = f"The scale of {now.name}, {now.scale:g}, stays, and makes {size} mm of {Path(mesh.path).name}"
        session.message.emit("warning", f"{told}: Scale to fit or the field Scale changes it")
