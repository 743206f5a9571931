"""The table of renders: those of the session and those kept, which open again with the light that they had."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import Gauge
from analysis.gauges.read import Reading
from render.base.errors import InputError
from studio.project.document import Document
from studio.qt.core.render import Render
from studio.qt.core.session import Session
from studio.qt.render.history import History
from studio.qt.render.render_row import describe, in_short, title
from studio.qt.render.render_table import FEWEST_PX, RenderTable, as_kept, keep_render, open_render
from studio.scan.kept_renders import Kept, kept_renders
from studio.scan.redevelop import develop_again, development, measure_again
from studio.study.side_by_side import side_by_side
from tests.studio.qt.small_session import small_project, small_render


def test_a_render_is_kept_found_again_and_opened(qtbot: QtBot, tmp_path: Path) -> None:
    file = tmp_path / "project.json"
    project = small_project().save(file)
    session = Session(Document(project, file))
    history = History(session)
    qtbot.addWidget(history)
    history.show()
    world, frame = small_render()
    bits = session.project.replaced({"sensor.bits": 10})
    session.add_render(Render(1, project, world, frame))
    session.add_render(Render(2, bits, world, frame, name="ten bits"))
    kept = keep_render(session, session.renders[1], title(session.renders[1]))
    assert kept.folder == tmp_path / "renders" / "ten bits"
    table = history.open_table()
    headers = [table.table.horizontalHeaderItem(i).text() for i in range(table.table.columnCount())]  # type: ignore[union-attr]
    assert [text.split("\n")[0] for text in headers] == ["Render 1", "ten bits"], (
        "as this session's and as kept it stood there twice"
    )
    assert [row.label for row in table.rows if row.cells[0] != row.cells[1]] == ["Sensor: Bit depth"]
    assert table.developed.text().startswith("The project is now at") and "12 bit" in table.developed.text()
    assert " ten bits: developed by other settings" in table.developed.text()
    table.table.setCurrentCell(0, 0)
    assert not table.open_button.isEnabled()
    table.table.setCurrentCell(0, 1)
    assert table.open_button.isEnabled()
    table.write(tmp_path / "table.csv")
    assert (tmp_path / "table.csv").read_text().startswith(",Render 1,ten bits\n")
    del session.renders[1]
    table.open_button.click()
    assert not table.isVisible(), "it would lie over the render"
    assert len(session.renders) == 2 and session.shown is session.renders[1]
    assert session.shown.name == "ten bits" and np.array_equal(
        session.shown.frame.laser_direct[0], frame.laser_direct[0]
    )
    assert session.shown.project.sensor.bits == 10
    assert open_render(session, kept) is session.shown and len(session.renders) == 2


def test_figures_stand_beside_the_settings_that_they_were_measured_with(qtbot: QtBot, tmp_path: Path) -> None:
    """Not beside the exposure with which the render began, when it was developed by another since."""
    file = tmp_path / "project.json"
    project = small_project().save(file)
    session = Session(Document(project, file))
    world, frame = small_render()
    render = Render(1, project, world, frame)
    longer = session.project.replaced({"sensor.exposure_time": 0.009, "scene.rig.lasers[0].power": 0.005})
    how = development(project, longer)
    images = develop_again(frame, how)
    render.measurements = measure_again(frame, world, how, images, ("likelihood",), cancelled=lambda: False)
    render.made_from["measurements"] = frame, how
    session.add_render(render)
    shown = as_kept(session, render, "one")
    assert shown.project.sensor.exposure_time == 0.009 and shown.laser_power == (0.005,)
    keep_render(session, render, "one")
    (again,), wrong = kept_renders(tmp_path)
    assert not wrong and again.project == shown.project and again.laser_power == (0.005,)
    two = replace(shown, name="two", laser_power=(0.01,))
    assert any(row.cells == ("5 mW", "10 mW") for row in side_by_side([again, two]))
    # its light is that of the render: developed by the same settings the image is the same
    session.renders.clear()
    opened = open_render(session, again)
    other = develop_again(opened.frame, development(opened.project, longer))
    assert np.array_equal(other[0].pixels, images[0].pixels) and opened.final


def test_the_table_says_by_which_settings_its_figures_are(qtbot: QtBot, tmp_path: Path) -> None:
    """A render named by its exposure had the figures of another one, and the exposure stood nowhere."""
    file = tmp_path / "project.json"
    project = small_project().replaced({"sensor.exposure_time": 0.001}).save(file)
    session = Session(Document(project, file))
    history = History(session)
    qtbot.addWidget(history)
    world, frame = small_render()
    session.add_render(Render(1, project, world, frame, name="short-1ms"))
    keep_render(session, session.renders[0], "short-1ms")
    table = history.open_table()
    assert table.developed.text().startswith("All developed as the project is now: 1 ms, gain by full well, 12 bit, ")
    assert "maximum likelihood" in table.developed.text() and "Keep with the project" in table.developed.text()
    longer = session.project.replaced({"sensor.exposure_time": 0.01})
    how = development(project, longer)
    session.renders[0].made_from["measurements"] = frame, how
    session.renders[0].measurements = measure_again(
        frame, world, how, develop_again(frame, how), ("likelihood",), cancelled=lambda: False
    )
    assert session.set(("sensor", "exposure_time"), 0.01)
    exposure = next(row for row in table.rows if row.label == "Sensor: Exposure time")
    assert exposure.cells == ("10 ms", "1 ms")
    assert "The project is now at 10 ms" in table.developed.text()
    tips = {action.text(): action.toolTip() for action in history.menu_of(history.list.item(0)).actions()}
    assert "keeps no settings" in tips["Rename"] and "figures" in tips["Keep with the project"]
    table.close()


def test_a_kept_render_that_is_open_has_its_own_column_with_the_figures_of_now(qtbot: QtBot, tmp_path: Path) -> None:
    file = tmp_path / "project.json"
    project = small_project().save(file)
    session = Session(Document(project, file))
    world, frame = small_render()
    render = Render(1, project, world, frame, name="ball")
    session.add_render(render)
    kept = keep_render(session, render, "ball")
    assert not kept.figures
    how = development(project, session.project)
    images = develop_again(frame, how)
    render.measurements = measure_again(frame, world, how, images, ("likelihood",), cancelled=lambda: False)
    render.made_from["measurements"] = frame, how
    table = RenderTable(None, session, [(render, "ball")])
    qtbot.addWidget(table)
    (column,) = table.renders
    assert column.folder == kept.folder and column.figures == as_kept(session, render, "ball").figures
    table.table.setCurrentCell(0, 0)
    assert table.open_button.isEnabled()


def test_a_column_of_another_scale_is_said_not_to_be_the_scanners(qtbot: QtBot, tmp_path: Path) -> None:
    session = Session(Document(small_project()))
    history = History(session)
    qtbot.addWidget(history)
    world, frame = small_render()
    session.add_render(Render(1, small_project(), world, frame))
    session.add_render(Render(2, small_project(), world, frame, image_scale=0.25))
    table = history.open_table()
    assert table.table.horizontalHeaderItem(1).text().endswith("image scale 0.25")  # type: ignore[union-attr]
    assert "Render 2: Measured at image scale 0.25: not the scanner's figures." in table.told.text()
    table.close()


def test_a_render_is_kept_without_measures_of_a_laser_that_it_does_not_have(qtbot: QtBot, tmp_path: Path) -> None:
    file = tmp_path / "project.json"
    project = small_project().save(file)
    session = Session(Document(project, file))
    world, frame = small_render()
    render = Render(1, project, world, frame)
    session.add_render(render)
    lasers = session.project.scene.lasers
    session.set(("scene", "rig", "lasers"), (*lasers, lasers[0].model_copy(update={"name": "second"})))
    regions = ((-0.02, 0.0), (0.0, 0.02))
    both = tuple(Gauge(name=f"step {k}", kind="step", laser=k, regions=regions) for k in (0, 1))
    assert session.set(("measures",), both)
    keep_render(session, render, "one laser")
    (kept,), wrong = kept_renders(tmp_path)
    assert not wrong and kept.project.measures == both[:1]


def test_a_render_that_was_stopped_is_opened_as_stopped(qtbot: QtBot, tmp_path: Path) -> None:
    file = tmp_path / "project.json"
    project = small_project().save(file)
    session = Session(Document(project, file))
    world, frame = small_render()
    render = Render(1, project, world, frame, final=False, stopped=True)
    session.add_render(render)
    keep_render(session, render, "half")
    session.renders.clear()
    opened = open_render(session, kept_renders(tmp_path)[0][0])
    assert not opened.final and not opened.refining and as_kept(session, opened, "again").stopped


def test_the_table_opens_with_room_for_its_columns(qtbot: QtBot, tmp_path: Path) -> None:
    """However long the names of settings are: the second column was cut off."""
    file = tmp_path / "project.json"
    long = {"scene.objects[0].name": "the ball of the bearing that was measured in the workshop in May"}
    project = small_project().replaced(long).save(file)
    session = Session(Document(project, file))
    history = History(session)
    qtbot.addWidget(history)
    world, frame = small_render()
    for k, scale in enumerate((1.0, 0.5)):
        session.add_render(Render(k + 1, project.replaced({"scene.objects[0].scale": scale}), world, frame))
    table = history.open_table()
    qtbot.waitExposed(table)
    assert table.table.verticalHeader().width() > 340
    assert table.table.horizontalHeader().length() == 2 * FEWEST_PX <= table.table.viewport().width()
    table.close()


def test_the_list_tells_of_ambient_light_however_few_its_samples_are(qtbot: QtBot) -> None:
    """With a goal most of its pixels are interpolated, which is said where the words have room."""
    world, frame = small_render()
    few = tuple(replace(one, work=0.2) if one.group == "ambient" else one for one in frame.quality)
    project = small_project().replaced({"render.goal": {"depth": 0.1}})
    render = Render(1, project, world, replace(frame, quality=few))
    assert frame.quality_of("ambient") is not None
    asked = render.project.render.ambient_samples
    told = f"ambient 0.2 samples a pixel reached on average, {asked} asked, as most are interpolated"
    assert told in describe(render) and "% reached by the depth's goal" in describe(render)
    without = replace(render, project=small_project())
    assert f"% reached, {without.project.render.laser_error:.2%} asked" in describe(without)
    short = in_short(render)[1]
    assert short.startswith("reached: laser ") and short.endswith("ambient 0.2/px"), "and not what was asked for"
    many = tuple(replace(one, work=16.0) if one.group == "ambient" else one for one in frame.quality)
    said = describe(replace(render, frame=replace(frame, quality=many)))
    assert "ambient 16 samples a pixel reached on average" in said and "interpolated" not in said


def test_a_project_without_a_file_keeps_nothing(qtbot: QtBot) -> None:
    session = Session(Document(small_project()))
    world, frame = small_render()
    with pytest.raises(InputError, match="no folder"):
        keep_render(session, Render(1, small_project(), world, frame), "one")


def test_what_must_be_known_before_measures_are_compared_stands_below_with_a_mark(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gauge = Gauge(name="rise", kind="step", regions=((-0.1, 0.0), (0.0, 0.1)))
    project = small_project().model_copy(update={"measures": (gauge,)})

    def of(name: str, value: float, reason: str = "") -> Kept:
        reading = Reading(gauge, 0, value, 4e-6, 0.0, truth=value, reason=reason)
        return Kept(name, "", project, 1.0, {}, readings=(reading,))

    kept = [of("a", 0.0791), of("b", 0.0009), of("c", np.nan, "no points in its first region")]
    monkeypatch.setattr(RenderTable, "_read", lambda table: (kept, side_by_side(kept)))
    table = RenderTable(None, Session(Document(project)), [])
    qtbot.addWidget(table)
    texts = [table.table.item(0, k).text() for k in range(3)]  # type: ignore[union-attr]
    assert texts[0] == "79.1000\u00a0mm" and texts[1].endswith("(-78.2000\u00a0mm) ¹") and texts[2].endswith(" ²")
    assert "¹ b, rise: exact here 0.9000\u00a0mm" in table.told.text()
    assert "² c, rise: no points in its first region" in table.told.text()
