"""The calibration that a project came with stands in the panel of results until another one is made."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPoint
from PySide6.QtGui import QHelpEvent
from PySide6.QtWidgets import QApplication, QToolTip
from pytestqt.qtbot import QtBot

from studio.calibration.words import WARP, parameter_rows
from studio.project.calibration import Calibration
from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.calibrate.keeping import remove, use
from studio.qt.calibrate.result_panel import BOARD_WARP, EMPTY, OWN
from tests.studio.qt.calibrate.calibrate_desk import LINE, Desk

FOLDER = template_folder("plane")


def reopened(qtbot: QtBot, desk: Desk) -> str:
    """The project with the calibration that was made, opened anew; what is told of it."""
    use(desk.work)
    desk.found.resize(420, 600)
    desk.found.show()
    assert OWN not in desk.found.text.toPlainText(), "what was calibrated just now is told"
    open_again(desk, desk.session.project)
    qtbot.waitUntil(lambda: desk.found.depths.found is not None, timeout=60_000)
    return desk.found.text.toPlainText()


def open_again(desk: Desk, project: Project) -> None:
    desk.session.replace_document(Document(project, root=FOLDER))


def test_it_is_told_when_the_project_is_opened_again(qtbot: QtBot, solved: Desk) -> None:
    assert solved.work.solved is not None
    result = solved.work.solved.result
    told = reopened(qtbot, solved)
    name = solved.session.project.scene.lasers[0].name
    assert solved.work.solved is None and told.startswith(OWN) and "Depth sigma / µm" in told
    for row in parameter_rows(result, (name,)):
        assert row[0] == WARP or all(part in told for part in row)
    assert "2448 x 2048" in told and LINE not in told


def test_it_goes_when_it_is_removed_and_with_its_project(qtbot: QtBot, solved: Desk) -> None:
    reopened(qtbot, solved)
    used = solved.session.project
    remove(solved.work)
    assert solved.found.text.toPlainText() == EMPTY
    solved.session.document.undo()
    assert solved.found.text.toPlainText().startswith(OWN)
    open_again(solved, used.model_copy(update={"calibration": Calibration()}))
    assert solved.found.text.toPlainText() == EMPTY


def test_its_true_depth_error_follows_the_scene(qtbot: QtBot, solved: Desk) -> None:
    reopened(qtbot, solved)
    before = solved.found.depths.found
    session = solved.session
    fx = session.project.scene.camera.fx
    assert before is not None and session.set(("scene", "rig", "camera", "fx"), 1.001 * fx)
    assert "being worked out" in solved.found.text.toPlainText()
    qtbot.waitUntil(lambda: solved.found.depths.found is not None, timeout=60_000)
    now = solved.found.depths.found
    assert now is not None and now[0].true is not None and before[0].true is not None
    assert now[0].true != before[0].true and "being worked out" not in solved.found.text.toPlainText()


def test_a_hidden_panel_works_nothing_out(qtbot: QtBot, solved: Desk) -> None:
    use(solved.work)
    solved.found.hide()
    open_again(solved, solved.session.project)
    assert not solved.found.depths._rest.isActive()
    solved.found.show()
    assert solved.found.text.toPlainText().startswith(OWN) and solved.found.depths._rest.isActive()


def test_the_warp_of_the_board_is_explained_where_the_mouse_rests(solved: Desk) -> None:
    browser = solved.found.text
    solved.found.resize(420, 700)
    solved.found.show()
    cursor = browser.document().find("board warp")
    browser.setTextCursor(cursor)
    place = browser.cursorRect(cursor).center() - QPoint(5, 0)
    event = QHelpEvent(QEvent.Type.ToolTip, place, browser.viewport().mapToGlobal(place))
    QApplication.sendEvent(browser.viewport(), event)
    assert QToolTip.text() == BOARD_WARP, "as it has two numbers"
    assert browser.document().find("fx px").charFormat().toolTip() == ""
