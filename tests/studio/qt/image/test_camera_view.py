"""The camera view: live estimate, rendered frame, light groups, read-out, row profile."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication

from analysis.line.result import Flag
from studio.project.document import Document
from studio.qt.core.live_preview import live
from studio.qt.core.render import Render
from studio.qt.image.camera_view import CameraView
from studio.qt.image.row_profile import REASONS, fitted_profile
from tests.studio.qt.small_session import FOLDER, measured_view, small_project, small_render, small_session


@pytest.fixture
def made(qtbot):
    """Camera view and develop panel over one session with a render, developed and measured."""
    with measured_view(qtbot) as view:
        yield view


@pytest.fixture
def unrendered(qtbot):
    session = small_session()
    view = CameraView(session)
    qtbot.addWidget(view)
    view.resize(800, 700)
    view.show()
    qtbot.waitExposed(view)
    qtbot.waitUntil(lambda: len(live(session).look.placed) > 0)
    yield view
    view.close()
    live(session).close()


def move_to(qtbot, view, column, row):
    """The mouse goes to a pixel."""
    where = view.view.box.mapViewToScene(QPointF(column, row))
    qtbot.mouseMove(view.view.viewport(), view.view.mapFromScene(where) - view.view.viewport().rect().topLeft())


def choose(view, label):
    index = view.choice.findText(label)
    assert index >= 0
    view.choice.setCurrentIndex(index)
    view.choice.activated.emit(index)


def grabbed(view):
    image = view.view.grab().toImage()
    pixels = np.frombuffer(image.bits(), np.uint8).reshape(image.height(), image.bytesPerLine() // 4, 4)
    return pixels[:, : image.width(), :3].astype(int)


def drag_with_shift(view, start, end):
    """Over the picture, from a pixel to another (column, row), through the event queue."""
    places = [view.view.mapFromScene(view.view.box.mapViewToScene(QPointF(*pixel))) for pixel in (start, end)]
    left, none, kinds = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton, QMouseEvent.Type
    begin, end = (QPointF(place) for place in places)
    middle = 0.5 * (begin + end)
    steps = (
        *((kinds.MouseButtonPress, begin, left, left), (kinds.MouseMove, middle, none, left)),
        *((kinds.MouseMove, end, none, left), (kinds.MouseButtonRelease, end, left, none)),
    )
    pane = view.view.viewport()
    for kind, at, button, held in steps:
        shift = Qt.KeyboardModifier.ShiftModifier
        QApplication.sendEvent(pane, QMouseEvent(kind, at, pane.mapToGlobal(at), button, held, shift))
        QApplication.processEvents()


def test_without_a_render_the_view_is_a_live_estimate(qtbot, unrendered):
    assert unrendered.is_live and unrendered.badge.isVisible() and unrendered.badge.render_button.isVisible()
    assert "estimate" in unrendered.badge.text.text()
    assert len(unrendered.overlay.truth.xData) > 50
    assert np.ptp(grabbed(unrendered)) > 100


def test_the_button_of_the_badge_asks_for_a_render(qtbot, unrendered):
    with qtbot.waitSignal(unrendered.session.render_asked):
        qtbot.mouseClick(unrendered.badge.render_button, Qt.MouseButton.LeftButton)


def test_the_live_line_follows_a_dragged_laser(qtbot, unrendered):
    session = unrendered.session
    before = np.array(unrendered.overlay.truth.xData)
    pose = session.project.scene.lasers[0].T_rig_laser
    session.begin_drag()
    for i in range(1, 4):
        x, y, z = pose.translation
        moved = pose.model_copy(update={"translation": (x + 0.002 * i, y, z)})
        session.set(("scene", "rig", "lasers", 0, "T_rig_laser"), moved, "move", "drag")
        qtbot.waitUntil(lambda: live(session).look.project is session.project)
    session.end_drag()
    after = np.array(unrendered.overlay.truth.xData)
    assert np.nanmean(after) != pytest.approx(np.nanmean(before), abs=0.2)


def test_a_render_takes_the_place_of_the_estimate(qtbot, unrendered):
    session = unrendered.session
    world, frame = small_render()
    session.add_render(Render(1, small_project(), world, frame))
    assert not unrendered.is_live and not unrendered.badge.isVisible()
    choose(unrendered, "Light of laser")
    qtbot.waitUntil(lambda: not unrendered.runner.busy)
    assert unrendered.view.item.size == (306, 256)


def test_a_changed_scene_makes_the_render_stale_and_goes_live(qtbot, made):
    session = made.session
    session.set(("scene", "objects", 0, "scale"), 1.01)
    assert made.session.stale and made.is_live and made.badge.isVisible() and made.badge.render_button.isVisible()
    assert "changed" in made.badge.text.text()
    choose(made, "Image")
    assert not made.is_live and made.badge.isVisible()
    session.document.undo()
    assert not made.session.stale and not made.badge.isVisible()


def test_the_picture_of_a_studys_cell_says_so_beside_the_projects_values(qtbot, made):
    shown = made.session.shown
    shown.cell, shown.name = "a key", "Sweep 1: 5 mW, repeat 1"
    made.session.renders_changed.emit()
    assert made.badge.isVisible() and "a study's cell" in made.badge.text.text()
    assert "5 mW" in made.badge.text.text()


def test_what_was_looked_at_comes_back_where_the_change_is_undone(qtbot, made):
    choose(made, "Light of laser")
    made.session.set(("scene", "environment", "radiance"), (0.5, 0.5, 0.5))
    assert made.is_live
    made.session.document.undo()
    assert not made.is_live and made.choice.currentText() == "Light of laser"
    made.session.document.redo()
    choose(made, "Live estimate")
    made.session.document.undo()
    assert made.is_live, "whoever chose the estimate keeps it"


def test_exposure_does_not_make_it_stale(qtbot, made):
    made.session.set(("sensor", "exposure_time"), 0.1)
    assert not made.session.stale and not made.is_live


def test_each_light_group_is_seen_on_its_own(qtbot, made):
    labels = [made.choice.itemText(i) for i in range(made.choice.count())]
    assert labels[:3] == ["Live estimate", "Image", "Light of laser"] and "Depth" in labels
    seen = []
    for label in labels[1:]:
        choose(made, label)
        qtbot.waitUntil(lambda: not made.runner.busy)
        seen.append(grabbed(made))
    for i in range(len(seen)):
        for j in range(i):
            assert np.abs(seen[i] - seen[j]).mean() > 0.05


def test_the_cursor_reads_the_pixel_and_tells_the_scan_line(qtbot, made):
    session = made.session
    curve = session.shown.frame.curves[0]
    k = len(curve.index) // 2
    row, column = int(curve.index[k]), round(float(curve.position[k]))
    box = made.view.box
    box.setRange(xRange=(column - 20, column + 20), yRange=(row - 20, row + 20), padding=0)
    move_to(qtbot, made, column + 0.1, row + 0.1)
    qtbot.waitUntil(lambda: session.hovered == row)
    text = made.readout.text()
    assert f"{column}, {row}" in text and "mm" in text and "DN" in text
    assert session.project.scene.visible_objects[int(curve.object_id[k])].name in text
    assert made.profile.row.value() == row
    assert made.marks.hover.isVisible() and made.marks.hover.value() == row


def test_the_wheel_zooms_to_single_pixels(qtbot, made):
    made.view.fit()
    before = made.view.zoom
    for _ in range(30):
        made.view.box.scaleBy((0.8, 0.8))
    assert made.view.zoom > 100 * before
    # a grid of pixels: the picture has both the pixels' colours and lines between them
    assert made.overlay.truth.opts["symbol"] == "+"
    made.view.fit()
    assert made.overlay.truth.opts["symbol"] is None


def test_the_profile_shows_the_pixels_of_the_row_and_meets_them(qtbot, made):
    session = made.session
    curve = session.shown.frame.curves[0]
    row = int(curve.index[len(curve.index) // 2])
    session.hover(row)
    edges, values = made.profile.pixels.getData()
    assert len(edges) == len(values) + 1 and edges[0] == -0.5
    image = session.shown.images[0]
    assert np.array_equal(values, image.pixels[row])
    line = session.shown.measurements["likelihood"][0].line
    u, width = line.u[row, 0], line.width[row, 0]
    x = np.arange(np.ceil(u - 2 * width), np.floor(u + 2 * width) + 1)
    (fit,) = fitted_profile(line, row, image, x, True)
    electrons = (values[x.astype(int)] - image.black_level) / image.gain
    noise = np.sqrt(np.maximum(electrons, 1) + image.read_noise**2 + 1 / (12 * image.gain**2)) * image.gain
    assert np.all(np.abs(fit - values[x.astype(int)]) < 5 * noise)
    assert "true" in made.profile.text.text() and "px" in made.profile.text.text()


def test_what_the_profile_was_zoomed_to_goes_with_its_project(qtbot, made):
    session, profile, shown = made.session, made.profile, made.session.shown
    view = profile.plot.getPlotItem().getViewBox()
    at_first = view.viewRange()[0]
    profile.follow.setChecked(False)
    profile.plot.setXRange(2.0, 3.0, padding=0.0)
    profile.refresh()
    assert view.viewRange()[0] == [2.0, 3.0], "it is kept while the project is the same"
    session.replace_document(Document(session.project, None))
    session.add_render(shown)
    assert view.viewRange()[0] == at_first and not profile.follow.isChecked()


def test_a_row_without_a_position_says_why(qtbot, made):
    line = made.session.shown.measurements["likelihood"][0].line
    empty = np.flatnonzero(~line.valid[:, 0])
    assert len(empty) > 0
    made.session.hover(int(empty[0]))
    assert f"finds no line: {REASONS[Flag(int(line.flag[empty[0], 0]))]}" in made.profile.text.text()
    assert "no truth here" not in made.profile.text.text()


def test_a_line_that_has_no_truth_is_not_said_to_be_none(qtbot, made):
    """Beside a step's edge "no line is seen here" stood under a fitted peak that the results had a depth of."""
    shown = made.session.shown
    line, curve = shown.measurements["likelihood"][0].line, shown.frame.curves[0]
    row = int(np.flatnonzero(line.valid[:, 0])[40])
    made.session.hover(row)
    assert "no truth here" not in made.profile.text.text()
    there = curve.index != row
    of_rows = {field.name: getattr(curve, field.name) for field in dataclasses.fields(curve)}
    kept = {k: v[there] for k, v in of_rows.items() if isinstance(v, np.ndarray) and len(v) == len(there)}
    shown.frame = dataclasses.replace(shown.frame, curves=(dataclasses.replace(curve, **kept),))
    made.profile.refresh()
    told = made.profile.text.text()
    assert f"{line.u[row, 0]:.3f} px, no truth here to compare with" in told and "no line" not in told


