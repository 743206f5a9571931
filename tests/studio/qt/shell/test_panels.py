"""Panels that most sessions never see are made when they are first seen."""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from studio.editing.forms import describe
from studio.qt.core.session import one_of
from studio.qt.shell.panels import PANELS, Room
from studio.qt.shell.window import MainWindow
from studio.qt.study.cell_opener import CellOpener
from studio.qt.study.study_work import StudyWork
from tests.studio.qt.conftest import new_window

LATER, SOON = ({panel.key for panel in PANELS if panel.when == when} for when in ("later", "soon"))


def made(window: MainWindow) -> set[str]:
    return {key for key, _ in window.panels}


def test_a_panel_of_a_later_workspace_is_made_when_it_is_seen(own_window: MainWindow, qtbot: QtBot) -> None:
    assert made(own_window).isdisjoint(LATER)
    own_window.switch_to("study")
    assert {"study", "charts"} <= made(own_window)
    assert not made(own_window) & {"nominal", "recipe", "calibration"}
    assert own_window.panels["study"].parentWidget() is own_window.docks["study"].findChild(Room)
    qtbot.waitUntil(own_window.panels["study"].isVisible)


@pytest.mark.parametrize("workspace", ["measure", "study"])
def test_the_window_comes_before_the_view_that_takes_longest(qtbot: QtBot, tmp_path: Path, workspace: str) -> None:
    window = new_window(tmp_path, "plane")
    qtbot.addWidget(window)
    assert made(window).isdisjoint(SOON)
    window.switch_to(workspace)
    window.show()
    shown = window.winId()
    qtbot.waitUntil(lambda: not window.panels._next.isActive() and made(window) >= SOON)
    # the one window from first to last, not taken away and made anew when the view came
    assert window.winId() == shown and window.isVisible()
    assert window.centralWidget().isVisible() == window.panels["viewport"].isVisible() == (workspace == "measure")
    assert window.cloud.pinned == (workspace == "measure") and gc.isenabled()
    window.close()


def test_what_is_asked_for_before_it_came_is_made_at_once(qtbot: QtBot, tmp_path: Path) -> None:
    window = new_window(tmp_path, "plane")
    qtbot.addWidget(window)
    heard: list[object] = []
    window.panels.when_made("results", heard.append)
    window.cloud.boxed.emit(None)
    assert heard == [window.panels["results"]] and made(window) >= SOON
    window.show()
    qtbot.waitUntil(lambda: not window.panels._next.isActive())
    assert len(heard) == 1 and gc.isenabled()
    window.close()


def test_a_window_that_goes_before_its_panels_came_leaves_nothing_behind(qtbot: QtBot, tmp_path: Path) -> None:
    window = new_window(tmp_path, "plane")
    window.show()
    qtbot.waitUntil(window.panels._next.isActive)
    window.close()
    assert not window.panels._next.isActive() and gc.isenabled()
    window.deleteLater()


def test_it_is_made_once(window: MainWindow) -> None:
    asked = window.panels["study"]
    window.switch_to("study")
    window.switch_to("setup")
    window.switch_to("study")
    assert window.panels["study"] is asked


def test_an_unknown_panel_is_none(window: MainWindow) -> None:
    with pytest.raises(KeyError):
        window.panels["nothing"]


def test_a_field_is_varied_before_the_study_workspace_was_seen(own_window: MainWindow) -> None:
    path = ("scene", "rig", "lasers", 0, "power")
    spec = next(each for each in describe(own_window.session.project.scene.rig.lasers[0]) if each.name == "power")
    own_window.session.vary_asked.emit(path, spec)
    work = one_of(StudyWork, own_window.session)
    assert [each["field"] for each in work.sweep["vary"]] == ["scene.rig.lasers[0].power"]
    work.as_it_came = work.draft  # so that the window closes unasked


def test_another_workspace_is_a_sign_that_a_cell_of_a_study_is_no_longer_waited_for(
    window: MainWindow, monkeypatch: pytest.MonkeyPatch
) -> None:
    gone_on: list[str] = []
    monkeypatch.setattr(one_of(CellOpener, window.session), "go_on", lambda: gone_on.append(window.workspace))
    window.switch_to("measure")
    assert gone_on == ["setup"]


def test_the_board_to_be_held_does_not_stand_before_the_points(window: MainWindow) -> None:
    square = np.array([[[-0.1, -0.1, 0.5], [0.1, -0.1, 0.5], [0.1, 0.1, 0.5], [-0.1, 0.1, 0.5]]])
    window.session.show_ghost(square)
    actor = window.panels["viewport"].ghost.shapes.actor  # type: ignore[attr-defined]
    assert actor.GetVisibility()
    window.switch_to("measure")
    assert not actor.GetVisibility() and window.cloud.pinned
    window.switch_to("setup")
    assert actor.GetVisibility() and not window.cloud.pinned
    window.session.show_ghost(np.zeros((0, 4, 3)))
