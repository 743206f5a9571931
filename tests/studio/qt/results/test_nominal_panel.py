"""Deviation and section in the window: what is shown is what the commands write."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QMessageBox
from pytestqt.qtbot import QtBot

from analysis.report.delivery import Delivery
from render.base.errors import InputError
from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core.jobs import JobRunner
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.qt.results import section_tab
from studio.qt.results.deviation_tab import OTHERWISE, DeviationTab
from studio.qt.results.nominal_panel import NominalPanel
from studio.qt.viewport.error_cloud import ErrorCloud
from studio.qt.viewport.view3d import View3D
from studio.scan.deviation import Question, compared
from studio.scan.scan_folder import open_folder
from tests.studio.scan_of_steps import SCALE, small_scan


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return small_scan(tmp_path_factory.mktemp("steps"))


@pytest.fixture
def session(scanned: tuple[Path, Path], qtbot: QtBot) -> Iterator[Session]:
    file, folder = scanned
    made = Session(Document(Project.load(file), file))
    steps = scan_steps(made)
    steps.show(open_folder(folder))
    qtbot.waitUntil(lambda: made.shown is not None)
    yield made
    steps.close()


@pytest.fixture
def panel(session: Session, qtbot: QtBot) -> Iterator[NominalPanel]:
    runner = JobRunner()
    made = NominalPanel(session, runner)
    qtbot.addWidget(made)
    made.resize(420, 700)
    made.show()
    yield made
    runner.close()


def test_the_figures_are_those_of_the_command(
    panel: NominalPanel, scanned: tuple[Path, Path], tmp_path: Path, qtbot: QtBot
) -> None:
    tab = panel.deviation
    assert not tab.export.isEnabled()
    tab.alignment.setCurrentIndex(tab.alignment.findData("best-fit"))
    tab.least.setValue(-700.0)
    tab.most.setValue(700.0)
    tab.compare_button.click()
    qtbot.waitUntil(lambda: tab.compared is not None)
    expected = compared(scanned[1], Question(alignment="best-fit", lower=-7e-4, upper=7e-4))
    assert tab.compared is not None and tab.compared.record == expected.record
    assert not tab.map.pixmap().isNull() and "best-fit" in tab.told.text() and tab.export.isEnabled()
    tab.write(tmp_path / "d.csv")
    with open(tmp_path / "d.csv", newline="") as file:
        assert len(list(csv.DictReader(file))) == expected.record["points"]


def test_it_begins_with_the_object_and_the_limits_of_the_report(
    panel: NominalPanel, session: Session, qtbot: QtBot
) -> None:
    """The same points were judged by the report's limits there, and by others here."""
    tab = panel.deviation
    names = [tab.part.itemText(i) for i in range(tab.part.count())]
    assert len(names) > 2 and tab.question().part is None
    assert (tab.question().lower, tab.question().upper) == pytest.approx((-1e-4, 1e-4))
    told = {"surface_of": names[1], "lower": -2e-4, "upper": 3e-4}
    assert session.set(("delivery",), Delivery(**told))
    other = DeviationTab(session, panel.deviation.runner)
    qtbot.addWidget(other)
    for one in (tab, other):
        question = one.question()
        assert question.part == names[1]
        assert (question.lower, question.upper) == pytest.approx((-2e-4, 3e-4))
    # what a person asks here stays until the report says otherwise
    tab.part.setCurrentIndex(0)
    tab.most.setValue(50.0)
    session.set(("delivery", "customer"), "Ada")
    session.measured.emit()
    assert tab.question().part is None and tab.question().upper == pytest.approx(5e-5)
    session.set(("delivery",), Delivery(surface_of=names[1], upper=4e-4))
    assert tab.question().lower is None and tab.question().upper == pytest.approx(4e-4)
    session.set(("delivery",), Delivery())
    assert tab.question().part is None
    assert (tab.question().lower, tab.question().upper) == pytest.approx((-1e-4, 1e-4))


