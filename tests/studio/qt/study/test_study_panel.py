"""The Study workspace: a study made from the inspector, looked ahead, run, stopped, extended, and a point opened."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu
from pytestqt.qtbot import QtBot

from studio.editing.scene_edits import LASERS
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.study.keeping_study import save
from studio.scan.folder_lock import hold
from studio.study.draft import VALUES
from studio.study.store import FILE
from studio.study.study import Study, ready_made
from tests.studio.qt.study.desk import NOISE, POWER, Desk, run


def filled(menu: QMenu) -> list[QAction]:
    """As it is when it opens."""
    menu.aboutToShow.emit()
    return menu.actions()


class TestDraft:
    def test_a_field_is_picked_out_of_the_inspector_and_its_values_are_typed_in_its_unit(
        self, qtbot: QtBot, desk: Desk
    ) -> None:
        desk.vary(POWER[:-1], POWER[-1])
        (row,) = desk.panel.editor.rows
        assert "Power" in row.title.text() and row.kind == "logarithmic"
        row.kinds.entered.emit("list")
        (row,) = desk.panel.editor.rows
        qtbot.mouseClick(row.values, Qt.MouseButton.LeftButton)
        row.values.selectAll()
        qtbot.keyClicks(row.values, "5, 20 40000uW")
        qtbot.keyClick(row.values, Qt.Key.Key_Return)
        assert desk.work.sweep["vary"] == [
            {"field": "scene.rig.lasers[0].power", "values": pytest.approx([0.005, 0.02, 0.04])}
        ]

    def test_values_that_will_not_do_are_told_as_the_field_is_left(self, qtbot: QtBot, desk: Desk) -> None:
        told: list[tuple[str, str]] = []
        desk.vary(POWER[:-1], POWER[-1])
        desk.session.message.connect(lambda kind, text: told.append((kind, text)))
        for field in (desk.panel.editor.rows[0].low, desk.panel.editor.limit):
            field.textEdited.emit("much")
            field.setText("much")
            field.pending = True
            field.leave()
        assert [kind for kind, _ in told] == ["warning", "warning"]
        assert all("not a number" in text and text.endswith("The value is as it was") for _, text in told)

    def test_tab_goes_down_the_panel_also_through_what_was_made_later(self, qtbot: QtBot, desk: Desk) -> None:
        """From the count of a field it went up to the study's name."""
        desk.vary(POWER[:-1], POWER[-1])
        desk.vary(NOISE[:1], NOISE[1])
        panel, rows = desk.panel, desk.panel.editor.rows
        panel.resize(420, 900)
        panel.activateWindow()
        qtbot.waitUntil(panel.isActiveWindow)
        panel.name.setFocus()
        passed = [panel.focusWidget()]
        while passed[-1] is not panel.scale and len(passed) < 40:
            qtbot.keyClick(passed[-1], Qt.Key.Key_Tab)
            passed.append(panel.focusWidget())
        line = [rows[0].kinds, rows[0].low, rows[0].high, rows[0].count, rows[1].kinds]
        assert [one for one in passed if one in line] == line and passed[-1] is panel.scale
        middles = [one.mapTo(panel.inside, one.rect().center()).y() for one in passed]
        assert all(below - above > -6 for above, below in pairwise(middles)), "6 px: beside each other"

    def test_a_field_is_varied_once_however_often_it_is_asked_for(self, desk: Desk) -> None:
        desk.vary(NOISE[:1], NOISE[1])
        desk.vary(NOISE[:1], NOISE[1])
        assert [one["field"] for one in desk.work.sweep["vary"]] == ["sensor.read_noise"]

    def test_every_field_of_the_form_that_holds_one_value_can_be_varied(self, desk: Desk) -> None:
        """Beside what is worked out from other fields, and what a study varies by its methods."""
        without = set()
        for item in (("scene", "rig", "camera"), POWER[:-1], ("sensor",), ("render",), ("extraction",)):
            desk.session.select(item)
            specs = [rows[0].spec for rows in desk.inspector.form.rows.values() if not rows[0].varied()]
            without |= {spec.name for spec in specs if spec.kind in VALUES}
        assert without == {"focal_length", "image_distance", "method"}

    def test_the_estimate_counts_cells_and_what_shares_a_render(self, qtbot: QtBot, desk: Desk) -> None:
        desk.small([2.0, 4.0, 8.0])
        desk.work.change_sweep(methods=["likelihood", "centre_of_mass"])
        desk.work.change(lambda draft: draft.update(repeats=2, set={"render.goal": None}))
        qtbot.waitUntil(lambda: desk.work.estimate is not None and desk.work.estimate.cells == 12)
        assert desk.work.estimate is not None
        assert desk.work.estimate.renders == 2 and desk.work.estimate.seconds is None
        qtbot.mouseClick(desk.panel.time, Qt.MouseButton.LeftButton)
        qtbot.waitUntil(lambda: desk.work.estimate is not None and desk.work.estimate.seconds is not None)
        assert "12 cells of 2 renders to go, about" in desk.panel.told.text()

    def test_of_several_lasers_the_one_that_is_measured_is_chosen(self, qtbot: QtBot, desk: Desk) -> None:
        desk.small([2.0, 4.0])
        assert desk.panel.laser.isHidden()
        first = desk.session.project.scene.lasers[0]
        desk.session.set(LASERS, (first, first.model_copy(update={"name": "second"})))
        assert not desk.panel.laser.isHidden() and desk.panel.laser.currentText() == first.name
        desk.panel.laser.setCurrentIndex(1)
        desk.panel.laser.activated.emit(1)
        assert desk.work.study().laser == 1 and desk.panel.laser.currentText() == "second"
        # what is not there any more is told, and another can be chosen
        desk.session.set(LASERS, (first,))
        qtbot.waitUntil(lambda: "no such laser" in desk.panel.problem.text())
        assert not desk.panel.laser.isHidden()
        desk.panel.laser.activated.emit(0)
        assert desk.work.study().laser == 0 and desk.panel.laser.isHidden()

    def test_a_chart_says_which_of_several_lasers_it_is_of_whatever_is_chosen_now(
        self, qtbot: QtBot, desk: Desk, tmp_path: Path
    ) -> None:
        desk.small([2.0, 4.0])
        desk.work.choose_folder(tmp_path / "results")
        (first,) = desk.session.project.scene.lasers
        desk.session.set(LASERS, (first, first.model_copy(update={"name": "second"})))
        run(qtbot, desk)
        told = f"of {first.name}, one of 2 lasers"
        qtbot.waitUntil(lambda: told in desk.charts.question.text())
        desk.panel.laser.activated.emit(1)
        now = f"Laser: {first.name} in the folder, second now"
        qtbot.waitUntil(lambda: now in desk.panel.problem.text())
        assert told in desk.charts.question.text() and not desk.charts.question.isHidden()

    def test_a_study_that_nobody_has_begun_is_no_fault(self, desk: Desk) -> None:
        desk.work.look_ahead()
        assert not desk.panel.problem.text() and "varies a field" in desk.panel.told.text()
        assert not desk.panel.foot.run.isEnabled()

    def test_what_is_impossible_is_told_by_the_name_of_the_sweep_and_nothing_runs(
        self, qtbot: QtBot, desk: Desk
    ) -> None:
        desk.small([2.0, -3.0])
        qtbot.waitUntil(lambda: "read_noise" in desk.panel.problem.text())
        assert not desk.panel.foot.run.isEnabled()
        desk.work.change_sweep(sampling="bisection")
        desk.work.look_ahead()
        assert desk.panel.problem.text().startswith("Sweep 1: bisection takes ranges")

    @pytest.mark.parametrize("name", ready_made())
    def test_every_ready_made_study_is_shown_as_it_is(self, desk: Desk, qtbot: QtBot, name: str) -> None:
        """With the one before it still there: a form that stops half way shows some of both."""
        desk.small([1.0, 2.0])
        desk.work.load(name)
        editor = desk.panel.editor
        for number, sweep in enumerate(desk.work.study().sweeps):
            desk.work.choose_sweep(number)
            shown = [field.values[field.currentIndex()] for field in (editor.sampling, editor.chart, editor.measure)]
            assert shown == [sweep.sampling, sweep.chart, sweep.measure]
            assert len(editor.rows) == (0 if sweep.sampling == "effects" else len(sweep.vary))
        qtbot.waitUntil(lambda: desk.work.estimate is not None or desk.work.problem != "")
        assert desk.work.problem == "" == desk.work.failure

    def test_effects_are_chosen_and_left_again(self, desk: Desk) -> None:
        desk.small([1.0, 2.0])
        editor = desk.panel.editor
        desk.work.change(lambda draft: draft.update(repeats=3))
        editor.sampling.entered.emit("effects")
        (sweep,) = desk.work.study().sweeps
        assert (sweep.sampling, sweep.chart) == ("effects", "budget") and not editor.add.isVisible()
        editor.sampling.entered.emit("grid")
        assert desk.work.sweep["vary"] == [] and desk.work.sweep["chart"] == "sweep" and editor.add.isVisible()

    def test_a_ready_made_study_comes_with_its_own_base(self, qtbot: QtBot, desk: Desk) -> None:
        desk.work.load("quick")
        assert desk.panel.sweeps.count() == 6 and desk.work.project().name != ""
        qtbot.waitUntil(lambda: desk.work.estimate is not None and desk.work.estimate.cells > 600)
        assert set(desk.work.loaded) == {"dark_plate", "shiny_weld_seam"}
        told = desk.panel.not_open
        assert told.isVisible() and "not the open project" in told.text(), "“Of” changed without a word"
        desk.work.use_open_project()
        assert told.isHidden()
        assert desk.work.draft["base"] == "plane.json" and desk.work.project() is desk.session.project

    def test_a_ready_made_study_is_saved_elsewhere_with_changes_of_ones_own(self, desk: Desk, tmp_path: Path) -> None:
        desk.work.load("quick")
        desk.work.change(lambda draft: draft.update(repeats=3))
        assert save(desk.work, tmp_path / "mine.json"), desk.work.problem
        mine, root = Study.load(tmp_path / "mine.json")
        assert mine.repeats == 3 and mine.bases(root) == desk.work.loaded

    def test_a_saved_study_asks_the_same(self, qtbot: QtBot, desk: Desk, tmp_path: Path) -> None:
        desk.small([2.0, 20.0])
        assert save(desk.work, tmp_path / "noise.json")
        before = desk.work.study()
        desk.work.start_anew()
        desk.work.load(tmp_path / "noise.json")
        assert desk.work.study() == before

    @pytest.mark.parametrize("saves", [True, False])
    def test_the_project_is_to_be_saved_before_anybody_is_asked_where_the_study_goes(
        self, desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, saves: bool
    ) -> None:
        """It was refused after the dialog of files had been answered."""
        asked: list[str] = []

        def where(*_: object) -> tuple[str, str]:
            asked.append("where")
            return str(tmp_path / "noise.json"), ""

        def first(parent: object, name: str, why: str) -> bool:
            asked.append("first")
            return saves

        monkeypatch.setattr("studio.qt.study.study_panel.QFileDialog.getSaveFileName", where)
        monkeypatch.setattr("studio.qt.core.save_first.ask_to_save_first", first)
        document = desk.session.document
        desk.session.save_asked.connect(lambda: document.save(tmp_path / "plane.json"))
        desk.small([2.0, 20.0])
        assert desk.session.set(NOISE, 3.0)
        save = next(action for action in filled(desk.panel.files.menu()) if action.text() == "Save the study…")
        save.trigger()
        assert asked == (["first", "where"] if saves else ["first"])
        assert (tmp_path / "noise.json").exists() is saves and not desk.work.failure

    def test_nobody_is_asked_where_a_study_goes_that_cannot_be_saved(
        self, desk: Desk, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        told: list[tuple[str, str]] = []
        desk.session.message.connect(lambda level, text: told.append((level, text)))
        monkeypatch.setattr("studio.qt.study.study_panel.QFileDialog.getSaveFileName", lambda *_: pytest.fail("asked"))
        save = next(action for action in filled(desk.panel.files.menu()) if action.text() == "Save the study…")
        save.trigger()  # nothing is varied yet
        assert told == [("warning", "The study cannot be saved: Sweep 1: 0 fields are varied; allowed: 1 to 8")]

    def test_the_panel_has_room_for_every_kind_of_row(self, qtbot: QtBot, desk: Desk) -> None:
        """At its narrowest nothing is cut off, nor hidden behind the edge of the scrolled part."""
        desk.vary(POWER[:-1], POWER[-1])
        desk.vary(NOISE[:1], NOISE[1])
        desk.small([2.0, 20.0])
        desk.vary(("render",), "transport")
        desk.work.change_sweep(sampling="bisection", limit={"measure": "completeness", "value": 0.9, "above": False})
        desk.panel.resize(desk.panel.minimumSizeHint().width(), 500)
        qtbot.wait(50)
        inside = desk.panel.inside
        assert inside.minimumSizeHint().width() <= inside.width() <= desk.panel.width()
        assert [row.width() >= row.minimumSizeHint().width() for row in desk.panel.editor.rows] == 3 * [True]


class TestRun:
    def test_charts_fill_and_more_values_are_added_without_losing_what_is_there(
        self, qtbot: QtBot, desk: Desk, tmp_path: Path
    ) -> None:
        desk.small([2.0, 20.0])
        desk.work.choose_folder(tmp_path / "results")
        run(qtbot, desk)
        assert desk.work.problem == "" and desk.work.found is not None
        first = dict(desk.work.found.rows)
        assert len(first) == 2 and desk.charts.table.rowCount() == 2
        desk.small([2.0, 20.0, 60.0])
        qtbot.waitUntil(lambda: desk.work.estimate is not None and desk.work.estimate.cells == 1)
        assert desk.panel.foot.run.text() == "Go on"
        run(qtbot, desk)
        rows = desk.work.found.rows
        assert len(rows) == 3 and {key: rows[key] for key in first} == first  # their seconds as well: not done twice
        assert {"table.csv", "study.html", FILE} <= {path.name for path in (tmp_path / "results").iterdir()}

    def test_it_stops_and_goes_on_where_it_stood(self, qtbot: QtBot, desk: Desk, tmp_path: Path) -> None:
        desk.vary(POWER[:-1], "wavelength_nm")  # each value takes a render
        desk.work.set_values(0, {"field": "scene.rig.lasers[0].wavelength_nm", "values": [450.0, 520.0, 660.0]})
        desk.work.change(lambda draft: draft.update(image_scale=0.05, repeats=1))
        desk.work.choose_folder(tmp_path / "results")

        def enough(*_: object) -> None:
            if desk.work.found is not None and desk.work.found.rows and desk.work.running:
                desk.work.stop()

        desk.work.found_changed.connect(enough)
        run(qtbot, desk)
        desk.work.found_changed.disconnect(enough)
        assert desk.work.found is not None
        first = dict(desk.work.found.rows)
        assert 0 < len(first) < 3
        qtbot.waitUntil(lambda: desk.panel.foot.run.text() == "Go on")
        run(qtbot, desk)
        rows = desk.work.found.rows
        assert len(rows) == 3 and {key: rows[key] for key in first} == first

    def test_a_point_opens_the_frame_that_was_measured(self, qtbot: QtBot, desk: Desk, tmp_path: Path) -> None:
        """Rendered again, and developed by the cell's own sensor whatever the open project has: the same numbers."""
        desk.small([2.0, 20.0])
        desk.work.change_sweep(methods=["centre_of_mass"])
        desk.work.choose_folder(tmp_path / "results")
        run(qtbot, desk)
        desk.session.set(NOISE, 3.5)
        develop = DevelopPanel(desk.session)
        qtbot.addWidget(develop)
        qtbot.waitUntil(lambda: desk.charts.chart.drawing is not None and len(desk.charts.chart.drawing.spots) == 2)
        assert desk.charts.chart.drawing is not None
        place = QPointF(*desk.charts.chart.drawing.spots[1])
        with qtbot.waitSignals([desk.charts.opener.opened, desk.session.measured]):
            qtbot.mouseClick(desk.charts.chart, Qt.MouseButton.LeftButton, pos=place.toPoint())
        assert desk.work.found is not None and desk.session.shown is not None
        row = desk.work.found.rows[desk.session.shown.cell]
        measured = desk.session.shown.measurements["centre_of_mass"][0].errors
        assert (measured.depth_z.rmse, measured.u.rmse) == (row["depth_rmse"], row["position_rmse"])
        assert not desk.session.shown.is_stale(desk.session.project)
        desk.charts.open(1)  # it is among the renders already
        assert len(desk.session.renders) == 1
        desk.session.set(NOISE, 3.0)  # the sensor is no part of the scene
        assert desk.session.shown is not None
        desk.session.set((*POWER[:-1], "fan_angle"), 0.7)  # the live estimate is of the scene that is changed
        assert desk.session.shown is None and len(desk.session.renders) == 1
        develop.close()

    def test_who_has_gone_on_is_told_of_the_frame_and_sees_what_was_shown(
        self, qtbot: QtBot, desk: Desk, tmp_path: Path
    ) -> None:
        desk.small([2.0])
        desk.work.choose_folder(tmp_path / "results")
        run(qtbot, desk)
        told: list[str] = []
        desk.session.message.connect(lambda level, text: told.append(text))
        desk.charts.opener.opened.connect(lambda: told.append("opened"))
        desk.charts.open(0)
        desk.charts.opener.go_on()
        assert told[-1].startswith("The cell of the study is still being rendered")
        qtbot.waitUntil(lambda: bool(desk.session.renders))
        assert desk.session.shown is None
        assert told[-1].startswith(f"The cell “{desk.session.renders[0].name}” is ready in the list of renders")
        desk.charts.opener.go_on()
        assert "is ready" in told[-1]
        with qtbot.waitSignal(desk.charts.opener.opened):
            desk.charts.open(0)
        assert desk.session.shown is desk.session.renders[0]

    def test_results_of_another_day_are_opened(self, qtbot: QtBot, desk: Desk, tmp_path: Path) -> None:
        desk.small([2.0, 20.0])
        desk.work.choose_folder(tmp_path / "results")
        run(qtbot, desk)
        draft = desk.work.study()
        desk.work.start_anew()
        assert desk.charts.answer is None
        desk.work.open_folder(tmp_path / "results")
        qtbot.waitUntil(lambda: desk.charts.answer is not None)
        assert desk.work.study() == draft and desk.charts.table.rowCount() == 2


class TestTrouble:
    """Told in the panel in a sentence; nothing is lost."""

    def test_a_folder_that_cannot_be_written(self, qtbot: QtBot, desk: Desk, tmp_path: Path) -> None:
        (tmp_path / "file").write_text("in the way")
        desk.small([2.0])
        desk.work.choose_folder(tmp_path / "file" / "results")
        run(qtbot, desk)
        assert "cannot be" in desk.panel.problem.text() and "--out" not in desk.panel.problem.text()

    def test_another_program_works_in_the_folder(self, qtbot: QtBot, desk: Desk, tmp_path: Path) -> None:
        desk.small([2.0])
        desk.work.choose_folder(tmp_path / "results")
        with hold(tmp_path / "results"):
            run(qtbot, desk)
        assert "another program works in this folder" in desk.panel.problem.text()

    def test_the_folder_is_of_another_study_or_program(
        self, qtbot: QtBot, desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        desk.small([2.0])
        desk.work.choose_folder(tmp_path / "results")
        run(qtbot, desk)
        monkeypatch.setattr("studio.study.study.program_digest", lambda: "a later version")
        desk.small([2.0, 4.0])
        run(qtbot, desk)
        assert "program differ" in desk.panel.problem.text()
        assert desk.work.found is not None and len(desk.work.found.rows) == 1


def test_the_rings_stand_where_the_figure_has_its_marks(desk: Desk) -> None:
    """Of each kind of chart, by the headless figure's own artists."""
    from analysis.study.intervals import mean_interval
    from studio.study.answers import Answer, Spot
    from studio.study.charts import chart, places
    from studio.study.study import Sweep

    for kind in ("sweep", "speed"):
        sweep = Sweep.model_validate({"name": "s", "vary": [{"field": "seed", "values": ["b", "a"]}], "chart": kind})
        spots = tuple(
            Spot((value,), "likelihood", mean_interval(np.array([1e-6, 2e-6]) * (i + 1)), 0.1 * (i + 1))
            for i, value in enumerate(("b", "a"))
        )
        answer = Answer(sweep, spots, None, ())
        drawn = [line.get_xydata() for line in chart(answer, {}).axes[0].lines if len(line.get_xydata()) == 2]
        assert any(np.allclose(np.sort(marks, axis=0), np.sort(places(answer), axis=0)) for marks in drawn)