def test_lines_of_each_method_are_switched_on_their_own(qtbot, made):
    overlay = made.overlay
    assert overlay.methods["likelihood"].isVisible() and not overlay.methods["gaussian"].isVisible()
    qtbot.mouseClick(
        overlay.method_boxes["gaussian"],
        Qt.MouseButton.LeftButton,
        pos=overlay.method_boxes["gaussian"].rect().center(),
    )
    assert overlay.methods["gaussian"].isVisible()
    curve = made.session.shown.frame.curves[0]
    assert len(overlay.methods["gaussian"].xData) > 0.9 * len(np.unique(curve.index))


def test_boxes_have_their_names_as_far_as_there_is_room(qtbot, made):
    """Beside the others, else in a row of their own, which a low panel has no height for."""
    for size, names, below in (
        ((1400, 700), (True, True), False),
        ((700, 700), (True, True), True),
        ((700, 220), (False, True), False),
        ((600, 300), (True, True), True),
        ((605, 220), (False, False), False),
        ((500, 300), (False, True), True),
        ((400, 700), (False, True), True),
        ((1400, 700), (True, True), False),
    ):
        made.resize(*size)
        qtbot.waitUntil(lambda: (made.overlay.truth_box.text() != "", made.saturated.text() != "") == names)  # noqa: B023
        qtbot.wait(20)
        assert (made.lines.y() > made.choice.y() + 10) == below
        assert made.lines.width() >= made.overlay.width_within(made.lines.width())


