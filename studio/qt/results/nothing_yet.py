"""What stands where results will be: how to have some, and those that lie beside the project already."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from studio.project.date_and_time import read_out
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.qt.core.widgets import text_button
from studio.scan.scan_beside import scan_beside
from studio.scan.scan_folder import ScanFolder

NOTHING = (
    "No figures yet. Render the frame (F5), run a scan, or open the results of one: line, points and errors appear "
    "here, those of a scan when it has run to its end. One that was stopped goes on by Render > Resume the scan."
)
LANE = "scan beside"


class NothingYet(QWidget):
    """Looks for the newest finished scan of the project that was opened, while this is what is seen."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.folder: Path | None = None
        self.offer = text_button("", name="primary")
        self.offer.hide()
        self.offer.clicked.connect(self._open)
        nothing = QLabel(NOTHING, alignment=Qt.AlignmentFlag.AlignCenter, wordWrap=True)
        nothing.setObjectName("muted")
        column = QVBoxLayout(self)
        column.addStretch(1)
        column.addWidget(nothing)
        column.addWidget(self.offer, 0, Qt.AlignmentFlag.AlignHCenter)
        column.addStretch(1)
        self._soon = QTimer(self, singleShot=True, interval=0)
        self._soon.timeout.connect(self.look)
        session.document_replaced.connect(self._another_document)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._soon.start()

    def look(self) -> None:
        """In the background, as folders may be far away."""
        session, document = self.session, self.session.document
        if document.path is None or not self.isVisible():
            return
        project, place = session.project, document.path.parent

        def then(found: ScanFolder | None) -> None:
            if session.document is document:
                self._offer(found)

        scan_steps(session).runner.run(LANE, "look for a scan", lambda *_: scan_beside(project, place), then)

    def _another_document(self) -> None:
        self._offer(None)
        self._soon.start()

    def _offer(self, found: ScanFolder | None) -> None:
        self.folder = None if found is None else found.folder
        self.offer.setVisible(found is not None)
        if found is not None:
            when = read_out(str(found.manifest.get("created") or found.folder.name))
            self.offer.setText(f"Open the results of {when}")
            self.offer.setToolTip(f"A finished scan of this project: {found.folder}")

    def _open(self) -> None:
        if self.folder is not None:
            self.session.results_asked.emit(self.folder)