def test_the_report_takes_the_tolerance_by_a_click(panel: NominalPanel, session: Session, qtbot: QtBot) -> None:
    """The screen said "undecided", and the report of the same points had no verdict of the surface."""
    tab, told = panel.deviation, []
    session.message.connect(lambda _, text: told.append(text))
    session.set(("delivery", "customer"), "Ada")
    tab.least.setValue(-20.0)
    tab.part.setCurrentIndex(1)
    assert tab.to_report.isEnabled()
    qtbot.mouseClick(tab.to_report, Qt.MouseButton.LeftButton)
    taken = session.project.delivery
    assert (taken.customer, taken.surface_of) == ("Ada", tab.part.itemText(1))
    assert (taken.lower, taken.upper) == pytest.approx((-2e-5, 1e-4))
    assert not tab.to_report.isEnabled() and "against the part as it was scanned" in told[-1]
    tab.most.setValue(-50.0)
    qtbot.mouseClick(tab.to_report, Qt.MouseButton.LeftButton)
    assert session.project.delivery == taken and "upper is above lower" in told[-1]
    session.document.undo()
    assert not session.project.delivery.has_tolerance


def test_a_mesh_is_read_in_the_unit_that_is_chosen(panel: NominalPanel, tmp_path: Path) -> None:
    tab = panel.deviation
    panel.show_tab(tab)
    assert not tab.unit.isVisible() and tab.question().cad_unit is None
    tab.take_nominal(tmp_path / "part.stl")
    assert tab.unit.isVisible() and tab.question().cad_unit is None
    tab.unit.setCurrentIndex(tab.unit.findData("mm"))
    assert tab.question().cad_unit == "mm"
    tab.take_nominal(tmp_path / "part.step")
    assert not tab.unit.isVisible()


def test_spots_that_are_no_places_are_told(panel: NominalPanel) -> None:
    tab = panel.deviation
    assert not tab.spots.isVisible()
    tab.alignment.setCurrentIndex(tab.alignment.findData("3-2-1"))
    assert tab.spots.isVisible()
    tab.spots.setText("1,2; 3,4,5")
    tab.compare_button.click()
    box = tab.window().findChild(QMessageBox, "trouble")
    assert box is not None and tab.compared is None
    box.close()


def test_figures_of_other_inputs_say_so_until_they_are_compared_again(
    panel: NominalPanel, session: Session, tmp_path: Path, qtbot: QtBot
) -> None:
    tab = panel.deviation
    tab.compare()
    qtbot.waitUntil(lambda: tab.compared is not None)
    assert "as measured, tolerance -100 / +100 µm" in tab.told.text()
    assert not tab.changed.isVisible() and tab.export.isEnabled() and session.deviation is not None

    def looks_changed() -> bool:
        looks = {tab.changed.isVisible(), not tab.export.isEnabled(), session.deviation is None}
        assert len(looks) == 1
        return looks.pop()

    for change, back in (
        (partial(tab.most.setValue, 150.0), partial(tab.most.setValue, 100.0)),
        (partial(tab.alignment.setCurrentIndex, 1), partial(tab.alignment.setCurrentIndex, 0)),
        # without spots it cannot even be asked
        (partial(tab.alignment.setCurrentIndex, 2), partial(tab.alignment.setCurrentIndex, 0)),
        (partial(tab.take_nominal, tmp_path / "part.stl"), partial(tab.take_nominal, None)),
    ):
        change()
        assert looks_changed() and "Compare again" in tab.changed.text()
        with pytest.raises(InputError, match="other inputs"):
            tab.write(tmp_path / "d.csv")
        back()
        assert not looks_changed()
    tab.most.setValue(150.0)
    tab.compare()
    qtbot.waitUntil(lambda: tab.compared is not None)
    assert not looks_changed() and "-100 / +150 µm" in tab.told.text()


def test_an_input_that_changes_while_it_is_compared_counts(panel: NominalPanel, session: Session, qtbot: QtBot) -> None:
    tab = panel.deviation
    tab.compare()
    tab.least.setValue(-50.0)
    qtbot.waitUntil(lambda: tab.compared is not None)
    assert "-100 / +100 µm" in tab.told.text() and tab.changed.isVisible() and not tab.export.isEnabled()
    tab.compare()
    session.measured.emit()
    qtbot.waitUntil(lambda: not tab.runner.busy)
    assert tab.compared is None and "Compare again" in tab.told.text(), "of points that are shown no longer"


