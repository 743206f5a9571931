"""What can be done to the scene and its selection, for tree, menus and shortcuts alike: one undoable edit each."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu, QWidget

from analysis.report.units import counted
from render.base.errors import InputError
from render.scene.lights import PointLight, RectangleLight
from render.scene.motion import LinearStage, NoMotion, PoseList, Turntable
from render.scene.scene import SceneObject
from render.scene.shape import Box, Cylinder, Plane, Sphere, StepBlock, VGroove, WeldTee
from studio.editing import scene_edits
from studio.editing.forms import kind_label
from studio.editing.presets import Preset, leaves_focus_open, presets_for, with_preset
from studio.editing.refusals import refusal
from studio.editing.units import Unit
from studio.preview.focusing import line_depth, looked_at
from studio.project.document import FieldPath, value_at
from studio.project.project import Project
from studio.qt.core.live_preview import live
from studio.qt.core.menu_tips import show_tips
from studio.qt.core.session import Session
from studio.qt.scene.mesh_importer import choose_meshes
from studio.qt.scene.scene_icons import scene_icon

PRIMITIVES = (Plane, Box, Sphere, Cylinder, StepBlock, VGroove, WeldTee)
MOTIONS = (NoMotion, LinearStage, Turntable, PoseList)
Edit = Callable[[Project], scene_edits.Result]


def apply(session: Session, label: str, edit: Edit, told: str = "") -> bool:
    """Make an edit current and select what it made; a refusal is told, changes nothing and is False.

    told: what begins the words of a refusal.
    """
    try:
        project, path = edit(session.project)
    except InputError as error:
        session.message.emit("error", f"{told}{refusal(error)}")
        return False
    session.document.apply(label, project)
    session.select(path)
    return True


def can_change(session: Session) -> bool:
    """The selection can be removed, copied, renamed and moved."""
    return scene_edits.in_list(session.selection) and _exists(session)


def undo(session: Session) -> None:
    """Take the last edit back, and say which: what was told of it does not hold any more."""
    if label := session.document.undo_label:
        session.document.undo()
        session.message.emit("info", f"undone: {label}")


def redo(session: Session) -> None:
    """Make the edit again that was taken back last."""
    if label := session.document.redo_label:
        session.document.redo()
        session.message.emit("info", f"done again: {label}")


def remove(session: Session) -> None:
    """Remove all that is selected; a neighbour is selected."""
    if can_change(session):
        paths = _changeable(session)
        what, measures = _name_of(session, paths), len(session.project.measures)
        if apply(session, f"delete {what}", lambda project: scene_edits.remove_all(project, paths)):
            gone = measures - len(session.project.measures)
            told = f" and {counted(gone, 'measure')} of what it found" if gone else ""
            session.message.emit("info", f"deleted {what}{told} (Ctrl+Z brings it back)")


def duplicate(session: Session) -> None:
    """A copy of each that is selected; the copies are selected."""
    if can_change(session):
        paths = _changeable(session)
        project, copies = scene_edits.duplicate_all(session.project, paths)
        session.document.apply(f"duplicate {_name_of(session, paths)}", project)
        session.select_all(copies)


def toggle_visible(session: Session, path: FieldPath | None = None) -> None:
    """Hide or show an object; unless one is given, all that are selected, as the one that panels show is not."""
    given, path = path, session.selection if path is None else path
    if not scene_edits.in_list(path) or not isinstance(item := value_at(session.project, path), SceneObject):
        return
    chosen = [path] if given else [one for one in session.selections if one[:-1] == scene_edits.OBJECTS]
    project = session.project
    for one in chosen:
        project = scene_edits.set_visible(project, one, not item.visible)
    session.document.apply(f"{'hide' if item.visible else 'show'} {_name_of(session, chosen)}", project)


def move(session: Session, by: int) -> None:
    """The selection up or down in its list."""
    path = session.selection
    if can_change(session):
        apply(session, "move in the list", lambda project: scene_edits.move(project, path, int(path[-1]) + by))


def move_to(session: Session, path: FieldPath, index: int) -> None:
    """An item to another place in its list."""
    if scene_edits.in_list(path):
        apply(session, "move in the list", lambda project: scene_edits.move(project, path, index))


def fill_add_menu(menu: QMenu, session: Session, parent: QWidget, what: str = "") -> None:
    """Entries that add things: everything, or only "lasers", "objects" or "lights"."""
    if what in ("", "lasers"):
        _entry(menu, "Line laser", "lasers", lambda: apply(session, "add laser", scene_edits.add_laser))
    if what in ("", "objects"):
        _separate(menu)
        for kind in PRIMITIVES:
            name = kind_label(kind)

            def add(kind: scene_edits.Kind = kind, name: str = name) -> None:
                apply(session, f"add {name.lower()}", lambda project: scene_edits.add_primitive(project, kind))

            _entry(menu, name, kind.model_fields["kind"].default, add)
        _entry(menu, "Mesh file…", "file", lambda: choose_meshes(session, parent))
    if what in ("", "lights"):
        _separate(menu)
        for light, name, icon in ((PointLight, "Point light", "lights"), (RectangleLight, "Panel light", "rectangle")):

            def add_light(light: type = light, name: str = name) -> None:
                apply(session, f"add {name.lower()}", lambda project: scene_edits.add_light(project, light))

            _entry(menu, name, icon, add_light)


def fill_motion_menu(menu: QMenu, session: Session) -> None:
    """Entries that choose the kind of motion."""
    now = type(session.project.scene.motion)
    for kind in MOTIONS:
        name = kind_label(kind)

        def choose(kind: type = kind, name: str = name) -> None:
            apply(session, f"motion: {name.lower()}", lambda project: scene_edits.set_motion(project, kind))

        action = _entry(menu, name, "", choose)
        action.setCheckable(True)
        action.setChecked(kind is now)


def fill_presets_menu(menu: QMenu, session: Session) -> None:
    """Presets for the selection, or one entry that says that there are none."""
    show_tips(menu)
    path = session.selection
    found = presets_for(session.project, path) if _exists(session) else ()
    for preset in found:

        def use(preset: Preset = preset) -> None:
            def edit(project: Project) -> scene_edits.Result:
                return _with_preset(session, project, path, preset), path

            refused = f"{preset.name} is not taken, nothing has changed: "
            if apply(session, f"preset {preset.name}", edit, refused):
                session.message.emit("info", f"{preset.name}{_focused(session.project, preset)}. {preset.source}")

        # rich text, so that a tool tip breaks its lines
        _entry(menu, preset.name, "", use).setToolTip(f"<p>{preset.source}</p>")
    if not found:
        menu.addAction("Select the camera, the sensor, a laser or an object").setEnabled(False)


def _with_preset(session: Session, project: Project, path: FieldPath, preset: Preset) -> Project:
    """A lens whose preset says no focus is focused on the line that it sees, else where the one before looked."""
    taken = with_preset(project, path, preset)
    if not leaves_focus_open(preset):
        return taken
    depth = line_depth(live(session).look_at(taken)) or looked_at(project.scene)
    return with_preset(project, path, preset, depth)


def _focused(project: Project, preset: Preset) -> str:
    focus = project.scene.camera.lens.focus_distance
    if not leaves_focus_open(preset):
        return ""
    return ", focused far away" if focus is None else f", focused at {Unit.of('m').with_unit(focus)}"


def _changeable(session: Session) -> list[FieldPath]:
    """All that is selected and can be removed or copied, the one that panels show last."""
    return [path for path in session.selections if scene_edits.in_list(path)]


def _name_of(session: Session, paths: Sequence[FieldPath]) -> str:
    return str(value_at(session.project, paths[-1]).name) if len(paths) == 1 else f"{len(paths)} items"


def _exists(session: Session) -> bool:
    try:
        value_at(session.project, session.selection)
    except KeyError:
        return False
    return True


def _entry(menu: QMenu, text: str, icon: str, handler: Callable[[], object]) -> QAction:
    action = QAction(text, menu)
    if icon:
        action.setIcon(scene_icon(icon))
    action.triggered.connect(lambda _checked=False: handler())
    menu.addAction(action)
    return action


def _separate(menu: QMenu) -> None:
    if not menu.isEmpty():
        menu.addSeparator()
