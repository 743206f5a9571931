"""Panels that most sessions never see are made when they are first seen."""

from __future__ import annotations

import pytest
from pytestqt.qtbot import QtBot

from studio.editing.forms import describe
from studio.qt.core.session import one_of
from studio.qt.shell.panels import PANELS, Room
from studio.qt.shell.window import MainWindow
from studio.qt.study.study_work import StudyWork

LATER = {panel.key for panel in PANELS if panel.later}


def made(window: MainWindow) -> set[str]:
    return {key for key, _ in window.panels}


def test_a_panel_of_a_later_workspace_is_made_when_it_is_seen(window: MainWindow, qtbot: QtBot) -> None:
    assert made(window).isdisjoint(LATER)
    window.switch_to("study")
    assert {"study", "charts"} <= made(window)
    assert not made(window) & {"nominal", "recipe", "calibration"}
    room = window.docks["study"].findChild(Room)
    assert window.panels["study"].parentWidget() is room
    qtbot.waitUntil(window.panels["study"].isVisible)


def test_it_is_made_once(window: MainWindow) -> None:
    asked = window.panels["study"]
    window.switch_to("study")
    window.switch_to("setup")
    window.switch_to("study")
    assert window.panels["study"] is asked


def test_an_unknown_panel_is_none(window: MainWindow) -> None:
    with pytest.raises(KeyError):
        window.panels["nothing"]


def test_a_field_is_varied_before_the_study_workspace_was_seen(window: MainWindow) -> None:
    path = ("scene", "rig", "lasers", 0, "power")
    spec = next(each for each in describe(window.session.project.scene.rig.lasers[0]) if each.name == "power")
    window.session.vary_asked.emit(path, spec)
    assert [each["field"] for each in one_of(StudyWork, window.session).sweep["vary"]] == ["scene.rig.lasers[0].power"]