def test_figures_of_points_that_were_measured_before_say_why_they_are_gone(
    panel: NominalPanel, session: Session, qtbot: QtBot
) -> None:
    tab = panel.deviation
    assert tab.told.text() == ""
    tab.compare()
    qtbot.waitUntil(lambda: tab.compared is not None)
    for _ in range(2):  # more than one signal comes of a measurement
        session.measured.emit()
        assert tab.compared is None and "Compare again" in tab.told.text()


def test_points_that_were_measured_with_other_settings_say_so_beside_their_deviation(
    panel: NominalPanel, session: Session, qtbot: QtBot
) -> None:
    """With another exposure the old figures and their verdict stood there without a word."""
    tab = panel.deviation
    assert session.shown is not None
    session.show(replace(session.shown, image_scale=SCALE))  # as of a project at full size
    tab.compare()
    qtbot.waitUntil(lambda: tab.compared is not None)
    assert OTHERWISE not in tab.told.text()
    exposure = ("sensor", "exposure_time")
    session.set(exposure, 2.0 * session.project.sensor.exposure_time)
    tab.compare()
    qtbot.waitUntil(lambda: tab.compared is not None and tab.told.text().startswith(OTHERWISE))


def test_a_comparison_that_fails_leaves_no_figures(panel: NominalPanel, qtbot: QtBot) -> None:
    tab = panel.deviation
    tab.compare()
    qtbot.waitUntil(lambda: tab.compared is not None)
    tab.alignment.setCurrentIndex(tab.alignment.findData("3-2-1"))
    tab.compare()
    qtbot.waitUntil(lambda: "six spots" in tab.told.text())
    assert tab.compared is None and not tab.map.isVisible() and not tab.export.isEnabled()


def test_a_section_follows_its_plane_and_is_written(panel: NominalPanel, tmp_path: Path, qtbot: QtBot) -> None:
    tab = panel.section
    panel.show_tab(tab)
    qtbot.waitUntil(lambda: tab.section is not None)
    # begins in the middle of the points
    qtbot.waitUntil(lambda: tab.section is not None and len(tab.section.measured) > 0)
    tab.thickness.setValue(6.0)
    for box, value in zip(tab.through, (0.0, 0.0, 0.0), strict=True):
        box.setValue(value)
    qtbot.waitUntil(lambda: tab.section is not None and tab.section.plane.point == (0.0, 0.0, 0.0))
    made = tab.section
    assert made is not None and made.true
    x, _ = tab.truth.getData()
    assert np.nanmax(x) == pytest.approx(1e3 * max(line[:, 0].max() for line in made.true))
    tab.write(tmp_path / "cut.dxf")
    assert (tmp_path / "cut.dxf").read_text().startswith("999\nBlazer Studio\n")
    tab.normal.setCurrentIndex(tab.normal.count() - 1)
    assert tab.own[0].isVisible()
    for box in tab.own:
        box.setValue(0.0)
    qtbot.waitUntil(lambda: "direction" in tab.told.text())


def test_the_deviation_colours_the_points_while_it_is_looked_at(
    panel: NominalPanel, session: Session, qtbot: QtBot
) -> None:
    view = View3D()
    qtbot.addWidget(view)
    view.resize(500, 400)
    cloud = ErrorCloud(session, view)
    tab = panel.deviation
    tab.compare()
    qtbot.waitUntil(lambda: tab.compared is not None)
    found = tab.compared
    assert found is not None and cloud.meaning == "deviation" and cloud.bar.title == "Deviation"
    assert cloud.bar.sides == ("inside", "outside") and "+ is outside" in cloud.bar.toolTip()
    np.testing.assert_allclose(cloud.errors, 1e6 * found.found.value)
    assert cloud.limit == pytest.approx(200.0), "twice the tolerance, whatever false points there are"
    cloud.bar.units["deviation"] = "mm"
    cloud.bar.unit_chosen.emit()
    assert cloud.limit == pytest.approx(0.2)
    tab.in_view.setChecked(False)
    assert cloud.meaning == "error" and len(cloud.points) == len(session.shown.scan.points["x"])
    tab.in_view.setChecked(True)
    assert cloud.meaning == "deviation"
    panel.show_tab(panel.section)
    assert cloud.meaning == "error" and cloud.bar.sides == ("too near", "too far")
    view.close()


