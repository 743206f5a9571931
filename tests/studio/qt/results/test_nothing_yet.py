"""The results panel of a project that was scanned before."""

from __future__ import annotations

import datetime
from pathlib import Path

from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.qt.results.nothing_yet import NothingYet
from tests.studio.scan_of_steps import small_scan


def test_results_beside_the_project_are_offered(qtbot: QtBot, tmp_path: Path) -> None:
    file, folder = small_scan(tmp_path)
    session = Session(Document(Project.load(file), None, file.parent))
    made = NothingYet(session)
    qtbot.addWidget(made)
    made.show()
    assert not made.offer.isVisible(), "a template was never scanned"
    beside = folder.rename(file.parent / "scan")
    session.replace_document(Document(Project.load(file), file))
    qtbot.waitUntil(made.offer.isVisible)
    today = datetime.datetime.now()
    assert made.offer.text().startswith(f"Open the results of {today.day} {today:%B %Y}, ")
    with qtbot.waitSignal(session.results_asked) as asked:
        qtbot.mouseClick(made.offer, Qt.MouseButton.LeftButton)
    assert asked.args == [beside]
    scan_steps(session).close()
