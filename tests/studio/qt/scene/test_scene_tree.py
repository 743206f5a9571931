"""The scene tree, with real keys and mouse: select, rename, hide, copy, remove, add, and meshes dropped in."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import trimesh
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDragMoveEvent, QDropEvent
from PySide6.QtWidgets import QApplication, QLineEdit, QMenu, QMessageBox
from pytestqt.qtbot import QtBot

from render.scene.shape import Box
from studio.editing import scene_edits
from studio.editing.scene_edits import LASERS, LIGHTS, OBJECTS
from studio.project.document import Document, FieldPath
from studio.project.project import Project
from studio.project.step_file import LARGEST_CHORD, LEAST_CHORD, parts_of
from studio.project.templates import template_folder
from studio.qt.core.session import Session
from studio.qt.scene import mesh_importer, scene_actions
from studio.qt.scene.scene_tree import DETAIL, EYE, NAME, SceneTree
from tests.studio.project.step_text import BOX, glb


@pytest.fixture
def tree(session: Session, qtbot: QtBot) -> Iterator[SceneTree]:
    panel = SceneTree(session)
    qtbot.addWidget(panel)
    panel.resize(280, 600)
    panel.show()
    qtbot.waitExposed(panel)
    panel.activateWindow()
    qtbot.waitUntil(panel.isActiveWindow)
    yield panel


def click(qtbot: QtBot, tree: SceneTree, path: FieldPath, column: int = NAME) -> None:
    index = tree.indexFromItem(tree.item(path), column)
    qtbot.mouseClick(tree.viewport(), Qt.MouseButton.LeftButton, pos=tree.visualRect(index).center())


def key(qtbot: QtBot, tree: SceneTree, pressed: Qt.Key, held: Qt.KeyboardModifier | None = None) -> None:
    qtbot.keyClick(tree, pressed, held or Qt.KeyboardModifier.NoModifier)


def entry(menu: QMenu, *texts: str) -> object:
    """Trigger an entry of a menu, or of a menu in it."""
    for text in texts[:-1]:
        menu = next(action for action in menu.actions() if action.text() == text).menu()
    return next(action for action in menu.actions() if action.text().split("\t")[0] == texts[-1])


def names(session: Session, path: FieldPath = OBJECTS) -> list[str]:
    scene = session.project.scene
    items = {OBJECTS: scene.objects, LASERS: scene.lasers, LIGHTS: scene.lights}[path]
    return [item.name for item in items]


class TestShowing:
    def test_everything_in_the_project_has_its_place(self, session: Session, tree: SceneTree) -> None:
        root = tree.item(())
        assert root.text(NAME) == "Step block on a linear stage"
        assert [root.child(i).text(NAME) for i in range(root.childCount())] == [
            "Rig", "Objects", "Lights", "Environment", "Motion", "Sensor", "Render", "Extraction",
            "Report"]  # fmt: skip
        assert tree.item((*OBJECTS, 1)).text(NAME) == "step block"
        assert tree.item(("scene", "motion")).data(NAME, DETAIL) == "linear stage, 20 frames"
        assert tree.item((*LASERS, 0)).data(NAME, DETAIL) == "20 mW, 450 nm"

    def test_it_follows_edits_and_their_undoing(self, session: Session, tree: SceneTree) -> None:
        session.document.apply("add", scene_edits.add_laser(session.project)[0])
        assert tree.item((*LASERS, 1)).text(NAME) == "laser 2"
        session.set((*LASERS, 0, "power"), 0.05)
        assert tree.item((*LASERS, 0)).data(NAME, DETAIL) == "50 mW, 450 nm"
        session.document.undo()
        session.document.undo()
        assert tree.item(LASERS).childCount() == 1

    def test_a_drag_updates_items_in_place(self, session: Session, tree: SceneTree) -> None:
        item = tree.item((*LASERS, 0))
        for i in range(20):
            session.set((*LASERS, 0, "power"), 0.02 + 0.001 * i, merge="drag")
        assert tree.item((*LASERS, 0)) is item

    def test_folded_branches_stay_folded(self, session: Session, tree: SceneTree) -> None:
        tree.item(LIGHTS).setExpanded(False)
        session.document.apply("add", scene_edits.add_laser(session.project)[0])
        assert not tree.item(LIGHTS).isExpanded()
        assert tree.item(LASERS).isExpanded()

    def test_another_document_is_shown(self, session: Session, tree: SceneTree) -> None:
        session.replace_document(Document(Project.load(template_folder("sphere") / "project.json")))
        assert tree.item(()).text(NAME) == session.project.name
        assert tree.item(OBJECTS).childCount() == len(session.project.scene.objects)


class TestSelecting:
    def test_a_click_selects_for_everyone(self, qtbot: QtBot, session: Session, tree: SceneTree) -> None:
        click(qtbot, tree, (*OBJECTS, 1))
        assert session.selection == (*OBJECTS, 1)
        click(qtbot, tree, ("sensor",))
        assert session.selection == ("sensor",)

    def test_a_selection_made_elsewhere_is_shown(self, session: Session, tree: SceneTree) -> None:
        session.select((*LASERS, 0))
        assert tree.item((*LASERS, 0)).isSelected()
        assert len(tree.selectedItems()) == 1

    def test_an_item_that_an_undo_takes_away_is_no_longer_selected(self, session: Session, tree: SceneTree) -> None:
        scene_actions.apply(session, "add", scene_edits.add_laser)
        assert session.selection == (*LASERS, 1)
        session.document.undo()
        assert session.selection == LASERS

    def test_a_double_click_frames(self, qtbot: QtBot, session: Session, tree: SceneTree) -> None:
        click(qtbot, tree, (*OBJECTS, 1))
        place = tree.visualRect(tree.indexFromItem(tree.item((*OBJECTS, 1)))).center()
        with qtbot.waitSignal(session.frame_requested):
            qtbot.mouseDClick(tree.viewport(), Qt.MouseButton.LeftButton, pos=place)


class TestEditing:
    def rename(self, qtbot: QtBot, tree: SceneTree, path: FieldPath, name: str) -> None:
        click(qtbot, tree, path)
        key(qtbot, tree, Qt.Key.Key_F2)
        editor = tree.viewport().findChild(QLineEdit)
        assert editor is not None
        editor.selectAll()
        qtbot.keyClicks(editor, name)
        qtbot.keyClick(editor, Qt.Key.Key_Return)
        qtbot.waitUntil(lambda: tree.state() != SceneTree.State.EditingState)

    def test_f2_renames(self, qtbot: QtBot, session: Session, tree: SceneTree) -> None:
        self.rename(qtbot, tree, (*OBJECTS, 1), "stairs")
        assert names(session) == ["table", "stairs"]
        session.document.undo()
        assert tree.item((*OBJECTS, 1)).text(NAME) == "step block"

    def test_the_projects_own_name_too(self, qtbot: QtBot, session: Session, tree: SceneTree) -> None:
        self.rename(qtbot, tree, (), "Mine")
        assert session.project.name == "Mine"

    def test_a_taken_name_is_refused_and_the_old_one_shown(
        self, qtbot: QtBot, session: Session, tree: SceneTree
    ) -> None:
        told: list[str] = []
        session.message.connect(lambda level, text: told.append(f"{level}: {text}"))
        self.rename(qtbot, tree, (*OBJECTS, 1), "table")
        assert names(session) == ["table", "step block"]
        assert tree.item((*OBJECTS, 1)).text(NAME) == "step block"
        assert told and told[0].startswith("error") and "another object has this name" in told[0]
        assert session.document.undo_label is None

    def test_what_has_no_name_is_not_renamed(self, qtbot: QtBot, session: Session, tree: SceneTree) -> None:
        click(qtbot, tree, ("sensor",))
        key(qtbot, tree, Qt.Key.Key_F2)
        assert tree.viewport().findChild(QLineEdit) is None

    def test_delete_and_duplicate_by_key(self, qtbot: QtBot, session: Session, tree: SceneTree) -> None:
        click(qtbot, tree, (*OBJECTS, 1))
        key(qtbot, tree, Qt.Key.Key_D, Qt.KeyboardModifier.ControlModifier)
        assert names(session) == ["table", "step block", "step block 2"]
        assert session.selection == (*OBJECTS, 2)
        for _ in range(2):
            with qtbot.waitSignal(session.message, check_params_cb=lambda _, text: text.startswith("deleted")):
                key(qtbot, tree, Qt.Key.Key_Delete)
        assert names(session) == ["table"]
        assert session.selection == (*OBJECTS, 0)
        for _ in range(2):
            session.document.undo()
        assert names(session) == ["table", "step block", "step block 2"]

    def test_delete_on_what_must_stay_does_nothing(self, qtbot: QtBot, session: Session, tree: SceneTree) -> None:
        before = session.project
        for path in ((), ("scene", "rig", "camera"), OBJECTS, ("sensor",)):
            click(qtbot, tree, path)
            key(qtbot, tree, Qt.Key.Key_Delete)
            key(qtbot, tree, Qt.Key.Key_D, Qt.KeyboardModifier.ControlModifier)
        assert session.project is before

    def test_the_eye_hides_and_shows_without_selecting(self, qtbot: QtBot, session: Session, tree: SceneTree) -> None:
        click(qtbot, tree, ("sensor",))
        click(qtbot, tree, (*OBJECTS, 0), EYE)
        assert not session.project.scene.objects[0].visible
        assert session.selection == ("sensor",)
        assert tree.item((*OBJECTS, 0)).toolTip(EYE) == "Show"
        click(qtbot, tree, (*OBJECTS, 0), EYE)
        assert session.project.scene.objects[0].visible
        click(qtbot, tree, (*LASERS, 0), EYE)
        assert session.document.undo_label == "show table"


class TestMenus:
    def test_everything_can_be_added(self, session: Session, tree: SceneTree) -> None:
        for name in ("Plane", "Box", "Sphere", "Cylinder", "Step block", "V groove", "Weld tee"):
            entry(tree.menu_for(OBJECTS), "Add", name).trigger()
            assert session.selection == (*OBJECTS, len(session.project.scene.objects) - 1)
        assert names(session)[2:] == ["plane", "box", "sphere", "cylinder", "step block 2", "v groove", "weld tee"]
        entry(tree.menu_for(LASERS), "Add", "Line laser").trigger()
        entry(tree.menu_for(()), "Add", "Point light").trigger()
        entry(tree.menu_for(LIGHTS), "Add", "Panel light").trigger()
        assert names(session, LASERS) == ["laser", "laser 2"]
        assert names(session, LIGHTS)[1:] == ["lamp", "panel 2"]
        for _ in range(10):
            session.document.undo()
        assert session.document.undo_label is None
        assert names(session) == ["table", "step block"]

    def test_items_are_moved_hidden_copied_and_removed(self, session: Session, tree: SceneTree) -> None:
        session.select((*OBJECTS, 0))
        menu = tree.menu_for((*OBJECTS, 0))
        assert not entry(menu, "Move up").isEnabled()
        entry(menu, "Move down").trigger()
        assert names(session) == ["step block", "table"]
        assert session.selection == (*OBJECTS, 1)
        entry(tree.menu_for((*OBJECTS, 1)), "Hide").trigger()
        assert not session.project.scene.objects[1].visible
        entry(tree.menu_for((*OBJECTS, 1)), "Duplicate").trigger()
        assert names(session) == ["step block", "table", "table 2"]
        entry(tree.menu_for((*OBJECTS, 2)), "Delete").trigger()
        assert names(session) == ["step block", "table"]

    def test_motion_presets_and_framing(self, qtbot: QtBot, session: Session, tree: SceneTree) -> None:
        session.select(("scene", "motion"))
        entry(tree.menu_for(("scene", "motion")), "Turntable").trigger()
        assert session.project.scene.motion.kind == "turntable"
        session.select((*LASERS, 0))
        green = next(a for a in entry(tree.menu_for((*LASERS, 0)), "Presets").menu().actions() if "520" in a.text())
        green.trigger()
        assert session.project.scene.lasers[0].wavelength_nm == 520.0
        with qtbot.waitSignal(session.frame_requested):
            entry(tree.menu_for((*LASERS, 0)), "Frame in the 3D view").trigger()

    def test_a_menu_without_a_fitting_selection_says_so(self, session: Session, tree: SceneTree) -> None:
        session.select(("scene", "motion"))
        menu = QMenu()
        scene_actions.fill_presets_menu(menu, session)
        assert [action.isEnabled() for action in menu.actions()] == [False]


@pytest.mark.filterwarnings("ignore:.*QDragEnterEvent:DeprecationWarning")  # takes QPointF only from Qt 6.12 on
class TestOrder:
    def drop(self, tree: SceneTree, dragged: FieldPath, onto: FieldPath, below: bool) -> bool:
        """Drag an item as Qt does once the mouse has moved: events of the drag, and the drop if it is taken."""
        tree._dragged = dragged
        data = tree.mimeData([tree.item(dragged)])
        box = tree.visualItemRect(tree.item(onto))
        at = QPoint(box.center().x(), box.bottom() - 1 if below else box.top() + 1)
        action, button, free = Qt.DropAction.CopyAction, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
        enter = QDragEnterEvent(at, action, data, button, free)
        QApplication.sendEvent(tree.viewport(), enter)
        assert enter.isAccepted()
        move = QDragMoveEvent(at, action, data, button, free)
        QApplication.sendEvent(tree.viewport(), move)
        if move.isAccepted():
            QApplication.sendEvent(tree.viewport(), QDropEvent(QPointF(at), action, data, button, free))
        QApplication.processEvents()
        tree._dragged = ()
        return move.isAccepted()

    def test_an_object_is_dragged_to_another_place_and_undone(self, session: Session, tree: SceneTree) -> None:
        apply_many(session, 2)
        before = names(session)
        assert len(before) >= 3
        last = (*OBJECTS, len(before) - 1)
        assert self.drop(tree, last, (*OBJECTS, 0), below=False)
        assert names(session) == [before[-1], *before[:-1]] and session.selection == (*OBJECTS, 0)
        assert self.drop(tree, (*OBJECTS, 0), (*OBJECTS, 1), below=True)
        assert names(session) == [before[0], before[-1], *before[1:-1]]
        session.document.undo()
        session.document.undo()
        assert names(session) == before

    def test_it_stays_in_its_own_list_and_where_it_is(self, session: Session, tree: SceneTree) -> None:
        before = session.project
        assert not self.drop(tree, (*OBJECTS, 0), (*LASERS, 0), below=True)
        assert not self.drop(tree, (*OBJECTS, 0), (*OBJECTS, 0), below=True)
        assert session.project is before

    def test_what_is_in_no_list_is_not_dragged(self, tree: SceneTree) -> None:
        assert tree.item((*OBJECTS, 0)).flags() & Qt.ItemFlag.ItemIsDragEnabled
        for path in (("sensor",), OBJECTS, ("scene", "rig", "camera")):
            assert not tree.item(path).flags() & Qt.ItemFlag.ItemIsDragEnabled


def apply_many(session: Session, count: int) -> None:
    for _ in range(count):
        scene_actions.apply(session, "add box", lambda project: scene_edits.add_primitive(project, Box))


class TestDropping:
    @pytest.fixture
    def outside(self, tmp_path_factory: pytest.TempPathFactory) -> Path:
        file = tmp_path_factory.mktemp("downloads") / "part.stl"
        trimesh.creation.box((100, 50, 20)).export(file)
        return file

    def drop(self, tree: SceneTree, *files: Path) -> bool:
        """Whether the tree takes it."""
        data = QMimeData()
        data.setUrls([QUrl.fromLocalFile(str(file)) for file in files])
        actions, left, none = Qt.DropAction.CopyAction, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
        enter = QDragEnterEvent(QPoint(20, 20), actions, data, left, none)
        enter.ignore()
        QApplication.sendEvent(tree.viewport(), enter)
        if not enter.isAccepted():
            return False
        QApplication.sendEvent(tree.viewport(), QDropEvent(QPointF(20, 20), actions, data, left, none))
        return True

    def agree(self, monkeypatch: pytest.MonkeyPatch, agrees: bool) -> None:
        """Answer the question about copying, as a person would."""

        def answer(box: QMessageBox) -> int:
            button = next(b for b in box.buttons() if (b.text() in ("Copy", "Write")) == agrees)
            button.click()
            return 0

        monkeypatch.setattr(QMessageBox, "exec", answer)

    def test_a_dropped_mesh_is_copied_after_asking_and_selected(
        self, qtbot: QtBot, session: Session, tree: SceneTree, outside: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        told: list[str] = []
        session.message.connect(lambda level, text: told.append(text))
        self.agree(monkeypatch, True)
        assert self.drop(tree, outside)
        qtbot.waitUntil(lambda: "part" in names(session) and not mesh_importer.running)
        assert session.selection == (*OBJECTS, 2)
        assert tree.item((*OBJECTS, 2)).isSelected()
        assert (session.document.root / "meshes" / "part.stl").is_file()
        assert "100 x 50 x 20 mm" in told[-1] and "read as mm" in told[-1]
        session.document.undo()
        assert names(session) == ["table", "step block"]

    def test_the_parts_of_a_step_file_are_one_step_to_undo(
        self, qtbot: QtBot, session: Session, tree: SceneTree, outside: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        told: list[str] = []
        session.message.connect(lambda level, text: told.append(text))
        parts = parts_of(glb({"pin": [(BOX, (0.6, 0.1, 0.1))]}, [{"name": n, "mesh": 0} for n in ("a", "b")]), "")
        chords: list[float] = []
        monkeypatch.setattr("studio.project.mesh_import.read_step", lambda file, chord: chords.append(chord) or parts)
        self.agree(monkeypatch, True)
        assert self.drop(tree, outside.with_suffix(".step"))
        qtbot.waitUntil(lambda: "b" in names(session) and not mesh_importer.running)
        assert names(session) == ["table", "step block", "a", "b"]
        assert told[-1].startswith("2 parts in meshes/part, 20 x 40 x 60 mm, 24 triangles, closed; facets at most")
        assert LEAST_CHORD <= chords[0] <= LARGEST_CHORD
        session.document.undo()
        assert names(session) == ["table", "step block"]

    def test_without_consent_nothing_happens(
        self, session: Session, tree: SceneTree, outside: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        self.agree(monkeypatch, False)
        assert self.drop(tree, outside)
        assert not mesh_importer.running
        assert not (session.document.root / "meshes").exists()

    def test_what_is_no_mesh_is_not_taken(self, tree: SceneTree, tmp_path: Path) -> None:
        assert not self.drop(tree, tmp_path / "notes.txt")

    def test_a_broken_mesh_is_told_and_changes_nothing(self, qtbot: QtBot, session: Session, tree: SceneTree) -> None:
        broken = session.document.root / "broken.stl"
        broken.write_bytes(b"solid nothing\nendsolid\n")
        before, told = session.project, []
        session.message.connect(lambda level, text: told.append(level))
        assert self.drop(tree, broken)
        qtbot.waitUntil(lambda: "error" in told and not mesh_importer.running)
        assert session.project is before

    def test_a_mesh_that_arrives_after_another_project_was_opened_is_dropped(
        self, qtbot: QtBot, session: Session, tree: SceneTree, outside: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        self.agree(monkeypatch, True)
        assert self.drop(tree, outside)
        session.replace_document(Document(Project.load(template_folder("sphere") / "project.json")))
        qtbot.waitUntil(lambda: not mesh_importer.running)
        assert "part" not in names(session)


def test_ctrl_selects_several_and_delete_is_of_all(tree: SceneTree, qtbot: QtBot) -> None:
    session = tree.session
    for _ in range(2):
        scene_actions.apply(session, "add box", lambda project: scene_edits.add_primitive(project, Box))
    last = len(there := names(session)) - 1
    click(qtbot, tree, (*OBJECTS, last - 1))
    index = tree.indexFromItem(tree.item((*OBJECTS, last)), NAME)
    control = Qt.KeyboardModifier.ControlModifier
    qtbot.mouseClick(tree.viewport(), Qt.MouseButton.LeftButton, control, tree.visualRect(index).center())
    assert session.selections == ((*OBJECTS, last - 1), (*OBJECTS, last))
    assert {item.text(NAME) for item in tree.selectedItems()} == set(there[-2:])
    key(qtbot, tree, Qt.Key.Key_Delete)
    assert names(session) == there[:-2]
    session.document.undo()
    assert names(session) == there
