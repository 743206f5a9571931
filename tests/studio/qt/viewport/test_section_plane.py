"""The section's plane in the 3D view: dragged, it stands where the mouse asks, and the panel cuts and writes there."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from studio.preview.gizmo_geometry import Frame, Handle, arm_end, ring_points
from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core.jobs import JobRunner
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.qt.results.section_tab import SectionTab
from studio.qt.viewport.viewport import Viewport
from studio.scan.scan_folder import open_folder
from tests.studio.qt.viewport.viewport_hands import drag, mouse, pixel
from tests.studio.scan_of_steps import small_scan

Desk = tuple[Viewport, SectionTab]


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return small_scan(tmp_path_factory.mktemp("steps"))


@pytest.fixture
def desk(scanned: tuple[Path, Path], qtbot: QtBot) -> Iterator[Desk]:
    file, folder = scanned
    session, runner = Session(Document(Project.load(file), file)), JobRunner()
    viewport, tab, steps = Viewport(session), SectionTab(session, runner), scan_steps(session)
    viewport.resize(700, 560)
    for widget in (viewport, tab):
        qtbot.addWidget(widget)
        widget.show()
    steps.show(open_folder(folder))
    qtbot.waitUntil(lambda: not viewport._frame_soon and session.section is not None and bool(session.section.true))
    qtbot.waitUntil(lambda: not runner.busy and not tab._rest.isActive())
    yield viewport, tab
    tab.close()
    viewport.close()
    steps.close()
    runner.close()


def looked_at(viewport: Viewport) -> Frame:
    """From where its arm and rings can be had."""
    viewport.frame()
    viewport.view.look_from(viewport.view.eye.orbit(40.0, 10.0))
    QApplication.processEvents()
    frame = viewport.section.frame()
    assert frame is not None
    return frame


def test_the_arrow_moves_it_along_its_normal_and_the_files_are_of_there(
    desk: Desk, tmp_path: Path, qtbot: QtBot
) -> None:
    viewport, tab = desk
    frame, before = looked_at(viewport), tab.plane
    grip = frame.centre + 0.7 * (arm_end(frame, 2) - frame.centre)
    asked = 0.006
    drag(viewport, pixel(viewport, grip), pixel(viewport, grip + asked * frame.axes[:, 2]))
    moved = np.subtract(tab.plane.point, before.point)
    # the fields hold whole micrometres
    np.testing.assert_allclose(moved, asked * before.axes[2], atol=0.02 * asked + 1e-6)
    assert tab.plane.normal == before.normal
    assert viewport.session.section is not None and viewport.session.section.plane == tab.plane
    assert viewport.session.document.undo_label is None, "the project has not changed"
    qtbot.waitUntil(lambda: tab.section is not None and tab.section.plane == tab.plane)
    tab.write(tmp_path / "cut.csv")
    with open(tmp_path / "cut.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    of = {kind: np.array([float(row["x_m"]) for row in rows if row["of"] == kind]) for kind in ("true", "measured")}
    np.testing.assert_allclose(of["true"], tab.plane.point[0], atol=1e-9)
    assert len(of["measured"]) > 0 and np.abs(of["measured"] - tab.plane.point[0]).max() <= 0.5e-3 + 1e-9
    # seen so that y runs to the right: beside a profile it looked like another part
    assert tab.plot.getAxis("bottom").labelText == "Across = y / mm"
    assert tab.plot.getAxis("left").labelText == "Up = z / mm"


def test_a_ring_turns_it_and_escape_puts_it_back(desk: Desk) -> None:
    viewport, tab = desk
    frame, before = looked_at(viewport), tab.plane
    ring = ring_points(frame, 1, 361)
    size, eye = viewport.view.pixels, viewport.view.eye

    def held(i: int) -> bool:
        at = pixel(viewport, ring[i])
        return viewport.section._at(frame, at.x(), at.y()) == Handle("ring", 1)

    start = next(i for i in range(10, 330) if held(i) and np.isfinite(eye.project(ring[i], size)).all())
    none = Qt.KeyboardModifier.NoModifier
    for i in range(start, start + 31, 6):
        mouse(viewport, "press" if i == start else "move", pixel(viewport, ring[i]), none)
    turned = np.degrees(np.arccos(tab.plane.axes[2] @ before.axes[2]))
    assert turned == pytest.approx(30.0, abs=0.6) and tab.plane.axes[2] @ frame.axes[:, 1] == pytest.approx(0, abs=1e-4)
    assert tab.normal.currentData() is None, "no axis of the world"
    viewport._tools.cancel()
    np.testing.assert_allclose(tab.plane.axes[2], before.axes[2], atol=1e-5)
    assert tab.normal.currentIndex() == 0


def test_it_is_there_while_the_panel_is_looked_at(desk: Desk) -> None:
    viewport, tab = desk
    tab.in_view.setChecked(False)
    assert viewport.session.section is None and viewport.section.frame() is None
    tab.in_view.setChecked(True)
    assert viewport.section.frame() is not None
    tab.hide()
    assert viewport.session.section is None
