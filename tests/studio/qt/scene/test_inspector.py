"""The inspector, with real keys and mouse: what is typed or dragged reaches the project, what is wrong is refused."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from render.scene.shape import VGroove
from studio.editing import scene_edits
from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.core.session import Session
from studio.qt.forms.fields import ChoiceField
from studio.qt.forms.form import Section
from studio.qt.scene.inspector import Inspector
from tests.studio.qt.scene.inspector_hands import (
    CAMERA,
    LASER,
    drag,
    field,
    row,
    type_into,
)


class TestTyping:
    def test_a_typed_number_is_taken_in_the_unit_that_is_shown(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        editor = field(inspector, *LASER, "power")
        type_into(qtbot, editor, "35")
        assert session.project.scene.lasers[0].power == pytest.approx(0.035)
        assert session.document.undo_label == "change power"
        type_into(qtbot, editor, "0.05 W")
        assert session.project.scene.lasers[0].power == pytest.approx(0.05)
        assert editor.text() == "50"

    def test_leaving_a_field_enters_it_and_escape_does_not(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        editor = field(inspector, *LASER, "power")
        type_into(qtbot, editor, "35", key=Qt.Key.Key_Tab)
        assert session.project.scene.lasers[0].power == pytest.approx(0.035)
        type_into(qtbot, editor, "99", key=Qt.Key.Key_Escape)
        assert editor.text() == "35"
        assert session.project.scene.lasers[0].power == pytest.approx(0.035)

    @pytest.mark.parametrize(
        ("name", "text", "reason"),
        [
            ("power", "-1", "at least 0 mW"),
            ("fan_angle", "171", "at most 170 deg"),
            ("fan_angle", "0", "at least 0.001 deg"),
            ("wavelength_nm", "ten", "not a number"),
            ("wavelength_nm", "450 kg", "unit"),
        ],
    )
    def test_an_impossible_value_is_refused_where_it_is_typed(
        self, qtbot: QtBot, session: Session, inspector: Inspector, name: str, text: str, reason: str
    ) -> None:
        before, editor = session.project, field(inspector, *LASER, name)
        shown = editor.text()
        type_into(qtbot, editor, text, key=None)
        told = row(inspector, *LASER, name).reason
        assert editor.invalid and told.isVisible() and reason in told.text()
        qtbot.keyClick(editor, Qt.Key.Key_Return)
        assert session.project is before
        assert editor.text() == text
        qtbot.keyClick(editor, Qt.Key.Key_Escape)
        assert not editor.invalid and not told.isVisible()
        assert editor.text() == shown

    def test_leaving_a_refused_value_brings_the_old_one_back(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        before, editor = session.project, field(inspector, *LASER, "power")
        type_into(qtbot, editor, "-5", key=Qt.Key.Key_Tab)
        assert editor.text() == "20" and not editor.invalid
        assert session.project is before and not row(inspector, *LASER, "power").reason.isVisible()

    def test_what_only_the_whole_model_can_judge_is_told_under_the_field_too(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        session.set(("scene", "objects", 1, "shape"), VGroove())
        session.select(("scene", "objects", 1))
        path = ("scene", "objects", 1, "shape", "depth")
        type_into(qtbot, field(inspector, *path), "31")
        assert "thickness" in row(inspector, *path).reason.text()
        told: list[str] = []
        session.message.connect(lambda kind, text: told.append(text))
        type_into(qtbot, field(inspector, *path), "31", key=Qt.Key.Key_Tab)
        assert not row(inspector, *path).reason.isVisible() and "thickness" in told[-1]
        assert session.project.scene.objects[1].shape == VGroove()

    def test_names_choices_flags_and_empty_numbers(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        type_into(qtbot, field(inspector, *LASER, "name"), "blue line")
        assert session.project.scene.lasers[0].name == "blue line"
        assert inspector.title.text() == "blue line"
        profile = field(inspector, *LASER, "fan_profile")
        profile.setFocus()
        qtbot.keyClick(profile, Qt.Key.Key_Down)
        assert session.project.scene.lasers[0].fan_profile == "gaussian"
        session.select(CAMERA)
        vignetting = field(inspector, *CAMERA, "lens", "vignetting")
        qtbot.mouseClick(vignetting, Qt.MouseButton.LeftButton, pos=QPoint(8, vignetting.height() // 2))
        assert not session.project.scene.camera.lens.vignetting
        focus = field(inspector, *CAMERA, "lens", "focus_distance")
        before = session.project.scene.camera
        type_into(qtbot, focus, "900")
        camera = session.project.scene.camera
        assert camera.lens.focus_distance == pytest.approx(0.9)
        assert camera.focal_length == pytest.approx(before.focal_length)
        assert float(field(inspector, *CAMERA, "fx").text()) == pytest.approx(camera.fx, abs=1e-3)
        session.document.undo()
        assert session.project.scene.camera == before, "fx and focus are one step"
        session.document.redo()
        qtbot.mouseClick(row(inspector, *CAMERA, "lens", "focus_distance").reset, Qt.MouseButton.LeftButton)
        assert session.project.scene.camera.lens.focus_distance is None
        assert (focus.text(), focus.placeholderText()) == ("", "far away")

    def test_distortion_is_a_list_of_numbers(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        session.select(CAMERA)
        editor = field(inspector, *CAMERA, "distortion")
        type_into(qtbot, editor, "-0.0785 -0.1658, -0.0013 -0.0022 2.154")
        assert session.project.scene.camera.distortion == (-0.0785, -0.1658, -0.0013, -0.0022, 2.154)
        type_into(qtbot, editor, "1 2")
        assert "4, 5, 8, 12 or 14" in row(inspector, *CAMERA, "distortion").reason.text()

    def test_arrow_keys_step_a_number(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        editor = field(inspector, *LASER, "power")
        qtbot.mouseClick(editor, Qt.MouseButton.LeftButton)
        qtbot.keyClick(editor, Qt.Key.Key_Up)
        up = session.project.scene.lasers[0].power
        assert up > 0.02
        qtbot.keyClick(editor, Qt.Key.Key_Down)
        assert session.project.scene.lasers[0].power == pytest.approx(0.02)

    def test_the_wheel_scrolls_and_changes_nothing(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        before = session.project
        for editor in (field(inspector, *LASER, "power"), field(inspector, *LASER, "fan_profile")):
            place = QPointF(editor.rect().center())
            wheel = QWheelEvent(place, editor.mapToGlobal(place), QPoint(0, 0), QPoint(0, -240),
                                Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier,
                                Qt.ScrollPhase.NoScrollPhase, False)  # fmt: skip
            QApplication.sendEvent(editor, wheel)
        assert session.project is before


class TestDragging:
    def test_a_number_is_dragged_sideways_as_one_edit(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        before = session.project
        states: list[bool] = []
        changes: list[float] = []
        session.drag_changed.connect(states.append)
        session.project_changed.connect(lambda: changes.append(session.project.scene.lasers[0].power))
        editor = field(inspector, *LASER, "power")
        drag(qtbot, editor, 60)
        assert states == [True, False]
        assert len(changes) >= 5 and changes == sorted(changes)
        assert session.project.scene.lasers[0].power > 0.02
        assert not editor.hasFocus()
        session.document.undo()
        assert session.project == before
        assert session.document.undo_label is None

    def test_it_stops_at_the_limit(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        drag(qtbot, field(inspector, *LASER, "power"), -900)
        assert session.project.scene.lasers[0].power == 0.0
        assert not row(inspector, *LASER, "power").reason.isVisible()

    def test_escape_gives_it_up(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        before, editor = session.project, field(inspector, *LASER, "power")
        drag(qtbot, editor, 60, release=False)
        assert session.project != before and session.dragging
        qtbot.keyClick(editor, Qt.Key.Key_Escape)
        assert session.project == before and not session.dragging
        qtbot.mouseRelease(editor, Qt.MouseButton.LeftButton)
        assert session.document.undo_label is None

    def test_two_drags_are_two_edits(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        editor = field(inspector, *LASER, "power")
        drag(qtbot, editor, 40)
        first = session.project
        drag(qtbot, editor, 40)
        session.document.undo()
        assert session.project == first

    def test_a_double_click_takes_the_whole_number(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        power = field(inspector, *LASER, "power")
        session.set((*LASER, "power"), 0.01287)
        qtbot.mouseClick(power, Qt.MouseButton.LeftButton)
        qtbot.mouseDClick(power, Qt.MouseButton.LeftButton)
        qtbot.keyClicks(power, "30")
        qtbot.keyClick(power, Qt.Key.Key_Return)
        assert session.project.scene.lasers[0].power == pytest.approx(0.03)

    def test_a_click_without_moving_is_no_drag(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        editor = field(inspector, *LASER, "power")
        qtbot.mouseClick(editor, Qt.MouseButton.LeftButton)
        assert editor.hasFocus() and editor.selectedText() == "20"
        assert session.document.undo_label is None


class TestPoses:
    def test_position_and_rotation_are_millimetres_and_degrees(self, inspector: Inspector) -> None:
        position = [editor.text() for editor in field(inspector, *LASER, "T_rig_laser").fields]
        rotation = [editor.text() for editor in field(inspector, *LASER, "T_rig_laser", part=1).fields]
        assert (position, rotation) == (["200", "0", "0"], ["0", "-13", "0"])

    def test_typing_one_angle_leaves_the_others_alone(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        angles = field(inspector, *LASER, "T_rig_laser", part=1).fields
        for axis, text in ((0, "12.5"), (1, "90"), (2, "-33"), (1, "20"), (0, "180"), (1, "-90"), (2, "7")):
            before = [editor.text() for editor in angles]
            type_into(qtbot, angles[axis], text)
            before[axis] = text
            assert [editor.text() for editor in angles] == before
        assert [editor.text() for editor in angles] == ["180", "-90", "7"]
        assert session.project.scene.lasers[0].T_rig_laser.translation == (0.2, 0.0, 0.0)

    def test_a_pose_is_put_back_to_the_origin(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        qtbot.mouseClick(row(inspector, *LASER, "T_rig_laser").reset, Qt.MouseButton.LeftButton)
        pose = session.project.scene.lasers[0].T_rig_laser
        assert pose.translation == (0.0, 0.0, 0.0)
        assert pose.rotation[1] == pytest.approx(-0.226893)


class TestFollowing:
    def test_undo_and_redo_update_in_place_and_leave_the_focus(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        editor = field(inspector, *LASER, "power")
        type_into(qtbot, editor, "35")
        qtbot.keyClick(editor, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
        assert session.project.scene.lasers[0].power == pytest.approx(0.02)
        assert field(inspector, *LASER, "power") is editor
        assert editor.hasFocus() and editor.text() == "20"
        session.document.redo()
        assert editor.hasFocus() and editor.text() == "35"

    def test_undo_while_typing_is_the_texts_own(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        editor = field(inspector, *LASER, "power")
        type_into(qtbot, editor, "35")
        type_into(qtbot, editor, "7", key=None)
        qtbot.keyClick(editor, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
        assert session.project.scene.lasers[0].power == pytest.approx(0.035)

    def test_what_is_being_typed_is_not_overwritten(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        editor = field(inspector, *LASER, "power")
        type_into(qtbot, editor, "4", key=None)
        session.set((*LASER, "power"), 0.011)
        assert editor.text() == "4"
        qtbot.keyClick(editor, Qt.Key.Key_Escape)
        assert editor.text() == "11"

    def test_changing_the_selection_while_typing_changes_the_old_item_only(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        project, path = scene_edits.add_laser(session.project)
        session.document.apply("add", project)
        type_into(qtbot, field(inspector, *LASER, "power"), "44", key=None)
        session.select(path)
        assert session.project.scene.lasers[1].power == 0.02
        assert field(inspector, *path, "power").text() == "20"

    def test_every_item_has_a_form_and_one_that_is_gone_none(self, session: Session, inspector: Inspector) -> None:
        for path, title in (((), "Step block on a linear stage"), (("scene", "rig"), "Rig"), (CAMERA, "Camera"),
                            (("scene", "objects"), "Objects"), (("scene", "objects", 0), "table"),
                            (("scene", "lights", 0), "panel"), (("scene", "environment"), "Environment"),
                            (("scene", "motion"), "Motion"), (("sensor",), "Sensor"), (("render",), "Render settings"),
                            (("extraction",), "Line extraction")):  # fmt: skip
            session.select(path)
            assert inspector.title.text() == title
        session.select(("scene", "objects", 1))
        session.document.apply("delete", scene_edits.remove(session.project, ("scene", "objects", 1))[0])
        assert inspector.title.text() == session.project.name

    def test_a_folded_section_stays_folded(self, qtbot: QtBot, session: Session, inspector: Inspector) -> None:
        section = next(found for found in inspector.findChildren(Section) if found.title == "Sheet")
        qtbot.mouseClick(section.button, Qt.MouseButton.LeftButton)
        assert not section.body.isVisible()
        session.select(CAMERA)
        session.select(LASER)
        shown = [found for found in inspector.findChildren(Section) if found is not section and found.title == "Sheet"]
        qtbot.waitUntil(shown[-1].isVisible)
        assert not shown[-1].body.isVisible()

    def test_another_document_is_shown(self, session: Session, inspector: Inspector) -> None:
        session.replace_document(Document(Project.load(template_folder("sphere") / "project.json")))
        assert inspector.title.text() == session.project.name


def test_several_selected_are_told_without_pushing_the_fields_out(session: Session, inspector: Inspector) -> None:
    session.select(LASER)
    before = inspector.form.parentWidget().minimumSizeHint().width()
    session.select_also(CAMERA)
    session.select_also(LASER)
    session.select_also(LASER)
    assert session.selections == (CAMERA, LASER)
    assert inspector.hint.text().startswith("1 more selected") and not inspector.hint.isHidden()
    assert inspector.form.parentWidget().minimumSizeHint().width() <= before
    session.select(LASER)
    assert "selected" not in inspector.hint.text()


def test_the_object_of_the_report_is_chosen_from_those_that_there_are(session: Session, inspector: Inspector) -> None:
    session.select(("delivery",))
    names = [item.name for item in session.project.scene.visible_objects]
    (field,) = [one for one in inspector.findChildren(ChoiceField) if one.values == ["", *names]]
    assert [field.itemText(k) for k in range(field.count())] == ["All objects", *names]
    field.setCurrentIndex(1)
    field.activated.emit(1)
    assert session.project.delivery.surface_of == names[0] and not inspector.problem.isVisibleTo(inspector)
    session.set(("delivery", "surface_of"), "no such part")
    assert "'no such part', which is no visible object" in inspector.problem.text()


def test_a_logo_that_cannot_be_shown_is_told_at_its_field(session: Session, inspector: Inspector) -> None:
    session.select(("delivery",))
    assert not inspector.problem.isVisibleTo(inspector)
    for outside in ("/somewhere/else/logo.png", "../logo.png", "C:\\logo.png"):
        session.set(("delivery", "logo"), outside)
        told = inspector.problem.text()
        assert told.startswith(f"The logo {outside} is not shown: it lies outside of the project's folder")
        assert "allowed: a PNG or JPEG in that folder" in told and "choose it by the button …" in told
        assert "delivery.logo" not in told, "a key of the file is no place in the window"
    (session.document.root / "logo.png").write_text("no image")
    session.set(("delivery", "logo"), "logo.png")
    assert inspector.problem.text() == "The logo logo.png is not shown: it is neither a PNG nor a JPEG."
    session.set(("delivery", "logo"), "")
    assert not inspector.problem.isVisibleTo(inspector)


def test_a_whole_path_inside_the_projects_folder_is_taken(qtbot: QtBot, session: Session, inspector: Inspector) -> None:
    session.select(("delivery",))
    editor = row(inspector, "delivery", "logo").text
    for typed, kept in (("textures/logo.png", "textures/logo.png"), ("/elsewhere/logo.png", "/elsewhere/logo.png")):
        for text in (typed, str(session.document.root / typed)):
            type_into(qtbot, editor, text)
            assert session.project.delivery.logo == editor.text() == kept


class TestScrolling:
    def test_another_item_is_shown_from_its_top_and_an_edit_leaves_its_own_where_it_is(
        self, qtbot: QtBot, session: Session, inspector: Inspector
    ) -> None:
        inspector.window().resize(340, 300)
        session.select(CAMERA)
        bar = inspector.area.verticalScrollBar()
        qtbot.waitUntil(lambda: bar.maximum() > 100)
        bar.setValue(80)
        session.set((*CAMERA, "fx"), 1.01 * session.project.scene.camera.fx)
        assert bar.value() == 80
        session.select(LASER)
        assert bar.value() == 0
