"""A measure is given to another laser, or deleted, by its menu in the table."""

from __future__ import annotations

from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import Gauge
from studio.qt.results.measures_table import ReadOnlyTable
from studio.qt.results.part_menu import PartMenu
from tests.studio.qt.small_session import small_session

GAUGE = Gauge(name="Step 1", kind="step", regions=((-0.2, -0.1), (0.1, 0.2)))


def test_a_measure_is_given_to_another_laser_and_back(qtbot: QtBot) -> None:
    session, table = small_session(), ReadOnlyTable()
    qtbot.addWidget(table)
    deleted: list[bool] = []
    menu = PartMenu(session, table, lambda: deleted.append(True))
    session.set(("measures",), (GAUGE,))
    assert [one.text() for one in menu.menu_of(0).actions()] == ["Delete"], "there is one laser"
    (first,) = session.project.scene.lasers
    session.set(("scene", "rig", "lasers"), (first, first.model_copy(update={"name": "second"})))

    asked, delete = menu.menu_of(0).actions()
    lasers = asked.menu().actions()  # type: ignore[attr-defined]
    assert [(one.text(), one.isChecked()) for one in lasers] == [(first.name, True), ("second", False)]
    lasers[1].trigger()
    assert session.project.measures == (GAUGE.model_copy(update={"laser": 1}),)
    session.document.undo()
    assert session.project.measures == (GAUGE,)
    delete.trigger()
    assert deleted == [True]
