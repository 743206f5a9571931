"""Photographs of a line in their window: opened, limited, measured by what is chosen, beside what is rendered."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDropEvent
from PySide6.QtWidgets import QApplication

from analysis.line.result import Flag
from render.sensor.develop import develop
from studio.qt.image.photograph_window import LANE, PICTURE, RENDERED, PhotographWindow
from studio.qt.image.zooms import Zooms
from tests.studio.photographs.colour_photographs import HEIGHT, Scene, photograph, write
from tests.studio.qt.small_session import small_session

SCENE = Scene(colour=0, room=40.0)


@pytest.fixture
def made(qtbot, tmp_path):
    """The window with two photographs of one line, over a session with a render."""
    for seed in (1, 2):
        write(tmp_path / f"{seed}.png", photograph(SCENE, seed=seed))
    window = PhotographWindow(small_session(rendered=True))
    qtbot.addWidget(window)
    window.show()
    qtbot.waitExposed(window)
    window.add([tmp_path / "1.png", tmp_path / "2.png", tmp_path / "notes.txt"])
    yield window
    window.runner.close()
    window.close()


def measured(qtbot, window):
    window.found = None
    window.measure()
    qtbot.waitUntil(lambda: window.runner.job(LANE) is None)


def points(window):
    return np.concatenate([item.getData() for item in (window.sure, window.doubtful)], axis=1)


def test_the_line_of_each_is_drawn_where_it_is_and_told_with_what_was_chosen(qtbot, made):
    assert [path.name for path in made.paths] == ["1.png", "2.png"] and made.names.count() == 2
    measured(qtbot, made)
    for row in (0, 1):
        made.names.setCurrentRow(row)
        u, v = points(made)
        assert len(u) > 0.98 * HEIGHT
        assert np.median(np.abs(u - SCENE.centre[v.astype(int)])) < 0.25
    assert f"of {HEIGHT} rows" in made.told.text() and "smoothed along the line over" in made.told.text()
    assert "laser's colour: red" in made.chosen.text()
    qtbot.waitUntil(lambda: made.runner.job(PICTURE) is None)
    assert made.view.item.size == photograph(SCENE, seed=1).shape[1::-1]


def test_how_much_of_a_line_is_saturated_is_told(qtbot, made):
    """All of it was, and only the colour that it was drawn in said so."""
    measured(qtbot, made)
    assert "saturated" not in made.told.text()
    found = made.found
    for path, one in found.lines.items():
        flag = one.line.flag.copy()
        flag[:7, 0] = Flag.SATURATED
        found.lines[path] = replace(one, line=replace(one.line, flag=flag))
        assert ", 7 of them saturated" in found.told_of(path)


def test_it_says_what_to_do_next_and_then_whose_width_and_whose_sigma_the_figures_are(qtbot, made, tmp_path):
    made.clear()
    assert "Drop photographs" in made.told.text()
    made.add([tmp_path / "1.png", tmp_path / "2.png"])
    assert made.told.text() == "Press Measure to find the line in these 2 photographs."
    measured(qtbot, made)
    assert "px wide (sigma), position known to 0." in made.told.text() and "(1 sigma)" in made.told.text()
    made.axis.setCurrentText("columns")
    measured(qtbot, made)
    assert "choose Scan axis: rows" in made.chosen.text() and "--" not in made.chosen.text()


def test_the_rendered_image_of_the_project_stands_beside_it(qtbot, made):
    assert made.no_render.isVisible() and "being developed" in made.no_render.text()
    shown = made.session.shown
    scene = shown.project.scene
    shown.images.append(develop(shown.frame, scene, shown.project.sensor, seed=1))
    made.session.developed.emit()
    assert not made.no_render.isVisible()
    qtbot.waitUntil(lambda: made.runner.job(RENDERED) is None)
    assert made.rendered.item.size == (scene.camera.width, scene.camera.height)


def test_a_render_that_was_there_before_the_window_is_shown_without_a_photograph(qtbot):
    session = small_session(rendered=True)
    shown = session.shown
    shown.images.append(develop(shown.frame, shown.project.scene, shown.project.sensor, seed=1))
    window = PhotographWindow(session)
    qtbot.addWidget(window)
    window.show()
    assert not window.no_render.isVisible()
    qtbot.waitUntil(lambda: window.runner.job(RENDERED) is None)
    session.show(None)
    assert window.no_render.isVisible() and "No render is chosen" in window.no_render.text()
    session.renders.clear()
    session.renders_changed.emit()
    assert "Nothing is rendered yet" in window.no_render.text()
    window.runner.close()


def test_a_rectangle_limits_what_is_looked_at(qtbot, made):
    qtbot.waitUntil(lambda: made.runner.job(PICTURE) is None)
    made.rectangle.limited.setChecked(True)
    width, _ = made.view.item.size
    made.rectangle.put((0, 50, width, 100))
    measured(qtbot, made)
    _, v = points(made)
    assert v.min() >= 50 and v.max() < 150 and len(v) > 95
    assert f"{len(v)} of 100 rows" in made.told.text()
    made.rectangle.limited.setChecked(False)
    measured(qtbot, made)
    assert len(points(made)[0]) > 0.98 * HEIGHT


def test_colour_axis_and_laser_off_images_are_as_chosen(qtbot, made, tmp_path):
    made.colour.setCurrentText("blue")
    made.axis.setCurrentText("columns")
    dark = tmp_path / "dark.png"
    write(dark, photograph(SCENE, seed=3, laser=False))
    made.set_offs([dark])
    wishes = made.wishes()
    assert (wishes.colour, wishes.axis, wishes.off) == ("blue", "columns", (dark,))
    made.colour.setCurrentText("auto")
    made.axis.setCurrentText("auto")
    measured(qtbot, made)
    assert "laser off" in made.chosen.text() and made.off_told.text() == "dark.png"
    assert len(points(made)[0]) > 0.98 * HEIGHT


def test_what_cannot_be_measured_is_said_and_the_others_go_on(qtbot, made, tmp_path):
    (tmp_path / "broken.png").write_bytes(b"no image")
    made.add([tmp_path / "broken.png"])
    measured(qtbot, made)
    assert str(tmp_path / "broken.png") in made.told.text() and len(points(made)[0]) == 0
    made.names.setCurrentRow(0)
    assert len(points(made)[0]) > 0.98 * HEIGHT
    other = tmp_path / "other.png"
    write(other, photograph(SCENE, seed=4, laser=False)[:50])
    made.set_offs([other])
    measured(qtbot, made)
    made.set_offs([other, other, other, other])
    measured(qtbot, made)
    assert made.problem.text().startswith("laser-off images: ") and "--" not in made.problem.text()
    made.set_offs([other])
    measured(qtbot, made)
    assert "size" in made.problem.text() or "size" in made.told.text()


def test_figures_of_other_settings_are_said_to_be_old(qtbot, made, tmp_path):
    assert not made.old.isVisible()
    measured(qtbot, made)
    assert not made.old.isVisible()
    made.colour.setCurrentText("mono")
    assert made.old.isVisible()
    made.colour.setCurrentText("auto")
    assert not made.old.isVisible()
    made.rectangle.limited.setChecked(True)
    assert made.old.isVisible()
    measured(qtbot, made)
    assert not made.old.isVisible()
    made.rectangle.boxes[2].setValue(60)
    assert made.old.isVisible()
    made.rectangle.limited.setChecked(False)
    measured(qtbot, made)
    write(tmp_path / "3.png", photograph(SCENE, seed=3))
    made.add([tmp_path / "3.png"])
    assert made.old.isVisible()
    made.clear()
    assert not made.old.isVisible()


def test_no_control_moves_when_there_are_figures(qtbot, made):
    controls = (made.colour, made.axis, made.rectangle.limited, made.measure_button)
    before = [control.mapTo(made, QPoint(0, 0)) for control in controls]
    measured(qtbot, made)
    QApplication.processEvents()
    assert made.told.text().count(" ") > 10 and made.problem.text() == ""
    assert [control.mapTo(made, QPoint(0, 0)) for control in controls] == before


def test_a_picture_that_was_moved_away_comes_back(qtbot, made, tmp_path):
    qtbot.waitUntil(lambda: made.runner.job(PICTURE) is None)
    fitted = made.view.box.viewRect()
    made.view.box.translateBy(x=1e4)
    assert not made.view.box.viewRect().intersects(fitted)
    for zooms in made.findChildren(Zooms):
        qtbot.mouseClick(zooms.buttons[0], Qt.MouseButton.LeftButton)
    assert made.view.box.viewRect().intersects(fitted)
    write(tmp_path / "small.png", photograph(SCENE, seed=3)[:100])
    made.view.box.translateBy(x=1e4)
    made.add([tmp_path / "small.png"])
    qtbot.waitUntil(lambda: made.view.item.size[1] == 100)
    assert made.view.box.viewRect().intersects(made.view.item.boundingRect())


def test_photographs_are_dropped_on_it_and_cleared(qtbot, made, tmp_path):
    write(tmp_path / "3.png", photograph(SCENE, seed=5))
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(tmp_path / "3.png")), QUrl.fromLocalFile(str(Path("absent.txt").resolve()))])
    drop = QDropEvent(
        QPointF(5, 5), Qt.DropAction.CopyAction, data, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    )
    made.dropEvent(drop)
    assert [path.name for path in made.paths] == ["1.png", "2.png", "3.png"]
    made.clear()
    assert not made.paths and made.names.count() == 0 and not made.measure_button.isEnabled()


def test_escape_closes_it_as_it_does_a_dialog(qtbot, made):
    qtbot.keyClick(made, Qt.Key.Key_Escape)
    assert not made.isVisible()
