"""What a person does with the desktop, from end to end, with real mouse and keys. Each test is one story."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication, QFileDialog, QWidget
from pytestqt.qtbot import QtBot

from studio.preview.gizmo_geometry import arm_end
from studio.project.project import Project
from studio.qt.core.render import Render
from studio.qt.shell.file_actions import template
from studio.qt.shell.window import MainWindow
from studio.study.draft import spec_of
from studio.study.study import Study

RIG, LASER, OBJECT = ("scene", "rig"), ("scene", "rig", "lasers", 0), ("scene", "objects", 0)
CTRL, SHIFT, ALT, PLAIN = (
    Qt.KeyboardModifier.ControlModifier,
    Qt.KeyboardModifier.ShiftModifier,
    Qt.KeyboardModifier.AltModifier,
    Qt.KeyboardModifier.NoModifier,
)


def click_in_tree(window: MainWindow, qtbot: QtBot, path: tuple[str | int, ...]) -> None:
    tree = window.panels["scene"]
    place = tree.visualItemRect(tree.item(path)).center()  # type: ignore[attr-defined]
    qtbot.mouseClick(tree.viewport(), Qt.MouseButton.LeftButton, pos=place)  # type: ignore[attr-defined]
    assert window.session.selection == path


def drag_in_view(view: QWidget, start: QPointF, end: QPointF) -> None:
    """Press, four moves, release, through the event queue."""
    left, none, kinds = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton, QMouseEvent.Type

    def send(kind: QMouseEvent.Type, at: QPointF, button: Qt.MouseButton, held: Qt.MouseButton) -> None:
        QApplication.sendEvent(view, QMouseEvent(kind, at, view.mapToGlobal(at), button, held, PLAIN))
        QApplication.processEvents()

    send(kinds.MouseMove, start, none, none)
    send(kinds.MouseButtonPress, start, left, left)
    for share in (0.25, 0.5, 0.75, 1.0):
        send(kinds.MouseMove, start + (end - start) * share, none, left)
    send(kinds.MouseButtonRelease, end, left, none)


def rendered(window: MainWindow, qtbot: QtBot) -> Render:
    """Wait until the render is done and measured."""
    session, develop = window.session, window.panels["develop"]

    def done() -> bool:
        shown = session.shown
        idle = not window.runner.busy and not develop.busy  # type: ignore[attr-defined]
        return shown is not None and shown.final and len(shown.measurements) == 3 and idle

    qtbot.waitUntil(done, timeout=60_000)
    assert session.shown is not None
    return session.shown


def render(window: MainWindow, qtbot: QtBot) -> Render:
    panel = window.panels["render"]
    panel.scale.setCurrentIndex(panel.scale.findData(1.0))  # type: ignore[attr-defined]
    qtbot.keyClick(window, Qt.Key.Key_F5)
    return rendered(window, qtbot)


def test_place_a_laser_with_the_gizmo(window: MainWindow, qtbot: QtBot) -> None:
    viewport = window.panels["viewport"]
    click_in_tree(window, qtbot, LASER)
    viewport.frame()  # type: ignore[attr-defined]
    QApplication.processEvents()
    frame = viewport.gizmo.frame()  # type: ignore[attr-defined]
    before = window.session.project
    view, axis = viewport.view, 0  # type: ignore[attr-defined]
    step = 0.6 * (arm_end(frame, axis) - frame.centre)
    grip = frame.centre + 0.7 * (arm_end(frame, axis) - frame.centre)
    start, end = (QPointF(*view.eye.project(place[None], view.pixels)[0]) for place in (grip, grip + step))
    drag_in_view(view, start, end)
    moved = window.session.project.scene.T_world_laser(0)[:3, 3] - before.scene.T_world_laser(0)[:3, 3]
    np.testing.assert_allclose(moved, step, atol=0.03 * np.linalg.norm(step))
    qtbot.keyClick(window, Qt.Key.Key_Z, CTRL)
    assert window.session.project == before, "a drag is one step of undo"


def test_type_a_pose(window: MainWindow, qtbot: QtBot) -> None:
    click_in_tree(window, qtbot, LASER)
    (row,) = window.panels["inspector"].form.rows[(*LASER, "T_rig_laser")][:1]  # type: ignore[attr-defined]
    field = row.editor.fields[0]
    qtbot.mouseClick(field, Qt.MouseButton.LeftButton)
    field.selectAll()
    qtbot.keyClicks(field, "123.5")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    assert window.session.project.scene.lasers[0].T_rig_laser.translation[0] == pytest.approx(0.1235)
    assert window.session.document.undo_label is not None


def test_import_a_mesh_in_millimetres_by_dropping_it(window: MainWindow, qtbot: QtBot, small_project: Path) -> None:
    file = small_project.parent / "block.stl"
    trimesh.creation.box(extents=(40.0, 30.0, 20.0)).export(file)
    count = len(window.session.project.scene.objects)
    window.take([file])
    qtbot.waitUntil(lambda: len(window.session.project.scene.objects) == count + 1, timeout=10_000)
    item = window.session.project.scene.objects[-1]
    assert window.session.selection == ("scene", "objects", count)
    assert item.shape.unit == "mm", "40 m would be absurd"  # type: ignore[union-attr]
    qtbot.waitUntil(lambda: len(window.panels["viewport"].live.look.placed) == count + 1)  # type: ignore[attr-defined]


def test_undo_ten_steps_and_redo_them(window: MainWindow, qtbot: QtBot) -> None:
    session = window.session
    states = [session.project]
    for i in range(10):
        session.set((*LASER, "power"), 0.001 * (i + 1), f"power {i}")
        states.append(session.project)
    for state in reversed(states[:-1]):
        qtbot.keyClick(window, Qt.Key.Key_Z, CTRL)
        assert session.project is state
    assert not window.commands["undo"].isEnabled()
    for state in states[1:]:
        qtbot.keyClick(window, Qt.Key.Key_Z, CTRL | SHIFT)
        assert session.project is state


def test_what_was_told_of_an_edit_does_not_outlive_it(window: MainWindow, qtbot: QtBot) -> None:
    told: list[str] = []
    window.session.message.connect(lambda _, text: told.append(text))
    window.session.set((*LASER, "power"), 0.002, "change power")
    qtbot.keyClick(window, Qt.Key.Key_Z, CTRL)
    qtbot.keyClick(window, Qt.Key.Key_Z, CTRL | SHIFT)
    qtbot.keyClick(window, Qt.Key.Key_Z, CTRL | SHIFT)
    assert told == ["undone: change power", "done again: change power"]


def test_render_and_read_the_error(window: MainWindow, qtbot: QtBot) -> None:
    shown = render(window, qtbot)
    one = shown.measurements["likelihood"][0]
    assert one.errors.completeness > 0.5 and abs(one.errors.u.median) < 0.1
    qtbot.keyClick(window, Qt.Key.Key_F8)
    panel = window.panels["results"]
    qtbot.waitUntil(lambda: panel.stack.currentIndex() == 1)  # type: ignore[attr-defined]
    qtbot.keyClick(window, Qt.Key.Key_W, ALT)
    assert window.session.hovered is not None
    assert f"Row {window.session.hovered}" in panel.reading.text()  # type: ignore[attr-defined]


def test_cancel_a_render(window: MainWindow, qtbot: QtBot) -> None:
    session = window.session
    session.set(("render", "ambient_samples"), 65536)
    session.set(("render", "goal"), None)
    session.set(("render", "ambient_error"), 2e-4)
    with qtbot.waitSignal(window.runner.started):
        qtbot.keyClick(window, Qt.Key.Key_F5)
    qtbot.waitUntil(lambda: window.status.cancel.isVisible(), timeout=10_000)
    with qtbot.waitSignal(window.runner.cancelled, timeout=10_000):
        qtbot.mouseClick(window.status.cancel, Qt.MouseButton.LeftButton)
    assert not window.runner.busy
    qtbot.waitUntil(lambda: not window.status.bar.isVisible())
    assert session.renders == []


def test_change_the_exposure_without_rendering_again(window: MainWindow, qtbot: QtBot) -> None:
    shown = render(window, qtbot)
    radiance, brightest = shown.frame.laser_direct[0], int(shown.images[0].pixels.max())
    before = window.session.project.sensor.exposure_time
    window.switch_to("render")
    box = window.panels["develop"].exposure.box  # type: ignore[attr-defined]
    with qtbot.waitSignal(window.session.measured, timeout=30_000):
        box.setFocus()
        box.selectAll()
        qtbot.keyClicks(box, f"{500 * before:.4f}")
        qtbot.keyClick(box, Qt.Key.Key_Return)
    assert window.session.project.sensor.exposure_time == pytest.approx(before / 2, rel=1e-3)
    assert window.session.shown is shown and shown.frame.laser_direct[0] is radiance
    assert int(shown.images[0].pixels.max()) == pytest.approx(brightest / 2, rel=0.1)


def test_export_report_points_and_image(
    window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, quick_reports: None
) -> None:
    render(window, qtbot)
    for key, name in (("export_html", "report.html"), ("export_csv", "points.csv"), ("export_png", "image.png")):
        path = tmp_path / "out" / name
        monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_, path=path, **__: (str(path), ""))
        with qtbot.waitSignal(window.runner.finished, timeout=60_000):
            window.commands[key].trigger()
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "data:image/png;base64," in page and "Depth RMSE" in page
    header, *rows = (tmp_path / "out" / "points.csv").read_text().splitlines()
    assert header.startswith("x_m,y_m,z_m") and len(rows) > 50
    from PIL import Image

    with Image.open(tmp_path / "out" / "image.png") as image:
        camera = window.session.project.scene.camera
        assert image.size == (camera.width, camera.height)


def test_save_and_reopen_gives_the_identical_scene(
    window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = window.session
    session.set((*LASER, "power"), 0.0123)
    click_in_tree(window, qtbot, OBJECT)
    qtbot.keyClick(window, Qt.Key.Key_D, CTRL)
    edited = session.project
    assert len(edited.scene.objects) == 3
    path = tmp_path / "again" / "mine.json"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_, **__: (str(path), ""))
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_, **__: (str(path), ""))
    qtbot.keyClick(window, Qt.Key.Key_S, CTRL | SHIFT)
    assert not session.document.dirty
    session.set((*LASER, "power"), 0.5)
    qtbot.keyClick(window, Qt.Key.Key_S, CTRL)
    session.document.undo()
    qtbot.keyClick(window, Qt.Key.Key_S, CTRL)
    qtbot.keyClick(window, Qt.Key.Key_O, CTRL)
    assert session.project == edited
    assert Project.from_data(json.loads(path.read_text())) == edited
    assert window.session.document.path == path


def test_hover_in_the_image_marks_the_plots(window: MainWindow, qtbot: QtBot) -> None:
    render(window, qtbot)
    window.switch_to("measure")
    camera = window.panels["camera"]
    view = camera.view  # type: ignore[attr-defined]
    qtbot.waitUntil(lambda: window.panels["results"].rows.isVisible())  # type: ignore[attr-defined]
    QApplication.processEvents()
    at = view.mapFromScene(view.box.mapViewToScene(QPointF(120, 100)))
    qtbot.mouseMove(view.viewport(), at + QPoint(3, 0))
    qtbot.mouseMove(view.viewport(), at)
    qtbot.waitUntil(lambda: window.session.hovered is not None)
    assert window.session.hovered is not None and abs(window.session.hovered - 100) <= 2
    assert window.panels["results"].rows.cursors[0].value() == window.session.hovered  # type: ignore[attr-defined]


def test_a_panel_that_needs_a_file_of_the_project_has_it_saved(
    window: MainWindow, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A study, whose file names it, of a template that was changed and never saved."""
    window.files.replace(template("plane", window.files.autosave))
    assert window.session.set(("sensor", "read_noise"), 3.0)
    study = window.panels["study"]
    work = study.work  # type: ignore[attr-defined]
    work.start_anew()
    work.vary(("sensor", "read_noise"), spec_of(window.session.project, "sensor.read_noise"))
    monkeypatch.setattr("studio.qt.core.save_first.ask_to_save_first", lambda *_: True)
    paths = iter((tmp_path / "mine.json", tmp_path / "noise.json"))
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(next(paths)), ""))
    study._save()  # type: ignore[attr-defined]
    assert not window.session.document.dirty and window.session.document.path == tmp_path / "mine.json"
    made, root = Study.load(tmp_path / "noise.json")
    assert made.base == "mine.json" and made.bases(root)["mine.json"].sensor.read_noise == 3.0