def test_the_whole_image_is_a_click_away_in_a_narrow_view_and_by_the_pictures_menu(qtbot, made):
    for width in (900, 400):
        made.resize(width, 500)
        qtbot.wait(20)
        shown = [one for one in (*made.zooms.buttons, made.zooms.more) if one.isVisible()]
        assert len(shown) == (2 if width == 900 else 1)
        assert all(made.zooms.x() + one.geometry().right() < made.width() for one in shown)
    fit, one_to_one = made.zooms.menu.actions()
    one_to_one.trigger()
    before = made.view.zoom
    fit.trigger()
    assert before == pytest.approx(1.0) and made.view.zoom != before
    qtbot.mouseClick(made.view.viewport(), Qt.MouseButton.RightButton, pos=made.view.viewport().rect().center())
    qtbot.waitUntil(made.zooms.menu.isVisible)
    made.zooms.menu.close()


def test_keeping_the_place_when_the_size_changes(qtbot, made):
    view = made.view
    view.box.setRange(xRange=(99.5, 199.5), yRange=(99.5, 149.5), padding=0)
    before = view.box.viewRect()
    view.keep_place((306, 256), (612, 512))
    after = view.box.viewRect()
    assert after.left() + 0.5 == pytest.approx(2 * (before.left() + 0.5), abs=0.5)
    assert after.width() == pytest.approx(2 * before.width(), rel=1e-6)


