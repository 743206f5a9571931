"""The develop panel: sensor and power change the shown render at once, never rendering; measures follow."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QIcon

from analysis.gauges.gauge import Gauge
from studio.project.document import replaced
from studio.qt.core.figures_age import FiguresAge
from studio.qt.core.live_preview import live
from studio.qt.core.session import one_of
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.results.heads import AWAITED, MEASURING, REFINING, heads
from studio.scan.redevelop import development
from studio.scan.remarks import frame_remarks
from tests.studio.qt.small_session import small_session


@pytest.fixture
def panel(qtbot):
    made = DevelopPanel(small_session(rendered=True))
    qtbot.addWidget(made)
    made.resize(340, 480)
    made.show()
    qtbot.waitExposed(made)
    settle(qtbot, made)
    yield made
    made.close()


def settle(qtbot, panel):
    """All that was asked for is done."""
    panel.refresh()
    qtbot.waitUntil(lambda: not panel.busy)


def type_into(qtbot, box, text):
    box.setFocus()
    box.selectAll()
    qtbot.keyClicks(box, text)
    qtbot.keyClick(box, Qt.Key.Key_Return)


def electrons(panel):
    image = panel.session.shown.images[0]
    return float(np.sum((image.pixels - image.black_level) / image.gain))


def test_a_shown_render_is_developed_and_measured_by_every_method(panel):
    render = panel.session.shown
    assert set(render.measurements) == {"likelihood", "gaussian", "centre_of_mass"}
    assert render.images[0].pixels.shape == render.frame.shape
    assert "µm" in panel.table.text() and "DN" in panel.told.text()


def test_of_several_lasers_each_has_its_name(panel):
    """They stood there as "likelihood, 1" and "likelihood, 2"."""
    render = panel.session.shown
    laser = render.project.scene.lasers[0]
    two = replaced(render.project, ("scene", "rig", "lasers"), (laser, laser.model_copy(update={"name": "left <2>"})))
    panel._told_of = replace(render, project=two)
    (one,) = render.measurements["likelihood"]
    panel._tell_measures({"likelihood": [one, replace(one, laser=1)]})
    assert f", {laser.name}&nbsp;" in panel.table.text() and ", left &lt;2&gt;&nbsp;" in panel.table.text()


def test_typing_half_the_exposure_halves_the_electrons_without_rendering(qtbot, panel):
    session = panel.session
    qtbot.mouseClick(panel.noise, Qt.MouseButton.LeftButton, pos=QPoint(8, panel.noise.height() // 2))
    assert not panel.noise.isChecked()
    settle(qtbot, panel)
    frame, before = session.shown.frame, electrons(panel)
    exposure = session.project.sensor.exposure_time
    with qtbot.waitSignal(session.measured, timeout=20000):
        type_into(qtbot, panel.exposure.box, f"{0.5e3 * exposure:.4f}")
    assert session.project.sensor.exposure_time == pytest.approx(exposure / 2, rel=1e-3)
    # quantisation: half a step in 12 bits on every pixel at most
    assert electrons(panel) == pytest.approx(before / 2, rel=0.05)
    assert session.shown.frame is frame
    session.document.undo()
    assert panel.exposure.box.value() == pytest.approx(1e3 * exposure, abs=1e-3)


def test_what_is_warned_of_is_of_the_exposure_that_was_measured(qtbot, panel):
    """Saturation was told of as it was when the render began, whatever the exposure was then."""
    session = panel.session
    exposure = 1e3 * session.project.sensor.exposure_time
    for times, told in ((1000.0, True), (1.0, False)):
        with qtbot.waitSignal(session.measured, timeout=20000):
            type_into(qtbot, panel.exposure.box, f"{times * exposure:.4f}")
        settle(qtbot, panel)
        assert any("of the scan lines the brightest pixel saturates" in text for text in session.shown.doubts) == told


def test_what_saturates_is_counted_in_the_image_that_is_shown_and_told_once(qtbot, panel):
    """Of one image 14 % of the scan lines were told, as was expected of the light, and 15.8 % of the peaks below it."""
    session, render = panel.session, panel.session.shown
    hit, image = np.unique(render.frame.curves[0].index), render.images[0]
    # so that half of the line saturates
    times = (image.saturation - image.black_level) / (np.median(image.pixels[hit].max(axis=1)) - image.black_level)
    with qtbot.waitSignal(session.measured, timeout=20000):
        type_into(qtbot, panel.exposure.box, f"{1e3 * times * session.project.sensor.exposure_time:.4f}")
    settle(qtbot, panel)
    counted = np.mean(render.images[0].pixels[hit].max(axis=1) >= image.saturation)
    assert 0.1 < counted < 0.95
    said = frame_remarks(render.measured_as, render.frame, render.measurements, render.doubts)
    (told,) = [text for text in said if "saturat" in text.lower() and "%" in text]
    assert f": on {counted:.0%} of the scan lines the brightest pixel saturates" in told


def test_dragging_the_slider_is_one_step_of_the_history(qtbot, panel):
    document = panel.session.document
    slider = panel.exposure.slider
    slider.setSliderDown(True)
    for value in range(400, 460, 5):
        slider.setValue(value)
    slider.setSliderDown(False)
    assert len(document._undo) == 1 and document.undo_label == "change exposure"
    settle(qtbot, panel)


def test_the_laser_power_scales_its_own_light(qtbot, panel):
    session = panel.session
    power = session.project.scene.lasers[0].power
    peak = int(session.shown.images[0].pixels.max())
    with qtbot.waitSignal(session.measured, timeout=20000):
        type_into(qtbot, panel.powers[0].box, f"{1e3 * power / 4:.3f}")
    assert int(session.shown.images[0].pixels.max()) < 0.5 * peak
    assert session.project.scene.lasers[0].power == pytest.approx(power / 4, rel=1e-3)


def test_bits_and_gain_are_edits_of_the_sensor(qtbot, panel):
    session = panel.session
    panel.bits.setFocus()
    panel.bits.setCurrentIndex(0)
    panel.bits.activated.emit(0)
    settle(qtbot, panel)
    assert session.shown.images[0].pixels.dtype == np.uint8
    assert not panel.gain.isEnabled()
    qtbot.mouseClick(panel.automatic_gain, Qt.MouseButton.LeftButton, pos=QPoint(8, panel.automatic_gain.height() // 2))
    assert session.project.sensor.gain is not None and panel.gain.isEnabled()
    type_into(qtbot, panel.gain.box, "0.01")
    settle(qtbot, panel)
    assert session.shown.images[0].gain == pytest.approx(0.01)


def test_an_unchecked_method_is_not_measured(qtbot, panel):
    with qtbot.waitSignal(panel.session.measured, timeout=20000):
        panel.methods["centre_of_mass"].trigger()
    assert set(panel.session.shown.measurements) == {"likelihood", "gaussian"}
    assert not panel.methods["likelihood"].isEnabled() and "1 more" in panel.methods_button.text()


def test_an_impossible_value_is_refused_and_the_field_goes_back(qtbot, panel):
    session = panel.session
    before = session.project.sensor.exposure_time
    with qtbot.waitSignal(session.message) as told:
        type_into(qtbot, panel.exposure.box, "0")
    assert told.args[0] == "error"
    assert session.project.sensor.exposure_time == before
    assert panel.exposure.box.value() == pytest.approx(1e3 * before, abs=1e-3)


def test_many_changes_in_a_row_end_with_the_last_one(qtbot, panel):
    session, count = panel.session, []
    session.developed.connect(lambda: count.append(session.shown.images[0]))
    for i in range(30):
        session.set(("sensor", "exposure_time"), 1e-3 * (1 + i))
    qtbot.waitUntil(lambda: not panel.busy)
    assert len(count) <= 5
    from studio.scan.redevelop import develop_again

    how = development(session.shown.project, session.project)
    assert np.array_equal(count[-1].pixels, develop_again(session.shown.frame, how)[0].pixels)


def test_without_a_render_it_says_what_to_do(qtbot):
    made = DevelopPanel(small_session())
    qtbot.addWidget(made)
    assert "Render" in made.told.text() or made.told.text() == ""
    made.refresh()
    assert "Render" in made.told.text()
    made.close()


def test_exposures_and_the_choice_of_peaks_are_the_projects_and_told(qtbot, panel):
    session = panel.session
    panel.exposures.setCurrentIndex(2)
    panel.exposures.activated.emit(2)
    for box in (panel.continuous, panel.possible):
        qtbot.mouseClick(box, Qt.MouseButton.LeftButton, pos=QPoint(8, box.height() // 2))
    extraction = session.project.extraction
    assert (extraction.exposures, extraction.select, extraction.geometry) == (3, "continuous", True)
    settle(qtbot, panel)
    image = session.shown.images[0]
    assert [one.exposure_time for one in (image, *image.shorter)] == pytest.approx(
        [session.project.sensor.exposure_time / 4**k for k in range(3)]
    )
    line = session.shown.measurements["likelihood"][0].line
    assert line.candidates is not None and line.valid.mean() > 0.5
    assert "3 exposures fused" in panel.noted.text() and "fan" in panel.noted.text()
    session.document.undo()
    assert not panel.possible.isChecked()


def test_one_click_exposes_by_the_render_and_is_one_step_to_undo(qtbot, panel):
    session = panel.session
    before, told = session.project.sensor.exposure_time, []
    session.message.connect(lambda level, text: told.append(text))
    with qtbot.waitSignal(session.measured, timeout=20000):
        qtbot.mouseClick(panel.automatic_exposure, Qt.MouseButton.LeftButton)
    assert "peaks, without noise and glints, are aimed at 70% of full scale, by Render 1" in told[-1]
    assert "brightest pixel of all " in panel.told.text(), "not the line alone"
    time = session.project.sensor.exposure_time
    assert time != before and session.document.undo_label == "automatic exposure"
    settle(qtbot, panel)
    image = session.shown.images[0]
    curve = session.shown.frame.curves[0]
    rows = image.pixels[curve.index].max(axis=1) / image.saturation
    # noise: a peak of thousands of electrons is a few percent off, and so is a sensor's black level
    assert np.quantile(rows, 0.95) < 0.95 and np.quantile(rows, 0.995) > 0.6
    session.document.undo()
    assert session.project.sensor.exposure_time == before


def test_a_render_that_cannot_be_exposed_by_is_named_with_the_reason(qtbot, panel):
    session, told = panel.session, []
    session.message.connect(lambda level, text: told.append(text))
    qtbot.waitUntil(lambda: not live(session).is_loading)
    session.shown.name = "mine"
    session.shown.cell = "some"
    panel.expose()
    assert "mine is a cell of a study" in told[-1]
    session.shown.cell = ""
    session.shown.final = False
    panel.expose()
    assert "mine is not finished" in told[-1]
    session.set(("scene", "rig", "lasers", 0, "wavelength_nm"), 660.0)
    panel.expose()
    assert "as estimated for the present scene, as mine is of another scene" in told[-1]


def test_without_a_render_the_exposure_is_as_estimated(qtbot, panel):
    session, told = panel.session, []
    session.message.connect(lambda level, text: told.append(level))
    session.renders, session.shown = [], None
    session.renders_changed.emit()
    qtbot.waitUntil(lambda: not live(session).is_loading)
    session.set(("sensor", "exposure_time"), 1e-6, "dark")
    panel.expose()
    assert session.project.sensor.exposure_time > 1e-5 and told[-1] == "info"
    session.set(("scene", "objects"), (), "nothing to see")
    qtbot.waitUntil(lambda: live(session).look.project is session.project)
    before = session.project
    panel.expose()
    assert session.project is before and told[-1] == "error"


def test_while_light_is_to_come_one_method_measures_and_the_last_frame_is_developed_once(qtbot, monkeypatch):
    from studio.qt.render import develop_panel

    developed = []
    once = develop_panel.develop_again
    monkeypatch.setattr(
        develop_panel,
        "develop_again",
        lambda frame, *rest, **more: developed.append(frame) or once(frame, *rest, **more),
    )
    session = small_session(rendered=True)
    render = session.shown
    render.final = False
    made = DevelopPanel(session)
    qtbot.addWidget(made)
    made.refresh()
    qtbot.waitUntil(lambda: not made.busy)
    assert set(render.measurements) == {"likelihood"}
    first = render.measurements["likelihood"]
    # another frame so soon waits for the render, which has the processor
    render.frame = replace(render.frame, seconds=1.0)
    session.renders_changed.emit()
    assert made._later.isActive() and len(developed) == 1
    qtbot.waitUntil(lambda: not made.busy)
    assert len(developed) == 2 and render.measurements["likelihood"] is not first
    second, render.final = render.measurements["likelihood"], True
    session.renders_changed.emit()
    assert not made._later.isActive(), "what ended does not wait"
    qtbot.waitUntil(lambda: not made.busy)
    assert set(render.measurements) == {"likelihood", "gaussian", "centre_of_mass"}
    assert len(developed) == 2 and render.measurements["likelihood"] is second
    made.close()


def test_no_figure_is_shown_while_the_noise_of_ambient_light_is_to_come(qtbot):
    """The first figures were of laser light alone, a sixth too good."""
    session = small_session(rendered=True)
    render = session.shown
    whole, render.final = render.frame, False
    assert not whole.awaits_ambient
    laser = tuple(one for one in whole.quality if one.group != "ambient")
    render.frame = replace(whole, ambient=None, quality=laser)
    made = DevelopPanel(session)
    qtbot.addWidget(made)
    made.refresh()
    qtbot.waitUntil(lambda: bool(render.images) and not made.busy)
    assert render.frame.awaits_ambient and not render.measurements and AWAITED in heads(session, "")
    # light without figures waits, so that they come sooner
    made._rest_from(made._began - 60.0)
    render.frame = replace(render.frame, seconds=1.0)
    session.renders_changed.emit()
    assert made._later.isActive() and made.runner.job("develop") is None
    render.frame = whole
    session.renders_changed.emit()
    assert made.runner.job("develop") is not None and not made._later.isActive(), "the first figures wait for nothing"
    qtbot.waitUntil(lambda: bool(render.measurements) and not made.busy)
    assert REFINING in heads(session, "")
    render.final = True
    assert not {REFINING, AWAITED} & set(heads(session, ""))
    made.close()


def test_a_change_of_the_scene_alone_measures_nothing_again(qtbot, panel, monkeypatch):
    from studio.qt.render import develop_panel

    session = panel.session
    monkeypatch.setattr(develop_panel, "measure_again", lambda *_, **__: pytest.fail("nothing changed"))
    session.set(("scene", "rig", "lasers", 0, "fan_angle"), 0.5)
    qtbot.waitUntil(lambda: not panel.busy)
    session.document.undo()
    qtbot.waitUntil(lambda: not panel.busy)


def test_figures_of_the_settings_before_are_told_until_they_are_measured_again(qtbot, panel, monkeypatch):
    from studio.qt.render import develop_panel

    session, go_on, measure = panel.session, threading.Event(), develop_panel.measure_again
    age = one_of(FiguresAge, session)
    assert not age.old and panel.table.isEnabled()

    def slowly(*given, **more):
        assert go_on.wait(60.0)
        return measure(*given, **more)

    monkeypatch.setattr(develop_panel, "measure_again", slowly)
    with qtbot.waitSignal(age.changed):
        session.set(("sensor", "exposure_time"), 1.1 * session.project.sensor.exposure_time)
    assert MEASURING in heads(session, "") and not panel.table.isEnabled()
    with qtbot.waitSignal(age.changed):
        go_on.set()
    assert MEASURING not in heads(session, "") and panel.table.isEnabled()


def test_what_is_measured_at_once_is_not_told(qtbot, panel):
    session = panel.session
    age = one_of(FiguresAge, session)
    render, made = session.shown, session.shown.made_from["measurements"]
    session.set(("sensor", "exposure_time"), 1.1 * session.project.sensor.exposure_time)
    assert age._timer.isActive() and not age.old
    render.made_from["measurements"] = (made[0], development(render.project, session.project))
    session.measured.emit()
    assert not age._timer.isActive() and not age.old


def test_measures_of_the_part_make_no_figure_old(qtbot, panel):
    """They are read off at once: the words that measuring goes on stood until the exposure was changed."""
    session = panel.session
    age = one_of(FiguresAge, session)
    gauge = Gauge(kind="step", regions=((-0.25, -0.15), (0.15, 0.25)))
    session.set(("measures",), (gauge,))
    session.set(("measured_in",), "upright")
    assert not age._timer.isActive() and not age.old
    session.document.undo()
    session.document.undo()


def test_a_chosen_method_has_a_tick_in_its_colour(qtbot, panel):
    """A menu shows the colour in place of a tick, so that nobody saw which were chosen."""
    action = panel.methods_menu.actions()[0]
    shown = [
        action.icon().pixmap(16, 16, QIcon.Mode.Normal, state).toImage() for state in (QIcon.State.Off, QIcon.State.On)
    ]
    assert shown[0] != shown[1]
