"""The 3D viewport: the scene as it stands, with sheets, lit curves and working volume, moved about by hand."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtGui import QCloseEvent, QHideEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import QApplication, QToolTip, QVBoxLayout, QWidget
from vtkmodules.vtkRenderingCore import vtkActor, vtkCellPicker

from render.base.arrays import Float
from studio.editing.placement import working_distance
from studio.editing.scene_edits import aim_laser
from studio.preview.ray_pick import mesh_hit
from studio.preview.view_camera import STANDARD, through, turntable
from studio.project.document import FieldPath, value_at
from studio.qt.core import theme
from studio.qt.core.actions import VIEW_KEYS
from studio.qt.core.laser_box import laser_of
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session
from studio.qt.viewport.board_ghost import BoardGhost
from studio.qt.viewport.box_tool import BoxTool
from studio.qt.viewport.gizmo import Gizmo
from studio.qt.viewport.handle_tool import Tools
from studio.qt.viewport.section_plane import SectionPlane
from studio.qt.viewport.snap_move import SnapMove
from studio.qt.viewport.typed_move import TypedMove
from studio.qt.viewport.view3d import View3D
from studio.qt.viewport.viewport_bar import ViewportBar
from studio.qt.viewport.viewport_scene import CAMERA, LASERS, ViewportScene, object_path

HOVER_MS = 120
PICK_TOLERANCE = 0.006
"""Of the view's diagonal; how near the mouse must be to a line."""