def test_the_picture_is_whole_again_for_another_sensor_and_another_project(qtbot, unrendered):
    """Dragged aside once it stayed so, or a small part of it, over projects of other sensors."""
    view, session = unrendered.view, unrendered.session

    def zoom_away():
        qtbot.waitUntil(lambda: view.item.size == unrendered._size != (0, 0))
        view.box.setRange(xRange=(-900.0, 100.0), yRange=(-900.0, 100.0), padding=0)

    def whole():
        return view._is_fitted(*view.item.size)

    camera = session.project.scene.camera
    zoom_away()
    place = view.box.viewRect()
    session.set(("sensor", "exposure_time"), 2e-3)
    live(session).refresh()
    assert view.box.viewRect() == place, "the same sensor, another picture"
    for scale in (2, 1):
        bigger = {"width": scale * camera.width, "height": scale * camera.height}
        session.set(("scene", "rig", "camera"), camera.model_copy(update=bigger))
        live(session).refresh()
        assert view.item.size == (scale * camera.width, scale * camera.height) and not whole()
    session.set(("scene", "rig", "camera"), camera.model_copy(update={"width": 2 * camera.width}))
    live(session).refresh()
    assert whole()
    zoom_away()
    session.replace_document(Document(small_project(), root=FOLDER))
    qtbot.waitUntil(lambda: view.item.size == (camera.width, camera.height) and whole())


def test_the_narrow_views_button_fits_and_so_does_a_key_in_the_picture(qtbot, made):
    made.resize(400, 500)
    qtbot.waitUntil(made.zooms.more.isVisible)
    assert made.zooms.more.text() == "Fit"
    with qtbot.waitActive(made):
        made.activateWindow()
    made.view.setFocus()
    for fit in (made.zooms.more.click, lambda: qtbot.keyClick(made.view, Qt.Key.Key_F)):
        made.view.box.setRange(xRange=(-900.0, 100.0), yRange=(-900.0, 100.0), padding=0)
        fit()
        qtbot.waitUntil(lambda: made.view._is_fitted(*made.view.item.size))


def test_what_is_fitted_stays_fitted_until_a_person_zooms(qtbot, made):
    def seen():
        shown, whole = made.view.box.viewRect(), made.view.item.boundingRect()
        return sorted((shown.width() / whole.width(), shown.height() / whole.height()))

    made.view.fit()
    for size in ((500, 900), (900, 500), (800, 700)):
        made.resize(*size)
        qtbot.waitUntil(lambda width=size[0]: abs(made.view.width() - width) < 10)
        assert 1.0 < seen()[0] < 1.03, "one side fills the view, the other has room"
    made.view.box.scaleBy((0.5, 0.5))
    made.resize(500, 900)
    qtbot.waitUntil(lambda: made.view.width() < 510)
    assert seen()[0] < 0.9, "what is zoomed to stays"


def test_a_drag_with_shift_chooses_scan_lines_and_moves_nothing(qtbot, made):
    made.view.fit()
    before, told = made.view.box.viewRect(), []
    made.session.range_dragged.connect(lambda low, high: told.append((low, high)))
    drag_with_shift(made, (10, 40), (30, 20))
    assert told == [(19.5, 40.5)]
    assert made.view.box.viewRect() == before


def test_a_range_that_results_tell_of_is_marked(qtbot, made):
    band = made.marks.bands["rows"]
    made.session.show_range((10.0, 20.5))
    assert band.isVisible() and band.getRegion() == (10.0, 20.5)
    assert not made.marks.bands["columns"].isVisible()
    made.session.show_range(None)
    assert not band.isVisible()