def test_an_end_of_the_colour_bar_is_dragged_to_another_value(session: Session, qtbot: QtBot) -> None:
    view = View3D()
    qtbot.addWidget(view)
    view.resize(500, 400)
    view.show()
    cloud = ErrorCloud(session, view)
    bar, (low, high) = cloud.bar, cloud.bar.limits
    assert low == -high == -cloud.limit == -10.0 and bar.unit == "mm"
    x, top, tall = bar.bar.center().x(), bar.bar.top(), bar.bar.height()
    qtbot.mousePress(bar, Qt.MouseButton.LeftButton, pos=QPoint(x, top))
    qtbot.mouseMove(bar, QPoint(x, top + round(0.25 * tall)))
    qtbot.mouseRelease(bar, Qt.MouseButton.LeftButton, pos=QPoint(x, top + round(0.25 * tall)))
    # a quarter of the bar down is half of the upper limit
    assert bar.limits == pytest.approx((0.5 * low, 0.5 * high), rel=0.02)
    by_hand = bar.limits
    actions = {action.text(): action for action in bar.menu().actions()}
    actions["µm"].trigger()
    assert bar.unit == "µm" and bar.limits == pytest.approx((1e3 * by_hand[0], 1e3 * by_hand[1]))
    actions["mm"].trigger()
    assert bar.unit == "mm" and bar.limits == pytest.approx(by_hand)
    assert np.nanmax(np.abs(cloud.errors)) < 100.0
    actions["90 % of the points"].trigger()
    assert np.mean(np.abs(cloud.errors[np.isfinite(cloud.errors)]) <= bar.limits[1]) >= 0.9
    actions["By the height"].trigger()
    assert cloud.meaning == "height" and bar.unit == "mm"
    np.testing.assert_allclose(cloud.errors, 1e3 * cloud._clouds[0]["z"])
    view.close()


def test_a_low_panel_has_the_section_beside_its_fields(panel: NominalPanel, qtbot: QtBot) -> None:
    tab = panel.section
    panel.show_tab(tab)
    for size, beside in (((420, 700), False), ((574, 250), True), ((300, 250), False), ((420, 700), False)):
        panel.resize(*size)
        qtbot.wait(20)
        assert (tab.view.x() > tab.thickness.geometry().right()) == beside
        scrolled = tab.height() > tab.parentWidget().height()
        assert not scrolled or size == (300, 250)


@pytest.mark.parametrize(("turned", "across"), [(False, 0), (True, 1)])
def test_a_section_begins_along_the_line(
    panel: NominalPanel, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch, turned: bool, across: int
) -> None:
    """Of a single frame the other plane meets the line once."""
    along, beside = np.linspace(-0.1, 0.1, 500), np.full(500, 0.02)
    names = ("y", "x") if not turned else ("x", "y")
    points = {**dict(zip(names, (along, beside), strict=True)), "z": np.zeros(500)}
    points |= {"error_surface": np.zeros(500), "row": np.arange(500), "laser": np.zeros(500, int)}
    qtbot.wait(3 * section_tab.REST_MS)
    assert panel.section._read is None, "nothing is cut before somebody looks"
    scene, root, _ = section_tab.shown_points(panel.section.session)
    monkeypatch.setattr(section_tab, "shown_points", lambda _: (scene, root, lambda: points))
    panel.show_tab(panel.section)
    qtbot.waitUntil(lambda: panel.section.section is not None)
    assert panel.section.normal.currentIndex() == across


def test_tolerance_and_slab_are_typed_in_any_unit(panel: NominalPanel, session: Session, qtbot: QtBot) -> None:
    told: list[tuple[str, str]] = []
    session.message.connect(lambda kind, text: told.append((kind, text)))
    panel.deviation.most.selectAll()
    qtbot.keyClicks(panel.deviation.most, "0.5 mm")
    qtbot.keyClick(panel.deviation.most, Qt.Key.Key_Return)
    assert panel.deviation.question().upper == pytest.approx(5e-4)
    slab = panel.section.thickness
    slab.selectAll()
    qtbot.keyClicks(slab, "2000 um")
    qtbot.keyClick(slab, Qt.Key.Key_Return)
    assert slab.value() == 2.0 and not told
    slab.selectAll()
    qtbot.keyClicks(slab, "thin")
    qtbot.keyClick(slab, Qt.Key.Key_Return)
    assert told == [("warning", "Slab: this is not a number; allowed: a number in mm")]