class Viewport(QWidget):
    """Left: select (Ctrl: several), or turn the view; middle, right, or Shift and left: shift it; wheel: zoom."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session, self.live = session, live(session)
        self.view = View3D(self)
        self.scene = ViewportScene(self.view.renderer)
        self.ghost = BoardGhost(session, self.view)
        self.gizmo = Gizmo(session, self.live, self.view)
        self.section = SectionPlane(session, self.view)
        self.typed = TypedMove(self.gizmo, self.view)
        self.snap = SnapMove(self.gizmo, self.live, self.view)
        self.box = BoxTool(self.view)
        self._tools = Tools(self.section, self.gizmo)
        self.view.tool = self._tools
        self.view.before_paint = self._tools.draw
        self.bar = ViewportBar(self)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.bar)
        layout.addWidget(self.view, 1)
        self._frame_soon = True
        self._picker = vtkCellPicker()
        self._picker.SetTolerance(PICK_TOLERANCE)
        self._picker.PickFromListOn()
        self._hover_at = QPoint()
        self._hover = QTimer(self, singleShot=True, interval=HOVER_MS)
        self._hover.timeout.connect(self._tell_name)
        self._connect()
        self.bar.tell_loading(self.live.is_loading)
        self._paint()
        self._draw()

    def path_at(self, x: float, y: float) -> FieldPath:
        """What is under a point of the view; () for nothing."""
        origin, direction = self.view.eye.ray(x, y, self.view.pixels)
        found, distance = self._mesh_hit(origin, direction)
        for actors, always in ((self.scene.solids(), True), (self.scene.veils(), not found)):
            if not always:
                continue
            hit = self._pick(actors, x, y)
            if hit is not None:
                far = float(np.linalg.norm(np.array(self._picker.GetPickPosition()) - origin))
                # a line on a surface is as far away as the surface
                if far < distance * 1.002 + 1e-6:
                    return hit
        return found

    def frame(self, path: FieldPath = ()) -> None:
        """Bring an item, or everything, into the middle of the view."""
        self._leave()
        eye = self.view.eye
        # the first view is of what is measured; who asks for everything gets the lamps as well
        low, high = self.scene.bounds(self.live.look, path, lamps=not self._frame_soon and not path)
        self.view.look_from(eye.framed(low, high, self.view.pixels))

    def look_along(self, name: str) -> None:
        """A standard view: "front", "left", "top" or "iso"."""
        self._leave()
        self.view.look_from(replace(self.view.eye, rotation=turntable(*STANDARD[name])))

    def look_through(self, path: FieldPath) -> None:
        """Through the camera, or a laser, until the view is turned by hand."""
        self.scene.look_through(path)
        self._follow_through()
        self.bar.tell_through(path)

    def look_through_laser(self) -> None:
        """Through the selected laser, else the first."""
        chosen = self._laser()
        if chosen:
            self.look_through(chosen)

    def begin_aim(self, on: bool = True) -> None:
        """The next click on a surface aims the selected laser, else the first, at it; off: it selects, as ever."""
        if on and not self._laser():
            self.session.message.emit("error", "the scene has no laser to aim")
            on = False
        on = on and not self.session.dragging
        self.bar.aim.setChecked(on)
        self.bar.tell("click what the laser is to light, here or in the camera view; Esc: back" if on else "")
        self.view.tool = None if on else self._tools  # its handles may lie over what is to be lit
        self.view.setCursor(Qt.CursorShape.CrossCursor if on else Qt.CursorShape.ArrowCursor)

    def aim_at(self, x: float, y: float) -> None:
        """Turn the laser to the surface under a point of the view; one step to undo."""
        self._aim_along(*self.view.eye.ray(x, y, self.view.pixels))

    def aim_at_pixel(self, column: float, row: float, current: bool) -> None:
        """The same by a pixel of the camera, while a laser is being aimed. current: as `Session.pixel_clicked`."""
        if not self.bar.aim.isChecked():
            return
        if not current:
            message = "that picture is of the scene before it was changed; choose the live estimate, and click there"
            self.session.message.emit("error", message)
            return
        scene = self.live.look.scene
        directions, valid = scene.camera.rays(np.array([[column, row]]))
        T_world_camera = scene.T_world_camera(self.live.step)
        if valid[0]:
            self._aim_along(T_world_camera[:3, 3], T_world_camera[:3, :3] @ directions[0])

    def give_up(self) -> bool:
        """Escape: what the next click or key would do is not done; False: nothing was waiting for one."""
        if self.bar.aim.isChecked():
            self.begin_aim(False)
            return True
        waiting = next((mode for mode in (self.typed, self.snap, self.box) if mode.active), None)
        if waiting is not None:
            waiting.cancel()
        return waiting is not None

    def _aim_along(self, origin: Float, direction: Float) -> None:
        distance = self._mesh_hit(origin, direction)[1]
        if not math.isfinite(distance):
            self.session.message.emit("error", "no surface is there; click on an object to aim the laser at it")
            return
        session, laser = self.session, int(self._laser()[3])
        project, path = aim_laser(session.project, laser, origin + distance * direction, self.live.step)
        session.document.apply(f"aim {session.project.scene.lasers[laser].name}", project)
        session.select(path)
        self.begin_aim(False)

    def _laser(self) -> FieldPath:
        """Of the selected laser, else of the first; () without any."""
        count, selected = len(self.session.project.scene.lasers), laser_of(self.session.selection)
        own = selected if selected is not None and selected < count else 0
        return (*LASERS, own) if count else ()

    def _clicked(self, x: float, y: float) -> None:
        if self.typed.active:
            self.typed.end()
        elif self.snap.active:
            self.snap.click(x, y)
        elif self.bar.aim.isChecked():
            self.aim_at(x, y)
        else:
            path = self.path_at(x, y)
            several = QApplication.keyboardModifiers() & Qt.KeyboardModifier.ControlModifier
            if not several:
                self.session.select(path)
            elif path:
                self.session.select_also(path)

    def set_parallel(self, parallel: bool) -> None:
        """Parallel projection: lengths across the view compare."""
        self.view.look_from(replace(self.view.eye, parallel=parallel))

    def set_local(self, local: bool) -> None:
        """The gizmo's axes: the item's own, or the world's."""
        self.gizmo.set_local(local)
        self.bar.tell_local(local)

    def show_part(self, what: str, on: bool) -> None:
        """ "sheets", "frustum", "volume" or "grid"."""
        self.scene.show(what, on)
        self.view.redraw()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self.give_up()  # in another workspace the next click means something else

    def closeEvent(self, event: QCloseEvent) -> None:
        self._hover.stop()
        self.live.close()
        self.view.close()
        super().closeEvent(event)

    def _connect(self) -> None:
        session, view = self.session, self.view
        self.live.changed.connect(self._draw)
        self.live.loading.connect(self.bar.tell_loading)
        session.selection_changed.connect(self._highlight)
        session.document_replaced.connect(self._start_anew)
        session.pixel_clicked.connect(self.aim_at_pixel)
        session.frame_requested.connect(lambda: self.frame(session.selection))
        theme.notice.changed.connect(self._paint)
        view.clicked.connect(self._clicked)
        view.double_clicked.connect(self._frame_at)
        view.hovered.connect(self._hover_later)
        view.left.connect(self._hover.stop)
        view.navigated.connect(self._leave)
        for told in (*(tool.told for tool in self._tools.tools), self.typed.told, self.snap.told, self.box.told):
            told.connect(self.bar.tell)
        handlers: dict[str, Callable[[], None]] = {
            "1": lambda: self.look_along("front"),
            "2": lambda: self.look_along("left"),
            "3": lambda: self.look_along("top"),
            "4": lambda: self.look_along("iso"),
            "5": lambda: self.set_parallel(not self.view.eye.parallel),
            "C": lambda: self.look_through(CAMERA),
            "L": self.look_through_laser,
            "F": lambda: self.frame(self.session.selection),
            "A": self.frame,
            "X": lambda: self.set_local(not self.gizmo.local),
            "T": lambda: self.begin_aim(not self.bar.aim.isChecked()),
            "G": lambda: self.typed.begin(turns=False),
            "R": lambda: self.typed.begin(turns=True),
            "V": self.snap.begin,
            "B": self.box.begin,
        }
        for key in VIEW_KEYS:
            shortcut = QShortcut(QKeySequence(key), self)
            shortcut.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
            shortcut.activated.connect(handlers[key])

    def _draw(self) -> None:
        if not self.live.ready:
            return
        look = self.live.look
        settled = not self.session.dragging
        self.scene.draw(look, self.session.selections, settled=settled)
        self.bar.tell_spacing(self.scene.spacing)
        if self._frame_soon:
            self.view.look_from(replace(self.view.eye, rotation=turntable(*STANDARD["iso"])))
            self.frame()
            self._frame_soon = self.live.is_loading
        if self.scene.through:
            self._follow_through()
        self.view.redraw()

    def _highlight(self) -> None:
        if self.live.ready:
            self.scene.highlight(self.live.look, self.session.selections)
        self.view.redraw()

    def _paint(self) -> None:
        self.scene.paint(theme.colours())
        self._highlight()

    def _start_anew(self) -> None:
        self._leave()
        self.begin_aim(False)
        self._frame_soon = True

    def _leave(self) -> None:
        if self.scene.through:
            self.scene.look_through(())
            self.bar.tell_through(())

    def _follow_through(self) -> None:
        """The eye stays at the camera or laser that is looked through."""
        scene, step, path = self.live.look.scene, self.live.step, self.scene.through
        width, height = self.view.pixels
        distance = working_distance(scene)
        if path == CAMERA:
            camera = scene.camera
            # the whole image fits, whatever the shape of the view
            tangent = max(camera.height / 2 / camera.fy, camera.width / 2 / camera.fx * height / width)
            T = scene.T_world_camera(step)
        elif path and int(path[3]) < len(scene.lasers):
            laser = scene.lasers[int(path[3])]
            tangent, T = max(laser.tan_half_fan, 0.05), scene.T_world_laser(int(path[3]), step)
        else:
            self._leave()
            return
        self.view.look_from(through(T, distance, 2.0 * math.degrees(math.atan(1.02 * tangent))))

    def _frame_at(self, x: float, y: float) -> None:
        path = self.path_at(x, y)
        self.session.select(path)
        self.frame(path)

    def _hover_later(self, x: float, y: float) -> None:
        self._hover_at = QPoint(round(x), round(y))
        QToolTip.hideText()
        self._hover.start()

    def _tell_name(self) -> None:
        at = self._hover_at
        path = self.path_at(at.x(), at.y())
        if path:
            name = getattr(value_at(self.session.project, path), "name", "") or str(path[-1])
            QToolTip.showText(self.view.mapToGlobal(at), name, self.view)

    def _mesh_hit(self, origin: Float, direction: Float) -> tuple[FieldPath, float]:
        """The nearest mesh on a ray, by the preview's own embree scenes."""
        look = self.live.look
        hit = mesh_hit(look, origin, direction)
        return ((), math.inf) if hit is None else (object_path(look, hit.placed.index), hit.distance)

    def _pick(self, actors: list[vtkActor], x: float, y: float) -> FieldPath | None:
        self.view.aim()
        self._picker.InitializePickList()
        for actor in actors:
            self._picker.AddPickList(actor)
        ratio, height = self.view.devicePixelRatioF(), self.view.height()
        if not self._picker.Pick(x * ratio, (height - 1 - y) * ratio, 0.0, self.view.renderer):
            return None
        return self.scene.paths.get(self._picker.GetActor())
